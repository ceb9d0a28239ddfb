"""The numbers and the four experiments of zhang2018.

C. Zhang, Y. Sun, G. Ma, C. Li, Prescribed performance adaptive attitude tracking control for flexible spacecraft,
J. Harbin Inst. Tech. 50(4), 2018, 10.11918/j.issn.0367-6234.201612089, section 4.

The Euler angles theta = (phi, th, psi) are of the sequence 1-2-3: v_B = R_z(psi) R_y(th) R_x(phi) v_N with passive
rotations, so that
    omega_BN_B = G(theta) theta',  G = [ cos psi cos th  sin psi  0                               (3)
                                        -sin psi cos th  cos psi  0
                                         sin th          0        1]
Chosen where the paper is silent: the rates of its Table 1 are those of the Euler angles, the controller's angles are in
degrees, the disturbance is in body axes, the panels and the adaptation start at zero, 200 s, no torque limit.
"""

from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from cosim.arrays import FloatArray
from cosim.masters.explicit import Explicit
from cosim.studies.papers.flight import Flight
from cosim.system import Connection, Experiment, System, Value

PPATC, ATC = "zhang2018-ppatc", "zhang2018-atc"
PPATC_HALF, ATC_HALF = "zhang2018-ppatc-half", "zhang2018-atc-half"

# Table 1
J = [[420.8, 3.6, -4.2], [3.6, 410.6, 9.4], [-4.2, 9.4, 690.7]]  # kg m2
F_1 = np.array(  # kg^1/2 m; a row an axis, a column a mode of panel 1
    [[2.62, -1.24e-3, -8.20e-4, 6.44e-1], [6.89e-3, 1.24e-1, 4.37e-1, 6.26e-3], [-3.44e-3, -2.73, -5.08e-2, 3.29e-3]]
)
F_2 = -F_1
OMEGA = 2 * np.pi * np.array([0.379, 1.042, 1.331, 2.226])  # rad/s, of either panel
ZETA = 0.005
THETA_0 = [0.25, 0.15, -0.20]  # deg
THETA_DOT_0 = [0.02, 0.01, -0.02]  # deg/s

# Table 2
RHO_0, RHO_INF = 0.3, 0.005  # deg
DECAY = 0.15  # k, 1/s
OVERSHOOT = 0.0  # delta

# Gains, section 4
LAMBDA = [0.125, 0.125, 0.125]
K = [0.5, 0.1, 0.5]
SIGMA, BETA, GAMMA = 0.01, 0.01, 0.01
TAU_W, TAU_MU = 0.5, 0.5
WIDTH = 0.1
CENTRES = [
    [-0.25, -0.17, -0.08, 0, 0.08, 0.17, 0.25],
    [-0.15, -0.10, -0.05, 0, 0.05, 0.10, 0.15],
    [-0.20, -0.13, -0.07, 0, 0.07, 0.13, 0.20],
]
RATE_CENTRES = [
    [-0.03, -0.02, -0.01, 0, 0.01, 0.02, 0.03],
    [-0.15, -0.10, -0.05, 0, 0.05, 0.10, 0.15],
    [-0.03, -0.02, -0.01, 0, 0.01, 0.02, 0.03],  # the first is printed 0.03
]

STOP_TIME = 200.0  # s


def ppatc() -> Flight:
    """Prescribed performance adaptive tracking (PPATC) of a sinusoidal attitude, figures 2-8."""
    return _flight(PPATC, "PrescribedPerformance", 1.0)


def atc() -> Flight:
    """Adaptive tracking (ATC), the same gains without prescribed performance, figures 2-4."""
    return _flight(ATC, "AdaptiveTracking", 1.0)


def ppatc_half() -> Flight:
    """PPATC with K, tau_w and tau_mu halved, figures 9-11."""
    return _flight(PPATC_HALF, "PrescribedPerformance", 0.5)


def atc_half() -> Flight:
    """ATC with K, tau_w and tau_mu halved, figures 9-11."""
    return _flight(ATC_HALF, "AdaptiveTracking", 0.5)


