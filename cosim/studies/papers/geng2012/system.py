"""The experiments of geng2012.

Y. Geng, W. Wu, Y. Ma, Neural network compensation of flexible satellite rapid maneuver, J. Harbin Inst. Tech. 44(5),
2012, 31-35, section 4: 60 deg about pitch, two parallel control moment gyros and wheels, inertia 20 % off.

The paper flies a cluster with one wheel, about z (section 4), and words another one, whose three wheels take over at
the end of the manoeuvre (section 2). Configuration N is ours, not the paper's: the wheels always give what the gyros do
not, the network learns with gamma = 1, without network the gain is 0.15 N m. Chosen where the paper is silent: the
linear gain G (linear-quadratic), the gains of the observer (none), centres and widths of the network, the boundary
layer, the hand-over from gyros to wheels, the wheels' inertia (it changes their speed only), the sign of the 20 %.
Changed where the print cannot be meant: K = G in place of -(D B)^-1 D A, see `printed_gain`; D has one zero less.
"""

import numpy as np

from components.numbers.geng2012 import GIMBAL_ANGLES
from cosim.studies.papers.flight import Flight
from cosim.studies.papers.geng2012 import gains
from cosim.studies.papers.geng2012.loop import flight
from cosim.system import Value

COMPENSATED, UNCOMPENSATED, LINEAR = "geng2012-compensated", "geng2012-uncompensated", "geng2012-linear"
PRINTED_GAIN, PRINTED_GAMMA = "geng2012-printed-gain", "geng2012-printed-gamma"
Z_WHEEL_ONLY, END_PHASE_WHEELS = "geng2012-z-wheel-only", "geng2012-end-phase-wheels"
WEAK, STRONG = "geng2012-uncompensated-weak", "geng2012-uncompensated-strong"
Z_WHEEL_COMPENSATED, Z_WHEEL_UNCOMPENSATED = "geng2012-z-wheel-compensated", "geng2012-z-wheel-uncompensated"
Z_WHEEL_PRINTED_GAMMA, Z_WHEEL_DEGREES = "geng2012-z-wheel-printed-gamma", "geng2012-z-wheel-degrees"
END_PHASE_COMPENSATED, END_PHASE_UNCOMPENSATED = "geng2012-end-phase-compensated", "geng2012-end-phase-uncompensated"
DEGREES, PREPOSITIONED = "geng2012-degrees", "geng2012-prepositioned"
LIGHT, LIGHT_UNCOMPENSATED = "geng2012-light", "geng2012-light-uncompensated"
NOMINAL, NOMINAL_UNCOMPENSATED = "geng2012-nominal", "geng2012-nominal-uncompensated"
OBSERVER_START, OBSERVER_PLACED = "geng2012-observer-start", "geng2012-observer-placed"
OBSERVER_PLACED_REAL = "geng2012-observer-placed-real"

# Printed: two gyros and one wheel (section 4), three wheels that act in the end phase (section 2), rate of learning
Z_WHEEL = {"trim_wheels": 0.0, "hand_over": 0.0}
END_PHASE = {"trim_wheels": 2.0}
GAMMA_PRINTED = 0.01  # 1/s
GAMMA_DEGREES = float(np.degrees(GAMMA_PRINTED))  # 1/s: sigma in degrees is so much larger

# Chosen: other constant gains, the gimbals' time before the manoeuvre, the observer's start and poles
WEAK_RHO_0, STRONG_RHO_0 = 0.02, 0.5  # N m
POSITIONING_TIME = 10.0  # s
ETA_START = 0.05  # kg^1/2 m, of every mode; true is 0
DECAYS = np.linspace(0.3, 0.5, 4)  # 1/s, of the modes' estimates; their frequencies are kept


def compensated() -> Flight:
    """Integral sliding mode with the network's gain, configuration N (ours), figures 6-9."""
    return flight(COMPENSATED, network=1.0)


def uncompensated() -> Flight:
    """The same with a constant gain of 0.15 N m instead, figures 4-5."""
    return flight(UNCOMPENSATED)


def linear() -> Flight:
    """The linear law alone, without switching term: what the network and the constant gain add to."""
    return flight(LINEAR, rho_0=0.0)


def printed_gain() -> Flight:
    """The gain of x as printed, -(D B)^-1 D A: it has no attitude feedback, the satellite stays where it is."""
    return flight(PRINTED_GAIN, rho_0=0.0, printed_gain=1.0)


def z_wheel_only() -> Flight:
    """The cluster as printed, a wheel about z only: the linear law, no hand-over from the gyros."""
    return flight(Z_WHEEL_ONLY, Z_WHEEL, rho_0=0.0)


