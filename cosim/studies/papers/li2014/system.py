"""The experiments of li2014, with the paper's numbers.

Source: J. Li, H. Fan, Design of adaptive neural network controllers for LEO drag-free satellite, Computing Technology
and Automation 33(2), 2014, section 4. Chosen where the paper is silent: gains and grid of the networks, the orbit (260
km, 96.7 deg, as GOCE), the drag, the other axes of the initial state, the thrusters, the sensors and their noise.

Names end in -nn with the networks, in -no-nn with their weights frozen at zero. Those with `spectrum` have gusts and
are long enough for a spectral density; all others have the mean atmosphere only. Those with `design-model` fly on the
model (7) to (9), all others on the full equations.
"""

from typing import Any

import numpy as np

from components.numbers.earth import EARTH_RADIUS, J2, MU
from components.numbers.li2014 import (
    ALTITUDE,
    BULGE,
    CAGE,
    CDA,
    D_R,
    GAMMA,
    GAP,
    GUST_BAND,
    GUST_CORNER,
    I_SC,
    I_TM,
    K_1,
    K_2,
    K_R,
    M_SC,
    M_TM,
    MEAN_DRAG,
    PRESSURE_CENTRE,
    RHO_0,
    SAMPLE,
    SCALE_ANGLE,
    SCALE_HEIGHT,
    SCALE_R,
    SCALE_RATE,
    SCALE_V,
    SOLAR_FORCE,
    STIFFNESS,
    SUN_N,
    WIDTH,
    D,
    K,
)
from cosim.masters.explicit import Explicit
from cosim.studies.papers.flight import Flight
from cosim.studies.papers.li2014 import design
from cosim.studies.papers.li2014.connections import connect, connect_design_model
from cosim.studies.papers.li2014.design import CENTRES
from cosim.studies.papers.li2014.hardware import hardware
from cosim.studies.papers.li2014.start import initial_state, orbit_attitude
from cosim.system import Experiment, System, Value

NN, NO_NN = "li2014-nn", "li2014-no-nn"
NN_LVLH, NO_NN_LVLH = "li2014-nn-lvlh", "li2014-no-nn-lvlh"
ACTUATORS, PRINTED_START = "li2014-actuators", "li2014-printed-start-with-limits"
NN_SPECTRUM, NO_NN_SPECTRUM = "li2014-nn-lvlh-spectrum", "li2014-no-nn-lvlh-spectrum"
PRINTED, CONSISTENT, GAMMA_10 = "li2014-printed-signs", "li2014-consistent", "li2014-gamma10"
DESIGN, DESIGN_NO_NN = "li2014-design-model-nn", "li2014-design-model-no-nn"
DESIGN_PRINTED, DESIGN_CONSISTENT = "li2014-design-model-printed-signs", "li2014-design-model-consistent"
DESIGN_GAMMA = "li2014-design-model-gamma10"

INERTIA = Value((I_SC * np.eye(3)).tolist(), "kg.m2")

# chosen
GUSTS = [0.1 * MEAN_DRAG, 0.02 * MEAN_DRAG, 0.02 * MEAN_DRAG]  # N/sqrt(Hz), along-track and lateral
FEEDFORWARD = [7.8e-3, 0.0, 0.0]  # N, against the drag at the start, LVLH

# Largest error of the satellite's attitude over nn's whole flight at 2 ms, to an iterated flight at .5 ms: 4.7e-7 deg;
# held 5.7e-4. Of r_rel 5.2e-10 m, held 5.4e-7. With sampled thrusters and sensors at .1 s slopes gain nothing: 7.6e-3
# deg, held 5.3e-3.
SLOPES = Explicit(inputs="smooth", extrapolation=1)

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
        "plant.q_SN": orbit_attitude().as_quat(scalar_first=True),
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


def printed_signs() -> Flight:
    """Networks on, with a2, b2 of the law as printed, while spring and damper are those of (5)."""
    return _flight(PRINTED, lvlh=False, network=True, changed={"controller.printed_signs": 1.0})


def consistent() -> Flight:
    """Networks on, the torque on the test mass with what network 2 has learnt, beside u2."""
    return _flight(CONSISTENT, lvlh=False, network=True, changed={"controller.consistent_feedforward": 1.0})


def gamma10() -> Flight:
    """Networks that learn at a tenth of the speed, Gamma = 10."""
    return _flight(GAMMA_10, lvlh=False, network=True, changed={"controller.Gamma": [10.0] * 3})


def design_model_nn() -> Flight:
    """Networks on, on the model (7) to (9) of three loops that the law is designed on, figures 1-3."""
    return _on_design_model(DESIGN)


def design_model_no_nn() -> Flight:
    """Networks off, on the model (7) to (9)."""
    return _on_design_model(DESIGN_NO_NN, network=False)


