"""The experiments of li2014, with the paper's numbers.

Source: H. Li, L. Fan, Design of adaptive neural network controllers for LEO drag-free satellite, Computing Technology
and Automation 33(2), 2014, section 4. Chosen where the paper is silent: gains and grid of the networks, the orbit (260
km, 96.7 deg, as GOCE), the drag, the other axes of the initial state, the thrusters, the sensors and their noise.

    inertial pointing: the reference has the attitude of the inertial axes                        (1)
    LVLH pointing: z to nadir, y opposite to the orbit normal, from position and velocity         (2)
Names end in -nn with the networks, in -no-nn with their weights frozen at zero. Those with `spectrum` have gusts and
are long enough for a spectral density; all others have the mean atmosphere only.
"""

from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from cosim.masters.explicit import Explicit
from cosim.studies.papers.flight import Flight
from cosim.studies.papers.li2014.hardware import hardware
from cosim.system import Connection, Experiment, System, Value

NN, NO_NN = "li2014-nn", "li2014-no-nn"
NN_LVLH, NO_NN_LVLH = "li2014-nn-lvlh", "li2014-no-nn-lvlh"
ACTUATORS, PRINTED_START = "li2014-actuators", "li2014-printed-start-with-limits"
NN_SPECTRUM, NO_NN_SPECTRUM = "li2014-nn-lvlh-spectrum", "li2014-no-nn-lvlh-spectrum"

# section 4
M_SC, M_TM = 1050.0, 1.0  # kg
I_SC, I_TM = 200.0, 2.667e-4  # kg m2
K, D = 1e-6, 1.4e-11  # N/m, N s/m
K_R, D_R = 1e-9, 3.3e-14  # N m/rad, N m s/rad
R_REL = [1.0, -0.5, 0.8]  # mm; x as printed
PHI_REL = [1.0, -0.5, 0.8]  # deg; x as printed
# chosen
PHI_SC = [0.5, -0.3, 0.4]  # deg
MU, J2, EARTH_RADIUS = 3.986004418e14, 1.08262668e-3, 6378136.3
ALTITUDE, INCLINATION, NODE, LATITUDE = 260e3, 96.7, 30.0, 20.0  # m, deg
CAGE = [0.05, -0.03, 0.02]  # m
GAP = 4.0  # mm
RHO_0 = 6.05585818e-11  # kg/m3, for a mean drag of 7 mN over an orbit
MEAN_DRAG = 7e-3  # N
GUSTS = [0.1 * MEAN_DRAG, 0.02 * MEAN_DRAG, 0.02 * MEAN_DRAG]  # N/sqrt(Hz), along-track and lateral
GUST_BAND = [2e-3, 0.2]  # Hz
SAMPLE = 0.1  # s
FEEDFORWARD = [7.8e-3, 0.0, 0.0]  # N, against the drag at the start, LVLH

STOP_TIME, SPECTRUM_TIME = 200.0, 2000.0  # s
CAGE_TIME = 60.0  # s, the test mass is at its cage before, which ends the run


def nn() -> Flight:
    """Adaptive neural backstepping of a drag-free satellite, inertial pointing, ideal actuators, figures 1-3."""
    return _flight(NN, lvlh=False, network=True)


def no_nn() -> Flight:
    """The same with the networks' weights frozen at zero."""
    return _flight(NO_NN, lvlh=False, network=False)


def nn_lvlh() -> Flight:
    """Networks on, the satellite points to the Earth."""
    return _flight(NN_LVLH, lvlh=True, network=True)


def no_nn_lvlh() -> Flight:
    """Networks off, the satellite points to the Earth."""
    return _flight(NO_NN_LVLH, lvlh=True, network=False)


def actuators() -> Flight:
    """Limits, slew, quantisation, sensor noise and gusts, from an acquired state; drag fed forward; slow attitude."""
    acquired = {
        "plant.r_rel": [0.0, 0.0, 0.0],
        "plant.q_TS": [1.0, 0.0, 0.0, 0.0],
        "plant.q_SN": _orbit_attitude().as_quat(scalar_first=True),
        "controller.stiffness": [1.0, 0.0, 1.0],
        "controller.k_1": [1.0, 0.05, 1.0],
        "controller.k_2": [1.0, 0.05, 1.0],
        "controller.Gamma": [10.0, np.pi / 1e-3, 10.0],
        "controller.f_feedforward_S": Value(FEEDFORWARD, "N"),
        "actuators.f_last": Value(FEEDFORWARD, "N"),
        "actuators.f_now": Value(FEEDFORWARD, "N"),
    }
    return _flight(ACTUATORS, lvlh=True, network=True, limits=True, gusts=True, changed=acquired)


def printed_start_with_limits() -> Flight:
    """The paper's initial state with the limits of the actuators: ends with the test mass at its cage."""
    return _flight(PRINTED_START, lvlh=True, network=True, limits=True)


