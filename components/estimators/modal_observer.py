"""Estimate of the modal coordinates of a flexible spacecraft from its body rate.

With psi = eta' + delta w the modes obey
    eta' = psi - delta w,  psi' = -Omega^2 eta - 2 zeta Omega (psi - delta w)                     (1)
without J and torque, so that a copy of (1) driven by w is exact from a matched start. Gains L add what the model of
the rate does not explain; z needs no derivative of w:
    [eta; psi] = z + L (w + M^-1 h)                                                               (2)
    z' = right sides of (1) at (2) - L M^-1 (tau - w x (J w + delta^T eta' + h) + delta^T a)      (3)
    a = 2 zeta Omega eta' + Omega^2 eta,  eta' = psi - delta w,  M = J - delta^T delta            (4)
The actuators' torque is -h', so that M w' + h' is the bracket of (3): with h in (2) no rate of it is needed either, and
tau is torque from outside.
The error of the estimate obeys, but for w x delta^T eta',
    E' = (A - L C) E,  A the matrix of (1), C = M^-1 delta^T [Omega^2  2 zeta Omega]              (5)

Symbols: w omega_BN_B, tau tau_B, h h_B, all in body axes B; hats of the estimates are left out. delta has a row a mode.
Source: Y. Geng, W. Wu, Y. Ma, Neural network compensation of flexible satellite rapid maneuver, J. Harbin Inst. Tech.
44(5), 2012, equation (2), changed: psi has eta', the matrix has Omega^2 and 2 zeta Omega, the driving term has w. L is
not in the paper; the start value L = 0 is its observer.
Invariants: the estimate is the truth from a matched start, for any J and torque where L = 0.
Limits: with L = 0 an error at the start decays with the modes' own damping only; with L, errors of J and of the torque
enter. Gains of the wrong sign are refused by the sum of the poles of (5), the trace of A - L C; that it is not positive
does not prove (5) stable: `place_gains` gives gains that are. A rate held over a step enters as if it had jumped:
connect it with its end-of-step value or as a ramp.
"""

import warnings
from typing import Any

import casadi as ca
import numpy as np

from .. import vehicle
from ..framework import CalculatedParameter, Component, ComponentError, Condition, Input, Output, Parameter, State


