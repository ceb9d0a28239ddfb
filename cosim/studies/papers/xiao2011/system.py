"""The experiments of xiao2011.

B. Xiao, Q. Hu, G. Ma, Adaptive L2-gain controller for flexible spacecraft attitude tracking, Control Theory &
Applications 28(1), 2011, 101-107, section 4.

The Euler angles Theta = (phi, theta, psi) are of the sequence 3-2-1 from the orbit frame (x forward, y opposite to the
orbit normal, z to nadir, turning with -w0 about y):
    omega_BN_B = R(Theta) Theta' - w0 c_2,  R = [1   0         -sin theta                         (1)
                                                 0   cos phi    sin phi cos theta
                                                 0  -sin phi    cos phi cos theta]
with c_2 the second column of dcm_BR. Chosen where the paper is silent (it takes them from a reference that it does not
print): the inertia, the disturbance, Theta'(0) = 0, the initial attitudes: case S, J_i |theta_i(0)| = 4.4 kg m^2, and
case L, 22 kg m^2; the initial weights, uniform(0, 1) from numpy's default_rng(2011). The network of g in units of 1/J_i
and the floor of its output are the smallest change that lets the law work; as printed it does not settle.
"""

from dataclasses import replace
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from components.numbers.xiao2011 import (
    C_1,
    C_2,
    G_MIN,
    GAMMA,
    INERTIA,
    LARGE,
    MOVE,
    MOVE_FREQUENCY,
    NODES,
    ORBIT_RATE,
    P_1,
    PID_GAINS,
    SIGMA,
    SMALL,
    U_MAX,
    K,
    initial_angles,
    initial_weights,
)
from cosim.arrays import FloatArray
from cosim.masters.explicit import Explicit
from cosim.studies.papers.flight import Flight
from cosim.system import Connection, Experiment, System, Value

L2, L2_LARGE, L2_LARGE_K5 = "xiao2011-l2gain", "xiao2011-l2gain-large", "xiao2011-l2gain-large-k5"
L2_PRINTED, L2_UNCONSTRAINED = "xiao2011-l2gain-printed", "xiao2011-l2gain-unconstrained"
SHAKEN, OVERLOADED = "xiao2011-l2gain-shaken", "xiao2011-l2gain-overloaded"
TRACKING, NO_FEEDFORWARD = "xiao2011-l2gain-tracking", "xiao2011-l2gain-tracking-no-feedforward"
PID, PID_LARGE, PID_ANTIWINDUP = "xiao2011-pid", "xiao2011-pid-large", "xiao2011-pid-antiwindup"

# Printed
DELTA = np.diag([0.3, 1.8, -21.0])  # kg^1/2 m
OMEGA = [1.02, 1.02, 1.1316]  # rad/s
XI = 0.03

# Chosen
DISTURBANCE = 1e-3 * np.array([[1.0, 0.0, 1.0], [0.0, 1.5, 3.0], [3.0, 3.0, 0.0]])  # N m: bias, sine, cosine
DISTURBANCE_RATE = 10 * ORBIT_RATE
K_LARGE = 0.2  # k that suits case L
NO_LIMIT = 1e9  # N m
SHAKE = 22.4, 1e-3  # rad/s, rad/s^2: where the linearised loop has its largest gain
OVERLOAD = 0.3  # N m an axis, more than the wheels have
W_F, W_G = initial_weights()

MEASURED = ["q_BN", "omega_BN_B"]
REFERENCE = ["q_RN", "omega_RN_R", "omega_dot_RN_R"]


def l2gain() -> Flight:
    """Adaptive L2-gain control with input constraint, case S, weights of g in units of 1/J, figures 1-4."""
    return _l2gain(L2)


def l2gain_large() -> Flight:
    """The same from case L with k = 0.2."""
    return _l2gain(L2_LARGE, size=LARGE, k=K_LARGE, stop=600.0)


def l2gain_large_k5() -> Flight:
    """The same from case L with the paper's k = 5."""
    return _l2gain(L2_LARGE_K5, size=LARGE, stop=600.0)


def l2gain_printed() -> Flight:
    """Adaptive L2-gain control with the weights as printed, case S: does not settle."""
    return _l2gain(L2_PRINTED, normalised=0.0)


def l2gain_unconstrained() -> Flight:
    """Adaptive L2-gain control without limits (Theorem 1), case S."""
    return _l2gain(L2_UNCONSTRAINED, limit=NO_LIMIT, stop=100.0)


