"""The drag-free satellite: parameters that its plant and controller share, and where it starts.

Frames: N inertial, S satellite and cage, T test mass. The start values are no paper's: components/numbers/neutral.py;
the test mass rests in the middle of its cage, which is at the mass centre of a satellite on a circle in the equator.
"""

import numpy as np

from . import vehicle
from .framework import Parameter
from .numbers import neutral

J = vehicle.J
m_sc = Parameter(unit="kg", start=neutral.M_SC, doc="mass of the satellite without the test mass")
m_tm = Parameter(unit="kg", start=neutral.M_TM, doc="mass of the test mass")
I_tm = Parameter(unit="kg.m2", start=neutral.I_TM, doc="inertia of the test mass, a cube, about any axis")
K = Parameter(unit="N/m", doc="stiffness between test mass and satellite; negative: it pushes away")
D = Parameter(unit="N.s/m", doc="damping between test mass and satellite")
K_r = Parameter(unit="N.m/rad", doc="rotational stiffness between test mass and satellite")
D_r = Parameter(unit="N.m.s/rad", doc="rotational damping between test mass and satellite")

START_R_N = np.array([neutral.ORBIT_RADIUS, 0.0, 0.0])  # m
START_V_N = np.array([0.0, neutral.ORBIT_SPEED, 0.0])  # m/s
