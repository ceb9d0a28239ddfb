"""Friction of a bearing: stiction, Coulomb and viscous friction, as one smooth function of the speed.

    f = e^1/2 (f_s - f_c) (W/b) exp(-(W/b)^2 / 2) + f_c tanh(10 W/b) + c W                        (1)
    slope at rest, the steepest, but for c: (e^1/2 (f_s - f_c) + 10 f_c) / b                      (2)

Symbols: W speed, f_s static and f_c Coulomb friction torque, f_s taken as f_c where it is smaller, b Stribeck speed, c
viscous coefficient; columns of one size. The first term of (1) is f_s - f_c at W = b, its peak.
Source: the friction of a wheel that starts in Basilisk's reactionWheelStateEffector (fStatic, fCoulomb, betaStatic,
cViscous there), which goes over to f_c sign W + c W once a wheel has started.
Invariants: f W >= 0; f is odd. Below the breakaway torque a wheel creeps, at the speed where (1) is the motor's torque.
Limits: no memory (no presliding, no dwell time): at rest without torque it stays, but with a constant torque below f_s
it is slow, not still. Its slope at rest limits the step of an explicit integrator.
"""

from typing import Any

import casadi as ca

ROOT_E = 1.6487212707001282


def friction(W: Any, f_c: Any, f_s: Any, b: Any, c: Any) -> Any:
    """Return the torque against the speed W."""
    s = W / b
    return ROOT_E * ca.fmax(f_s - f_c, 0) * s * ca.exp(-(s**2) / 2) + f_c * ca.tanh(10 * s) + c * W  # (1)


def steepest(f_c: Any, f_s: Any, b: Any) -> Any:
    """Return the slope at rest of the torque without its viscous part."""
    return (ROOT_E * ca.fmax(f_s - f_c, 0) + 10 * f_c) / b  # (2)