def end_phase_wheels() -> Flight:
    """The cluster in the paper's words, x and y wheels in the end phase only: the linear law, hand-over as in N."""
    return flight(END_PHASE_WHEELS, END_PHASE, rho_0=0.0)


def printed_gamma() -> Flight:
    """With the network, its weights learning as slowly as printed, gamma = 0.01: what the claims depend on."""
    return flight(PRINTED_GAMMA, network=1.0, gamma=GAMMA_PRINTED)


def uncompensated_weak() -> Flight:
    """Constant gain of 0.02 N m: the paper does not print its value, and the claims depend on it."""
    return flight(WEAK, rho_0=WEAK_RHO_0)


def uncompensated_strong() -> Flight:
    """Constant gain of 0.5 N m."""
    return flight(STRONG, rho_0=STRONG_RHO_0)


def degrees() -> Flight:
    """Configuration N with the printed gamma = 0.01, sigma in degrees: gamma = 0.573 in radians."""
    return flight(DEGREES, network=1.0, gamma=GAMMA_DEGREES)


def z_wheel_compensated() -> Flight:
    """The paper's law on the cluster of section 4, a wheel about z only; gamma = 1."""
    return flight(Z_WHEEL_COMPENSATED, Z_WHEEL, network=1.0)


def z_wheel_uncompensated() -> Flight:
    """The cluster of section 4 with a constant gain of 0.15 N m."""
    return flight(Z_WHEEL_UNCOMPENSATED, Z_WHEEL)


def z_wheel_printed_gamma() -> Flight:
    """The cluster of section 4 with the printed gamma = 0.01, sigma in radians: all of section 4 as printed."""
    return flight(Z_WHEEL_PRINTED_GAMMA, Z_WHEEL, network=1.0, gamma=GAMMA_PRINTED)


def z_wheel_degrees() -> Flight:
    """The cluster of section 4 with the printed gamma = 0.01, sigma in degrees."""
    return flight(Z_WHEEL_DEGREES, Z_WHEEL, network=1.0, gamma=GAMMA_DEGREES)


def end_phase_compensated() -> Flight:
    """The paper's law on the cluster of section 2, three wheels that help in the end phase; gamma = 1."""
    return flight(END_PHASE_COMPENSATED, END_PHASE, network=1.0)


def end_phase_uncompensated() -> Flight:
    """The cluster of section 2 with a constant gain of 0.15 N m."""
    return flight(END_PHASE_UNCOMPENSATED, END_PHASE)


def light() -> Flight:
    """Configuration N, the 20 % of the inertia with the other sign: true J = 0.8 x nominal."""
    return flight(LIGHT, network=1.0, mismatch=0.8)


def light_uncompensated() -> Flight:
    """True J = 0.8 x nominal, a constant gain of 0.15 N m."""
    return flight(LIGHT_UNCOMPENSATED, mismatch=0.8)


def nominal() -> Flight:
    """Configuration N, the inertia known."""
    return flight(NOMINAL, network=1.0, mismatch=1.0)


def nominal_uncompensated() -> Flight:
    """The inertia known, a constant gain of 0.15 N m."""
    return flight(NOMINAL_UNCOMPENSATED, mismatch=1.0)


def observer_start() -> Flight:
    """Configuration N, the observer without gains starts 0.05 kg^1/2 m off in every mode."""
    return flight(OBSERVER_START, observer={"eta_start": Value([ETA_START] * 4, "kg^(1/2).m")}, network=1.0)


def observer_placed() -> Flight:
    """Configuration N, the observer with placed poles: the modes' frequencies, real parts -0.3 to -0.5 1/s."""
    return flight(OBSERVER_PLACED, observer=gains.observer(gains.oscillating(DECAYS)), network=1.0)


def observer_placed_real() -> Flight:
    """Configuration N, the observer with real poles from -0.3 to -0.5 1/s: with J 20 % off the loop is lost."""
    return flight(OBSERVER_PLACED_REAL, observer=gains.observer(-np.linspace(0.3, 0.5, 8)), network=1.0)


def prepositioned() -> Flight:
    """The gyros, parallel at 0 and pi, are turned to pi/4 and 5 pi/4 before the slew; then as end-phase-compensated."""
    start = -POSITIONING_TIME
    others = {
        "actuators.gimbal_angle": Value([0.0, np.pi], "rad"),
        "steering.gimbal_start": Value(GIMBAL_ANGLES, "rad"),
    }
    return flight(PREPOSITIONED, END_PHASE, network=1.0, start=start, others=others)