def nn_lvlh_spectrum() -> Flight:
    """Networks on, with gusts, long enough for a spectral density of the residual acceleration."""
    return _flight(NN_SPECTRUM, lvlh=True, network=True, gusts=True)


def no_nn_lvlh_spectrum() -> Flight:
    """Networks off, with gusts, long enough for a spectral density of the residual acceleration."""
    return _flight(NO_NN_SPECTRUM, lvlh=True, network=False, gusts=True)


def orbit() -> tuple[np.ndarray, np.ndarray]:
    """Return position (m) and velocity (m/s) at the start, inertial axes: a circular orbit."""
    plane = Rotation.from_euler("ZXZ", [NODE, INCLINATION, LATITUDE], degrees=True)
    radius = EARTH_RADIUS + ALTITUDE
    return plane.apply([radius, 0, 0]), plane.apply([0, np.sqrt(MU / radius), 0])


def _orbit_attitude() -> Rotation:
    """Return the orbit frame at the start, v_N = q v_R q*."""
    r, v = orbit()
    z, y = -r / np.linalg.norm(r), -np.cross(r, v) / np.linalg.norm(np.cross(r, v))
    return Rotation.from_matrix(np.array([np.cross(y, z), y, z]).T)  # (2)


def initial_state(lvlh: bool) -> dict[str, Any]:
    """Return the plant's initial state; angles are of sequence 3-2-1, rates zero or that of the orbit."""
    r, v = orbit()
    reference = _orbit_attitude() if lvlh else Rotation.identity()  # (1), (2)
    turned = Rotation.from_euler("ZYX", np.radians(PHI_SC[::-1]))
    rate = turned.inv().apply(_orbit_rate()) if lvlh else np.zeros(3)
    return {
        "plant.r_N": Value(r, "m"),
        "plant.v_N": Value(v, "m/s"),
        "plant.q_SN": (reference * turned).as_quat(scalar_first=True),
        "plant.omega_SN_S": Value(rate, "rad/s"),
        "plant.r_rel": Value(R_REL, "mm"),
        "plant.v_rel": Value([0.0] * 3, "m/s"),
        "plant.q_TS": Rotation.from_euler("ZYX", np.radians(PHI_REL[::-1])).as_quat(scalar_first=True),
        "plant.omega_TS_T": Value([0.0] * 3, "rad/s"),
    }


def _orbit_rate() -> np.ndarray:
    """Return the rate of the orbit frame at the start in its own axes, with J2."""
    r, v = orbit()
    h, r1, z = np.cross(r, v), np.linalg.norm(r), r[2]
    shape = np.array([1 - 5 * z**2 / r1**2, 1 - 5 * z**2 / r1**2, 3 - 5 * z**2 / r1**2])
    g = -MU * r / r1**3 - 1.5 * MU * J2 * EARTH_RADIUS**2 / r1**5 * shape * r
    return _orbit_attitude().inv().apply(h / r1**2 + r * (g @ h) / (h @ h))


def _flight(
    name: str,
    *,
    lvlh: bool,
    network: bool,
    limits: bool = False,
    gusts: bool = False,
    changed: dict[str, Any] | None = None,
) -> Flight:
    components = {
        "plant": "DragFreeSatellite",
        "environment": "LowOrbit",
        "guidance": "OrbitFrameFromState" if lvlh else "AttitudeStep",
        **({"sensor": "StarTrackerGyro", "cage_sensor": "ElectrostaticSensor"} if limits else {}),
        "controller": "DragFreeBackstepping",
        **({"actuators": "Thrusters", "suspension": "ElectrostaticSuspension"} if limits else {}),
    }
    parameters = _vehicle() | initial_state(lvlh) | _environment(gusts) | _gains(network)
    if not lvlh:
        parameters |= {"guidance.angle": Value(0.0, "deg"), "guidance.q_start": [1.0, 0.0, 0.0, 0.0]}
    if limits:
        parameters |= hardware()
    system = System(
        name=name,
        components=components,
        connections=[*_measured(limits), *_common(lvlh), *_commands(limits)],
        vehicle={"J": Value((I_SC * np.eye(3)).tolist(), "kg.m2")},
        parameters=parameters | (changed or {}),
    )
    step = SAMPLE if limits else 2e-2 if gusts else 2e-3
    # Not centred: the guidance would be half a step behind the plant when the controller takes the mean of both.
    experiment = Experiment(
        stop_time=SPECTRUM_TIME if gusts else CAGE_TIME if limits else STOP_TIME,
        communication_step_size=step,
        every=1 if limits else 10,
        stop_when="plant.cage_contact" if limits else "",
        master=Explicit(),
    )
    return system, experiment