class ModalObserver(Component):
    role = "estimator"
    modes: int = 4  # structural: modes that are estimated

    J = vehicle.J
    delta = vehicle.delta
    Omega = vehicle.Omega
    zeta = vehicle.zeta
    L_eta = Parameter(unit="kg^(1/2).m.s", shape=("modes", 3), doc="gain on the rate's model, for eta")
    L_psi = Parameter(unit="kg^(1/2).m", shape=("modes", 3), doc="gain on the rate's model, for psi")
    eta_start = Parameter(unit="kg^(1/2).m", shape=("modes",), doc="estimate of eta at the start")
    eta_dot_start = Parameter(unit="kg^(1/2).m/s", shape=("modes",), doc="estimate of eta' at the start")
    hub_inverse = CalculatedParameter(unit="1/(kg.m2)", shape=(3, 3), doc="inverse of M = J - delta^T delta")

    omega_BN_B = Input(unit="rad/s", shape=(3,), display_unit="deg/s", nominal=1e-2, doc="body rate, measured")
    tau_B = Input(unit="N.m", shape=(3,), doc="torque on the hub from outside, as of thrusters; not used where L = 0")
    h_B = Input(
        unit="N.m.s",
        shape=(3,),
        rate_acts=True,
        doc="momentum stored by the actuators, minus its rate their torque; not used where L = 0",
    )

    z_eta = State(unit="kg^(1/2).m", shape=("modes",), calculated=True, nominal=1e-2, doc="z, part of eta")
    z_psi = State(unit="kg^(1/2).m/s", shape=("modes",), calculated=True, nominal=1e-2, doc="z, part of psi")

    eta = Output(unit="kg^(1/2).m", shape=("modes",), nominal=1e-2, doc="modal coordinate, estimated")
    eta_dot = Output(unit="kg^(1/2).m/s", shape=("modes",), nominal=1e-2, doc="modal rate, estimated")
    valid = Output(unit="1", doc="1: the estimate may be used")

    def calculate(self, p: Any) -> dict[str, Any]:
        return {"hub_inverse": ca.inv(p.J - p.delta.T @ p.delta)}

    def initial(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        seen = self._seen(u, p)
        psi_start = p.eta_dot_start + p.delta @ u.omega_BN_B
        return {"z_eta": p.eta_start - p.L_eta @ seen, "z_psi": psi_start - p.L_psi @ seen}  # (2)

    def derivatives(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        w = u.omega_BN_B
        eta, eta_dot = self._estimate(x, u, p)
        a = 2 * p.zeta * p.Omega * eta_dot + p.Omega**2 * eta  # (4)
        torque = u.tau_B - ca.cross(w, p.J @ w + p.delta.T @ eta_dot + u.h_B) + p.delta.T @ a
        seen_dot = p.hub_inverse @ torque
        return {"z_eta": eta_dot - p.L_eta @ seen_dot, "z_psi": -a - p.L_psi @ seen_dot}  # (3)

    def outputs(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        eta, eta_dot = self._estimate(x, u, p)
        return {"eta": eta, "eta_dot": eta_dot, "valid": 1}

    def check(self, t: Any, x: Any, u: Any, p: Any) -> list[Condition]:
        conditions = vehicle.flexible_conditions(self, p)
        modes = p.delta @ p.hub_inverse  # M^-1 delta^T, a row a mode
        seen = modes * ca.repmat(p.Omega**2, 1, 3) * p.L_eta + modes * ca.repmat(2 * p.zeta * p.Omega, 1, 3) * p.L_psi
        poles = -ca.sum1(2 * p.zeta * p.Omega) - ca.sum1(ca.sum2(seen))  # tr(A - L C) of (5)
        text = (
            "L_eta, L_psi let the error of the estimate grow: the sum of its poles, tr(A - L C), is {} 1/s, it must "
            "not be positive. Check their sign."
        )
        rounding = 1e-9 * ca.sum1(p.Omega)
        return [*conditions, Condition(poles <= rounding, text, (poles,))]

    def _estimate(self, x: Any, u: Any, p: Any) -> tuple[Any, Any]:
        """Return eta and eta'."""
        seen = self._seen(u, p)
        eta, psi = x.z_eta + p.L_eta @ seen, x.z_psi + p.L_psi @ seen  # (2)
        return eta, psi - p.delta @ u.omega_BN_B  # (4)

    def _seen(self, u: Any, p: Any) -> Any:
        """Return what the gains see: its rate is that of the body without the actuators' torque."""
        return u.omega_BN_B + p.hub_inverse @ u.h_B  # (2)


def place_gains(J: Any, delta: Any, Omega: Any, zeta: Any, poles: Any) -> tuple[np.ndarray, np.ndarray]:
    """Return L_eta and L_psi that give the error of the estimate the poles, two a mode: for when an FMU is built.

    Raises `ComponentError` for poles with which the error would not decay, too few or too many, and complex ones
    without their conjugates.
    """
    from scipy.signal import place_poles  # slow to import, and an FMU on its target has no scipy

    inertia, coupling, frequency, damping_ratio = (np.asarray(v, float) for v in (J, delta, Omega, zeta))
    n = len(frequency)
    wanted = np.atleast_1d(poles)
    _check_poles(wanted, 2 * n)
    stiffness, damping = np.diag(frequency**2), np.diag(2 * damping_ratio * frequency)
    A = np.block([[np.zeros((n, n)), np.eye(n)], [-stiffness, -damping]])
    C = np.linalg.solve(inertia - coupling.T @ coupling, coupling.T @ np.hstack([stiffness, damping]))  # (5)
    with warnings.catch_warnings():  # that no better conditioned gains were found; the poles are placed all the same
        warnings.simplefilter("ignore", UserWarning)
        found: Any = place_poles(A.T, C.T, wanted)  # a bunch of results without types
    L = found.gain_matrix.T  # (5)
    return L[:n], L[n:]


def _check_poles(poles: np.ndarray, count: int) -> None:
    name = ModalObserver.__name__
    if len(poles) != count:
        raise ComponentError(name, f"{len(poles)} poles were given for {count // 2} modes: give two a mode, {count}.")
    unstable = ", ".join(f"{pole:g}" for pole in poles if not pole.real < 0)
    if unstable:
        raise ComponentError(
            name, f"with the poles {unstable} 1/s the error of the estimate does not decay: give negative real parts."
        )
    if not np.allclose(np.sort_complex(poles), np.sort_complex(poles.conj())):
        single = ", ".join(f"{pole:g}" for pole in poles if not np.isclose(poles, pole.conj()).any())
        raise ComponentError(name, f"the poles {single} 1/s lack their conjugates: give complex poles in pairs.")
