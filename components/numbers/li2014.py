"""A drag-free satellite in a low orbit.

Source: J. Li, H. Fan, Design of adaptive neural network controllers for LEO drag-free satellite, Computing Technology
and Automation 33(2), 2014, section 4. D and D_r are printed in N/m^2 and N/rad, meant are N s/m and N m s/rad. Chosen
where it is silent: gains and grid of the networks, the orbit (as GOCE's), the environment, the other axes of the
initial state, the thrusters, the sensors and their noise.
"""

# Printed; of R_REL and PHI_REL the x axis
M_SC, M_TM = 1050.0, 1.0  # kg
I_SC, I_TM = 200.0, 2.667e-4  # kg m2
K, D = 1e-6, 1.4e-11  # N/m, N s/m
K_R, D_R = 1e-9, 3.3e-14  # N m/rad, N m s/rad
R_REL = [1.0, -0.5, 0.8]  # mm; x as printed
PHI_REL = [1.0, -0.5, 0.8]  # deg, Euler angles 3-2-1; x as printed

# Chosen
PHI_SC = [0.5, -0.3, 0.4]  # deg, Euler angles 3-2-1
ALTITUDE, INCLINATION, NODE, LATITUDE = 260e3, 96.7, 30.0, 20.0  # m, deg; of a circular orbit
CAGE = [0.05, -0.03, 0.02]  # m
GAP = 4.0  # mm

# Chosen: environment
MEAN_DRAG, RHO_0 = 7e-3, 6.05585818e-11  # N, over an orbit; kg/m3, for this drag
SCALE_HEIGHT, BULGE, CDA = 45e3, 0.3, 3.85  # m, 1, m2
SOLAR_FORCE, SUN_N = 5.9e-5, [0.6, -0.64, 0.48]  # N
PRESSURE_CENTRE = [0.10, 0.02, -0.01]  # m
GUST_CORNER, GUST_BAND = 0.01, [2e-3, 0.2]  # Hz

# Chosen: hardware, an ion thruster as GOCE's, micro-thrusters; position and attitude as seen by LISA Pathfinder
SAMPLE = 0.1  # s
THRUST, MICRO = (1e-3, 20e-3), 0.65e-3  # N: least and most of the ion thruster; most of a micro-thruster, either way
THRUST_RATE, THRUST_QUANTUM, THRUST_NOISE = 2.5e-3, 12e-6, 12e-6  # N/s, N, N/sqrt(Hz)
THRUSTER_TORQUE, SUSPENSION_TORQUE = 1e-3, 2e-8  # N m
ATTITUDE_NOISE, RATE_NOISE = 1e-5, 1e-6  # rad/sqrt(Hz), rad/s/sqrt(Hz)
CAGE_POSITION_NOISE, CAGE_ATTITUDE_NOISE, FILTER_TIME = 2e-9, 150e-9, 0.1  # m/sqrt(Hz), rad/sqrt(Hz), s

# Chosen: law
STIFFNESS, K_1, K_2, GAMMA = 1.0, 1.0, 1.0, 1.0  # lambda, hidden in the print: 1/s2; 1/s, 1/s, s2
WIDTH = 0.5
SCALE_R, SCALE_V, SCALE_ANGLE, SCALE_RATE = 1e-3, 1e-3, 2e-2, 2e-2  # m, m/s, rad, rad/s