def design_model_printed_signs() -> Flight:
    """On the model (7) to (9) with a2, b2 as printed, in plant and law: the test mass alone is unstable."""
    return _on_design_model(DESIGN_PRINTED, {f"{unit}.printed_signs": 1.0 for unit in ("plant", "controller")})


def design_model_consistent() -> Flight:
    """On the model (7) to (9), the torque on the test mass with what network 2 has learnt, beside u2."""
    return _on_design_model(DESIGN_CONSISTENT, {"controller.consistent_feedforward": 1.0})


def design_model_gamma10() -> Flight:
    """On the model (7) to (9) with Gamma = 10: networks that learn at a tenth of the speed."""
    return _on_design_model(DESIGN_GAMMA, {"controller.Gamma": [10.0] * 3})


def _on_design_model(name: str, changed: dict[str, Any] | None = None, network: bool = True) -> Flight:
    gains = _gains(network)
    known = ("centres", "width", "scale_r", "scale_v", "scale_angle", "scale_rate")
    nodes = {f"plant.{n}": gains[f"controller.{n}"] for n in known}
    system = System(
        name=name,
        components={"plant": "DragFreeDesignModel", "guidance": "AttitudeStep", "controller": "DragFreeBackstepping"},
        connections=connect_design_model(),
        vehicle={"J": INERTIA},
        parameters=_shared() | design.start() | _inertial() | gains | nodes | (changed or {}),
        held={"plant.f_dist_S": [0.0] * 3, "plant.tau_dist_S": [0.0] * 3},  # what disturbs is in f
    )
    weights = tuple(f"controller.W_{i}" for i in (1, 2, 3))  # what Lyapunov's function is made of, beside the errors
    experiment = Experiment(
        stop_time=STOP_TIME,
        communication_step_size=2e-3,
        every=50,
        record=("*", *weights),
        master=SLOPES,
    )
    return system, experiment


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
        parameters |= _inertial()
    if limits:
        parameters |= hardware()
    system = System(
        name=name,
        components=components,
        connections=connect(lvlh, limits),
        vehicle={"J": INERTIA},
        parameters=parameters | (changed or {}),
    )
    step = SAMPLE if limits else 2e-2 if gusts else 2e-3
    experiment = Experiment(
        stop_time=SPECTRUM_TIME if gusts else CAGE_TIME if limits else STOP_TIME,
        communication_step_size=step,
        every=1 if limits else 10,
        stop_when="plant.cage_contact" if limits else "",
        master=Explicit() if limits else SLOPES,
    )
    return system, experiment


def _inertial() -> dict[str, Any]:
    return {"guidance.angle": Value(0.0, "deg"), "guidance.q_start": [1.0, 0.0, 0.0, 0.0]}


def _shared() -> dict[str, Any]:
    """Return what plant and controller both have, and the steps of their solvers."""
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
    return both | {"plant.solver.step": Value(0.02, "s"), "controller.solver.step": Value(SAMPLE, "s")}


def _vehicle() -> dict[str, Any]:
    return _shared() | {
        "plant.r_h": Value(CAGE, "m"),
        "plant.cage_gap": Value(GAP, "mm"),
        "plant.mu": Value(MU, "m3/s2"),
        "plant.J2": J2,
        "plant.earth_radius": Value(EARTH_RADIUS, "m"),
    }


def _environment(gusts: bool) -> dict[str, Any]:
    return {
        "environment.rho_0": Value(RHO_0, "kg/m3"),
        "environment.h_0": Value(ALTITUDE, "m"),
        "environment.scale_height": Value(SCALE_HEIGHT, "m"),
        "environment.bulge": BULGE,
        "environment.CdA": Value(CDA, "m2"),
        "environment.solar_force": Value(SOLAR_FORCE, "N"),
        "environment.sun_N": SUN_N,
        "environment.r_cp": Value(PRESSURE_CENTRE, "m"),
        "environment.earth_radius": Value(EARTH_RADIUS, "m"),
        "environment.gust_density": GUSTS if gusts else [0.0, 0.0, 0.0],
        "environment.gust_corner": Value(GUST_CORNER, "1/s"),
        "environment.gust_band": Value(GUST_BAND, "1/s"),
    }


def _gains(network: bool) -> dict[str, Any]:
    return {
        "controller.stiffness": [STIFFNESS] * 3,
        "controller.k_1": [K_1] * 3,
        "controller.k_2": [K_2] * 3,
        "controller.Gamma": [GAMMA] * 3,
        "controller.network": float(network),
        "controller.centres": CENTRES,
        "controller.width": WIDTH,
        "controller.scale_r": Value(SCALE_R, "m"),
        "controller.scale_v": Value(SCALE_V, "m/s"),
        "controller.scale_angle": Value([SCALE_ANGLE] * 2, "rad"),
        "controller.scale_rate": Value([SCALE_RATE] * 2, "rad/s"),
    }
