"""The four experiments of zhang2018, each in two readings of the unit of angle.

C. Zhang, Y. Sun, G. Ma, C. Li, Prescribed performance adaptive attitude tracking control for flexible spacecraft,
J. Harbin Inst. Tech. 50(4), 2018, 10.11918/j.issn.0367-6234.201612089, section 4.

The Euler angles theta = (phi, th, psi) are of the sequence 1-2-3: v_B = R_z(psi) R_y(th) R_x(phi) v_N with passive
rotations, so that
    omega_BN_B = G(theta) theta',  G = [ cos psi cos th  sin psi  0                               (3)
                                        -sin psi cos th  cos psi  0
                                         sin th          0        1]
Chosen where the paper is silent: the rates of its Table 1 are those of the Euler angles, the disturbance is in body
axes, the panels and the adaptation start at zero, 200 s, no torque limit. It does not say in which unit its gains take
angles: degrees, in which it prints bounds, start and centres, or radians (`-rad`: the gains and the network's numbers
as printed, bounds and start still in degrees). s of PPATC is free of it, so that K is 57.3 times stronger there.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from components.numbers.zhang2018 import (
    AMPLITUDE,
    BETA,
    BIAS,
    CENTRES,
    COSINE,
    DECAY,
    F_1,
    FREQUENCY,
    GAMMA,
    LAMBDA,
    OMEGA,
    ORBIT_RATE,
    OVERSHOOT,
    RATE_CENTRES,
    RHO_0,
    RHO_INF,
    SIGMA,
    SINE,
    TAU_MU,
    TAU_W,
    THETA_0,
    THETA_DOT_0,
    WIDTH,
    ZETA,
    J,
    K,
)
from cosim.arrays import FloatArray
from cosim.errors import UnknownName
from cosim.masters.explicit import Explicit
from cosim.masters.iterated import Iterated
from cosim.studies.papers.flight import Flight
from cosim.system import Connection, Experiment, System, Value
from cosim.system.system import MasterSettings

PPATC, ATC = "zhang2018-ppatc", "zhang2018-atc"
PPATC_HALF, ATC_HALF = "zhang2018-ppatc-half", "zhang2018-atc-half"

STOP_TIME = 200.0  # s


@dataclass(frozen=True)
class Reading:
    """A unit of angle of the gains: how its experiments' names end, and the master and step that PPATC needs, s."""

    suffix: str
    unit: Value
    master: MasterSettings
    step: float


# The gain of (12) reaches 570 1/s in degrees, 1.2e4 1/s in radians: a torque held over h needs less than 2 / h, one
# that follows its slope less still. Iterated, PPATC in radians flies at any step.
# Largest error of PPATC's attitude over 200 s, deg: in degrees 1.2e-8 at 1 ms (3.0e-9 at .5 ms; held 7.7e-6, and held
# measurements would put mu_hat(200 s) off by 3.4e-5, h/2 tau_mu |s(0)| e^-1); in radians 5.7e-12 at .5 ms (9.7e-11 at
# 1 ms; held at .1 ms 2.8e-6 over 40 s, at three times the cost).
READINGS = {
    "degrees": Reading("", Value(1.0, "deg"), Explicit(extrapolation=1), 1e-3),
    "radians": Reading("-rad", Value(1.0, "rad"), Iterated(), 5e-4),
}


def ppatc() -> Flight:
    """Prescribed performance adaptive tracking (PPATC) of a sinusoidal attitude, figures 2-8."""
    return _flight(PPATC)


def atc() -> Flight:
    """Adaptive tracking (ATC), the same gains without prescribed performance, figures 2-4."""
    return _flight(ATC)


def ppatc_half() -> Flight:
    """PPATC with K, tau_w and tau_mu halved, figures 9-11."""
    return _flight(PPATC_HALF)


def atc_half() -> Flight:
    """ATC with K, tau_w and tau_mu halved, figures 9-11."""
    return _flight(ATC_HALF)


def ppatc_rad() -> Flight:
    """PPATC with gains of angles in radians, figures 2-8."""
    return _flight(PPATC, "radians")