def l2gain_tracking() -> Flight:
    """Adaptive L2-gain control of angles wanted that move by 5 deg, with their derivatives in the law, case S."""
    return _tracking(TRACKING, 1.0)


def l2gain_tracking_no_feedforward() -> Flight:
    """The same without the derivatives of the angles wanted."""
    return _tracking(NO_FEEDFORWARD, 0.0)


def l2gain_shaken() -> Flight:
    """A rigid body at rest shaken at 22.4 rad/s, weights of g exact, no limit: the L2 gain of Theorem 1."""
    omega, size = SHAKE
    return _from_rest(SHAKEN, "sine", [j * size for j in INERTIA], omega, NO_LIMIT, 12.0, 2e-4)


def l2gain_overloaded() -> Flight:
    """The same under a constant torque above the limit: the L2 gain of Theorem 2 in saturation."""
    return _from_rest(OVERLOADED, "bias", [OVERLOAD] * 3, DISTURBANCE_RATE, U_MAX, 60.0, 1e-3)


def pid() -> Flight:
    """PID control with a hard limit, case S, figures 5-8."""
    return _pid(PID)


def pid_large() -> Flight:
    """PID control with a hard limit, case L, figures 5-8."""
    return _pid(PID_LARGE, size=LARGE)


def pid_antiwindup() -> Flight:
    """PID control with conditional integration, case L."""
    return _pid(PID_ANTIWINDUP, size=LARGE, conditional=1.0)


def initial_attitude(size: float) -> tuple[FloatArray, FloatArray]:
    """Return q_BN, scalar first, and omega_BN_B in rad/s at rest in the orbit frame, which is N at t = 0."""
    q_BR = Rotation.from_euler("ZYX", initial_angles(size)[::-1])
    omega_BN_B = q_BR.inv().apply([0.0, -ORBIT_RATE, 0.0])  # (1), Theta' = 0
    return q_BR.as_quat(scalar_first=True), omega_BN_B


def _l2gain(
    name: str, size: float = SMALL, k: float = K, normalised: float = 1.0, limit: float = U_MAX, stop: float = 400.0
) -> Flight:
    gains = {
        "controller.normalised": normalised,
        "controller.time_unit": Value(1.0, "s"),
        "controller.k_theta": k,
        "controller.p1": P_1,
        "controller.gamma_l2": GAMMA,
        "controller.c1": C_1,
        "controller.c2": C_2,
        "controller.g_min": Value(G_MIN, "1/(kg.m2)"),
        "controller.theta_centres": np.zeros((3, NODES)),
        "controller.theta_dot_centres": np.zeros((3, NODES)),
        "controller.theta_width": Value(SIGMA, "rad"),
        "controller.W_f": W_F,
        "controller.W_g": W_G,
        "controller.e1": [0.0, 0.0, 0.0],
    }
    return _flight(name, "AdaptiveL2Gain", size, gains, limit, stop)


def _tracking(name: str, feedforward: float) -> Flight:
    """Case S with angles wanted, y_d = 5 deg sin(0.02 t) about each axis of the orbit frame."""
    system, experiment = _l2gain(name, stop=600.0)
    wanted = ["q_ON", "omega_ON_O", "y_d", "y_d_dot", "y_d_ddot"]
    kept = {key: value for key, value in system.parameters.items() if not key.startswith("guidance.")}
    system = replace(
        system,
        components=system.components | {"guidance": "OrbitFrameSinusoid", "controller": "AdaptiveL2GainTracking"},
        connections=[
            *system.connections,
            *(Connection(f"guidance.{port}", f"controller.{port}", "after_step") for port in wanted),
        ],
        parameters=kept
        | {
            "guidance.orbit_rate": Value(ORBIT_RATE, "rad/s"),
            "guidance.orbit_phase": Value(0.0, "rad"),
            "guidance.amplitude": Value([MOVE] * 3, "deg"),
            "guidance.frequency": Value([MOVE_FREQUENCY] * 3, "rad/s"),
            "guidance.phase": Value([0.0] * 3, "rad"),
            "guidance.bias": Value([0.0] * 3, "rad"),
            "controller.feedforward": feedforward,
        },
    )
    return system, experiment