def _common(lvlh: bool) -> list[Connection]:
    """Return orbit and reference: at the same instant as the plant."""
    links = [
        Connection("plant.r_N", "environment.r_N", "after_step"),
        Connection("plant.v_N", "environment.v_N", "after_step"),
        Connection("plant.q_SN", "environment.q_BN", "after_step"),
        Connection("environment.f_dist_B", "plant.f_dist_S", "at_point"),
        Connection("environment.tau_dist_B", "plant.tau_dist_S", "at_point"),
        Connection("guidance.q_RN", "controller.q_RN", "after_step"),
        Connection("guidance.omega_RN_R", "controller.omega_RN_R", "after_step"),
    ]
    if lvlh:
        links.append(Connection("plant.r_N", "guidance.r_N", "after_step"))
        links.append(Connection("plant.v_N", "guidance.v_N", "after_step"))
    return links


def _measured(sensors: bool) -> list[Connection]:
    names = ("r_rel", "v_rel", "q_TS", "omega_TS_T", "q_SN", "omega_SN_S")
    if not sensors:
        return [Connection(f"plant.{n}", f"controller.{n}", "after_step") for n in names]
    pairs = [
        ("plant.r_rel", "cage_sensor.r_rel_true"),
        ("plant.q_TS", "cage_sensor.q_TS_true"),
        ("plant.q_SN", "sensor.q_BN_true"),
        ("plant.omega_SN_S", "sensor.omega_BN_B_true"),
        *((f"cage_sensor.{n}", f"controller.{n}") for n in names[:4]),
        ("sensor.q_BN", "controller.q_SN"),
        ("sensor.omega_BN_B", "controller.omega_SN_S"),
    ]
    return [Connection(a, b, "after_step") for a, b in pairs]


def _commands(limits: bool) -> list[Connection]:
    names = ("f_command_S", "tau_command_S", "tau_command_T")
    if not limits:
        return [Connection(f"controller.{n}", f"plant.{n}", "at_point") for n in names]
    return [
        Connection("controller.f_command_S", "actuators.f_command_S", "after_step"),
        Connection("controller.tau_command_S", "actuators.tau_command_S", "after_step"),
        Connection("controller.tau_command_T", "suspension.tau_command_T", "after_step"),
        Connection("actuators.f_S", "plant.f_command_S", "at_point"),
        Connection("actuators.tau_S", "plant.tau_command_S", "at_point"),
        Connection("suspension.tau_T", "plant.tau_command_T", "at_point"),
    ]


def _vehicle() -> dict[str, Any]:
    shared = {
        "m_sc": Value(M_SC, "kg"),
        "m_tm": Value(M_TM, "kg"),
        "I_tm": Value(I_TM, "kg.m2"),
        "K": Value(K, "N/m"),
        "D": Value(D, "N.s/m"),
        "K_r": Value(K_R, "N.m/rad"),
        "D_r": Value(D_R, "N.m.s/rad"),
    }
    both = {f"{unit}.{name}": value for unit in ("plant", "controller") for name, value in shared.items()}
    return both | {
        "plant.r_h": Value(CAGE, "m"),
        "plant.cage_gap": Value(GAP, "mm"),
        "plant.mu": Value(MU, "m3/s2"),
        "plant.J2": J2,
        "plant.earth_radius": Value(EARTH_RADIUS, "m"),
        "plant.solver.step": Value(0.02, "s"),
        "controller.solver.step": Value(SAMPLE, "s"),
    }


def _environment(gusts: bool) -> dict[str, Any]:
    return {
        "environment.rho_0": Value(RHO_0, "kg/m3"),
        "environment.h_0": Value(ALTITUDE, "m"),
        "environment.scale_height": Value(45e3, "m"),
        "environment.bulge": 0.3,
        "environment.CdA": Value(3.85, "m2"),
        "environment.solar_force": Value(5.9e-5, "N"),
        "environment.sun_N": [0.6, -0.64, 0.48],
        "environment.r_cp": Value([0.10, 0.02, -0.01], "m"),
        "environment.earth_radius": Value(EARTH_RADIUS, "m"),
        "environment.gust_density": GUSTS if gusts else [0.0, 0.0, 0.0],
        "environment.gust_corner": Value(0.01, "1/s"),
        "environment.gust_band": Value(GUST_BAND, "1/s"),
    }


def _gains(network: bool) -> dict[str, Any]:
    return {
        "controller.stiffness": [1.0] * 3,  # lambda, hidden in the print
        "controller.k_1": [1.0] * 3,
        "controller.k_2": [1.0] * 3,
        "controller.Gamma": [1.0] * 3,
        "controller.network": float(network),
        "controller.centres": np.array(np.meshgrid(*[[-1, -0.5, 0, 0.5, 1]] * 2, indexing="ij")).reshape(2, 25),
        "controller.width": 0.5,
        "controller.scale_r": Value(1e-3, "m"),
        "controller.scale_v": Value(1e-3, "m/s"),
        "controller.scale_angle": Value([2e-2] * 2, "rad"),
        "controller.scale_rate": Value([2e-2] * 2, "rad/s"),
    }