def atc_rad() -> Flight:
    """ATC with gains of angles in radians, figures 2-4."""
    return _flight(ATC, "radians")


def ppatc_half_rad() -> Flight:
    """PPATC with gains of angles in radians, halved, figures 9-11."""
    return _flight(PPATC_HALF, "radians")


def atc_half_rad() -> Flight:
    """ATC with gains of angles in radians, halved, figures 9-11."""
    return _flight(ATC_HALF, "radians")


def read(name: str) -> Reading:
    """Return a reading by its name; raises `UnknownName` with the nearest."""
    if name not in READINGS:
        raise UnknownName("reading", name, "zhang2018", list(READINGS))
    return READINGS[name]


def initial_attitude() -> tuple[FloatArray, FloatArray]:
    """Return q_BN, scalar first, and omega_BN_B in rad/s, of Table 1."""
    _, th, psi = theta = np.radians(THETA_0)
    s, c = np.sin(psi), np.cos(psi)
    G = np.array([[c * np.cos(th), s, 0], [-s * np.cos(th), c, 0], [np.sin(th), 0, 1]])  # (3)
    return Rotation.from_euler("XYZ", theta).as_quat(scalar_first=True), G @ np.radians(THETA_DOT_0)


def _flight(experiment: str, reading: str = "degrees") -> Flight:
    angles = read(reading)
    prescribed = experiment in (PPATC, PPATC_HALF)
    controller = "PrescribedPerformance" if prescribed else "AdaptiveTracking"
    gain_factor = 0.5 if experiment in (PPATC_HALF, ATC_HALF) else 1.0
    q_BN, omega_BN_B = initial_attitude()
    system = System(
        name=experiment + angles.suffix,
        components={
            "guidance": "EulerSinusoid",
            "environment": "HarmonicTorque",
            "controller": controller,
            "plant": "FlexibleSpacecraft",
        },
        connections=[
            Connection("plant.q_BN", "controller.q_BN", "smooth"),
            Connection("plant.omega_BN_B", "controller.omega_BN_B", "smooth"),
            Connection("guidance.q_RN", "controller.q_RN", "smooth"),
            Connection("guidance.omega_RN_R", "controller.omega_RN_R", "smooth"),
            Connection("guidance.omega_dot_RN_R", "controller.omega_dot_RN_R", "smooth"),
            Connection("controller.tau_command_B", "plant.tau_B", "at_point"),
            Connection("environment.tau_dist_B", "plant.tau_dist_B", "smooth"),
        ],
        held={"plant.h_B": [0.0, 0.0, 0.0]},
        vehicle={
            "J": Value(J, "kg.m2"),
            "delta": Value(np.hstack([F_1, -F_1]).T, "kg^(1/2).m"),
            "Omega": Value(np.tile(OMEGA, 2), "rad/s"),
            "zeta": [ZETA] * 8,
        },
        parameters={
            "*.solver.step": Value(1e-3, "s"),
            "plant.q_BN": q_BN,
            "plant.omega_BN_B": Value(omega_BN_B, "rad/s"),
            "guidance.amplitude": Value(AMPLITUDE, "deg"),
            "guidance.frequency": Value([FREQUENCY] * 3, "rad/s"),
            "guidance.phase": Value([0.0, 0.0, 0.0], "rad"),
            "guidance.bias": Value([0.0, 0.0, 0.0], "rad"),
            "environment.bias": Value(BIAS, "N.m"),
            "environment.sine": Value(SINE, "N.m"),
            "environment.cosine": Value(COSINE, "N.m"),
            "environment.frequency": Value(ORBIT_RATE, "rad/s"),
            **_gains(gain_factor, angles.unit),
            **(_performance() if prescribed else {}),
        },
    )
    flown = angles if prescribed else READINGS["degrees"]
    every = round(0.01 / flown.step)
    return system, Experiment(stop_time=STOP_TIME, communication_step_size=flown.step, every=every, master=flown.master)


def _gains(factor: float, unit: Value) -> dict[str, Any]:
    return {
        "controller.angle_unit": unit,
        "controller.hold_step": Value(0.0, "s"),  # the paper's law
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