def initial_attitude() -> tuple[FloatArray, FloatArray]:
    """Return q_BN, scalar first, and omega_BN_B in rad/s, of Table 1."""
    _, th, psi = theta = np.radians(THETA_0)
    s, c = np.sin(psi), np.cos(psi)
    G = np.array([[c * np.cos(th), s, 0], [-s * np.cos(th), c, 0], [np.sin(th), 0, 1]])  # (3)
    return Rotation.from_euler("XYZ", theta).as_quat(scalar_first=True), G @ np.radians(THETA_DOT_0)


def _flight(name: str, controller: str, gain_factor: float) -> Flight:
    q_BN, omega_BN_B = initial_attitude()
    system = System(
        name=name,
        components={
            "guidance": "EulerSinusoid",
            "environment": "HarmonicTorque",
            "controller": controller,
            "plant": "FlexibleSpacecraft",
        },
        connections=[
            Connection("plant.q_BN", "controller.q_BN", "after_step"),
            Connection("plant.omega_BN_B", "controller.omega_BN_B", "after_step"),
            Connection("guidance.q_RN", "controller.q_RN", "after_step"),
            Connection("guidance.omega_RN_R", "controller.omega_RN_R", "after_step"),
            Connection("guidance.omega_dot_RN_R", "controller.omega_dot_RN_R", "after_step"),
            Connection("controller.tau_command_B", "plant.tau_B", "at_point"),
            # A known function of time: its mean over the step is at hand without an iteration, and second order.
            Connection("environment.tau_dist_B", "plant.tau_dist_B", "midpoint"),
        ],
        held={"plant.h_B": [0.0, 0.0, 0.0]},
        vehicle={
            "J": Value(J, "kg.m2"),
            "delta": Value(np.hstack([F_1, F_2]).T, "kg(1/2).m"),
            "Omega": Value(np.tile(OMEGA, 2), "rad/s"),
            "zeta": [ZETA] * 8,
        },
        parameters={
            "plant.q_BN": q_BN,
            "plant.omega_BN_B": Value(omega_BN_B, "rad/s"),
            "guidance.amplitude": Value([0.5, 1.0, -0.5], "deg"),
            "guidance.frequency": Value([0.1, 0.1, 0.1], "rad/s"),
            "guidance.phase": Value([0.0, 0.0, 0.0], "rad"),
            "guidance.bias": Value([0.0, 0.0, 0.0], "rad"),
            "environment.bias": Value([0.0045, 0.0, 0.0045], "N.m"),
            "environment.sine": Value([0.0, 0.0045, 0.0045], "N.m"),
            "environment.cosine": Value([0.0045, 0.0045, 0.0], "N.m"),
            "environment.frequency": Value(0.0011, "rad/s"),
            **_gains(gain_factor),
            **(_performance() if controller == "PrescribedPerformance" else {}),
        },
    )
    # Centred: with the measurement held over a step, mu_hat(200 s) would be off by 3.4e-5, h/2 tau_mu |s(0)| e^-1.
    master = Explicit(centred=True)
    return system, Experiment(stop_time=STOP_TIME, communication_step_size=1e-3, every=10, master=master)


def _gains(factor: float) -> dict[str, Any]:
    return {
        "controller.angle_unit": Value(1.0, "deg"),
        "controller.Lambda": LAMBDA,
        "controller.K": [factor * k for k in K],
        "controller.sigma": SIGMA,
        "controller.tau_w": factor * TAU_W,
        "controller.tau_mu": factor * TAU_MU,
        "controller.beta": BETA,
        "controller.gamma": GAMMA,
        "controller.centres": CENTRES,
        "controller.rate_centres": RATE_CENTRES,
        "controller.width": WIDTH,
        "controller.rate_width": WIDTH,
    }


def _performance() -> dict[str, Any]:
    return {
        "controller.rho_0": Value([RHO_0] * 3, "deg"),
        "controller.rho_inf": Value([RHO_INF] * 3, "deg"),
        "controller.k": [DECAY] * 3,
        "controller.overshoot": [OVERSHOOT] * 3,
    }