def _from_rest(
    name: str, part: str, torque: list[float], frequency: float, limit: float, stop: float, step: float
) -> Flight:
    """A rigid body at rest in inertial axes under one torque, f and g known at the start: V(0) = 0 in the theorems."""
    system, experiment = _l2gain(name, limit=limit, stop=stop)
    gone = ("plant.eta", "plant.eta_dot", "guidance.orbit_rate", "guidance.phase")
    kept = {key: value for key, value in system.parameters.items() if key not in gone}
    system = replace(
        system,
        components=system.components | {"plant": "FlexibleSpacecraft:modes=0", "guidance": "AttitudeStep"},
        vehicle={key: value for key, value in system.vehicle.items() if key not in ("delta", "Omega", "zeta")},
        parameters=kept
        | {
            "plant.q_BN": [1.0, 0.0, 0.0, 0.0],
            "plant.omega_BN_B": Value([0.0] * 3, "rad/s"),
            "guidance.angle": Value(0.0, "deg"),  # at rest in inertial axes
            **{f"environment.{name}": Value([0.0] * 3, "N.m") for name in ("bias", "sine", "cosine")},
            f"environment.{part}": Value(torque, "N.m"),
            "environment.frequency": Value(frequency, "rad/s"),
            "controller.W_f": np.zeros((3, NODES)),
            "controller.W_g": np.full((3, NODES), 1 / NODES),
            "controller.c2": 1e-12,  # g is known: its network stays
        },
    )
    return system, replace(experiment, communication_step_size=step, every=5)


def _pid(name: str, size: float = SMALL, conditional: float = 0.0) -> Flight:
    K_p, K_i, K_d = PID_GAINS
    gains = {
        "controller.K_p": Value([K_p] * 3, "N.m/rad"),
        "controller.K_i": Value([K_i] * 3, "N.m/(rad.s)"),
        "controller.K_d": Value([K_d] * 3, "N.m.s/rad"),
        "controller.conditional": conditional,
        "controller.euler": 1.0,
        "controller.integral": [0.0, 0.0, 0.0],
    }
    return _flight(name, "PID", size, gains, U_MAX, 400.0)


def _flight(name: str, controller: str, size: float, gains: dict[str, Any], limit: float, stop: float) -> Flight:
    q_BN, omega_BN_B = initial_attitude(size)
    bias, sine, cosine = DISTURBANCE
    system = System(
        name=name,
        components={
            "guidance": "OrbitFrame",
            "environment": "HarmonicTorque",
            "controller": controller,
            "actuators": "ReactionWheels",
            "plant": "FlexibleSpacecraft:modes=3",
        },
        connections=[
            *(Connection(f"plant.{port}", f"controller.{port}", "after_step") for port in MEASURED),
            *(Connection(f"guidance.{port}", f"controller.{port}", "after_step") for port in REFERENCE),
            Connection("controller.tau_command_B", "actuators.tau_command_B", "at_point"),
            Connection("actuators.h_B", "plant.h_B", "ramp"),
            Connection("environment.tau_dist_B", "plant.tau_dist_B", "midpoint"),
        ],
        held={"plant.tau_B": [0.0, 0.0, 0.0]},
        vehicle={
            "J": Value(np.diag(INERTIA), "kg.m2"),
            "delta": Value(DELTA.T, "kg^(1/2).m"),
            "Omega": Value(OMEGA, "rad/s"),
            "zeta": [XI] * 3,
            "torque_limit": Value([limit] * 3, "N.m"),
            "spin_axes_B": np.eye(3),
        },
        parameters={
            "*.solver.step": Value(1e-3, "s"),
            "plant.q_BN": q_BN,
            "plant.omega_BN_B": Value(omega_BN_B, "rad/s"),
            "plant.eta": [0.0] * 3,
            "plant.eta_dot": [0.0] * 3,
            "guidance.orbit_rate": Value(ORBIT_RATE, "rad/s"),
            "guidance.phase": Value(0.0, "rad"),
            "environment.bias": Value(bias, "N.m"),
            "environment.sine": Value(sine, "N.m"),
            "environment.cosine": Value(cosine, "N.m"),
            "environment.frequency": Value(DISTURBANCE_RATE, "rad/s"),
            "actuators.wheel_momentum": Value([0.0] * 3, "N.m.s"),
            **gains,
        },
    )
    # 1 ms: the switching runs are of first order in the step, 10 ms settles 2 s late, and case L of PID needs 1 ms.
    # Largest error of the attitude over the whole flight at 1 ms, to an iterated flight at 1/4 ms: l2gain 1.6e-4 deg
    # (held 3.8e-3), pid 1.3e-7 (held 8.1e-5). What is left of l2gain's comes at 6.4 s, where the torque goes over from
    # one limit to the other within 30 ms.
    master = Explicit(inputs="smooth", extrapolation=1)
    return system, Experiment(stop_time=stop, communication_step_size=1e-3, every=10, master=master)
