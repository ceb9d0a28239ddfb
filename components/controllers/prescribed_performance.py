"""Adaptive attitude tracking with prescribed performance (PPATC): each angle error stays within a shrinking bound.

    rho = (rho_0 - rho_inf) exp(-k (t - t0)) + rho_inf                                            (5)
    -delta < z < 1 where e(t0) >= 0, else -1 < z < delta;  lo < z < hi                            (6)
    z = e / rho                                                                                   (8)
    epsilon = 1/2 ln((z - lo) / (hi - z))                                                         (9)
    r = 1/2 (1/(z - lo) + 1/(hi - z)) / rho,  nu = e' - e rho'/rho,  epsilon' = r nu              (9a)
    s = Lambda epsilon + epsilon'                                                                 (10)
    s' = V + r theta'',  V = (Lambda r + r') nu
         - r (e' rho' rho + e rho'' rho - e rho'^2) / rho^2 - r theta_d''                         (11)
so that f = -V / r; the rest of the law, network and adaptation are (12)-(14) of euler_tracking.py.
Nearer than m to a bound and beyond it, epsilon goes on as a straight line, z_m = lo + m or hi - m:
    epsilon = epsilon(z_m) + g/2 (z - z_m),  r = g / (2 rho),  g = 1/(z_m - lo) + 1/(hi - z_m)    (17)

Symbols: e, rho, theta_d in the angle unit U of euler_tracking.py; delta is the parameter `overshoot`, since the
vehicle's coupling has that name; side is the sign of e(t0), t0 the time of initialization; m barrier_margin.
Source: C. Zhang, Y. Sun, G. Ma, C. Li, Prescribed performance adaptive attitude tracking control for flexible
spacecraft, J. Harbin Inst. Tech. 50(4), 2018, equations (5)-(14). Changed: rho'' where
the print of epsilon'' has rho'; the second branch of its properties of S is e(0) < 0. (17) is not the paper's: clipping
z instead does not find back.
Invariants: lo < z < hi along the continuous loop, and barrier_time = 0; at D = 0, W = 0 the surface s = 0 is kept.
Limits: those of euler_tracking.py. delta = 0 ends at z = 1/2: a steady error of half the bound. The gain r (k + K) of
(12) grows as rho shrinks (to 570 1/s with the numbers of the paper): a torque held over T needs r (k + K) T < 2, or
`hold_step`.
"""

from typing import Any

import casadi as ca

from ..framework import Condition, Output, Parameter, State
from ..vehicle import DEGREE
from .euler_tracking import Error, EulerTracking, Surface

AXES = ("roll", "pitch", "yaw")


class PrescribedPerformance(EulerTracking):
    rho_0 = Parameter(unit="rad", shape=(3,), start=10 * DEGREE, display_unit="deg", doc="bound of e at the start")
    rho_inf = Parameter(unit="rad", shape=(3,), start=0.1 * DEGREE, display_unit="deg", doc="bound of e at the end")
    k = Parameter(unit="1/s", shape=(3,), start=0.05, doc="rate at which the bound shrinks")
    overshoot = Parameter(unit="1", shape=(3,), start=1.0, doc="delta, overshoot allowed, as a part of the bound")
    barrier_margin = Parameter(
        unit="1", start=0.05, doc="m, part of the bound before it where epsilon becomes straight"
    )

    side = State(unit="1", shape=(3,), calculated=True, doc="1 where e >= 0 at the start, else -1")
    t0 = State(unit="s", calculated=True, doc="time of initialization")
    barrier_time = State(unit="s", output=True, doc="time for which any axis has been beyond the barrier margin")

    rho = Output(unit="rad", shape=(3,), display_unit="deg", nominal=1e-3, doc="bound of e")
    z = Output(unit="1", shape=(3,), doc="e as a part of its bound")
    epsilon = Output(unit="1", shape=(3,), doc="transformed error")
    barrier_hits = Output(unit="1", doc="how many axes are beyond the barrier margin")

    def surface(self, t: Any, x: Any, p: Any, error: Error) -> Surface:
        e, e_dot = error.e, error.e_dot
        rho, fall = self._bound(t, x, p)
        rho_dot, rho_ddot = -p.k * fall, p.k**2 * fall
        z, z_m, lo, hi, inside = self._place(x, p, e, rho)
        epsilon = self._epsilon(z, z_m, lo, hi)
        r = (1 / (z_m - lo) + 1 / (hi - z_m)) / (2 * rho)  # (9a), (17)
        nu = e_dot - e * rho_dot / rho  # (9a)
        z_dot = nu / rho
        r_dot = inside * (1 / (hi - z_m) ** 2 - 1 / (z_m - lo) ** 2) * z_dot / (2 * rho) - r * rho_dot / rho
        s = p.Lambda * epsilon + r * nu  # (10)
        shrinking = (e_dot * rho_dot * rho + e * rho_ddot * rho - e * rho_dot**2) / rho**2
        V = (p.Lambda * r + r_dot) * nu - r * shrinking - r * error.theta_d_ddot  # (11)
        return Surface(s, r, -V / r)

    def initial(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {"side": ca.if_else(self.error(u, p).e >= 0, 1, -1), "t0": t}  # (6)

    def derivatives(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        error = self.error(u, p)
        rates = self.adaptation(x, p, error, self.surface(t, x, p, error).s)
        return rates | {"side": ca.SX.zeros(3), "t0": 0, "barrier_time": self._hits(t, x, p, error) > 0}

    def outputs(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        error = self.error(u, p)
        rho, _ = self._bound(t, x, p)
        z, z_m, lo, hi, _ = self._place(x, p, error.e, rho)
        return self.law(x, u, p, error, self.surface(t, x, p, error)) | {
            "rho": p.angle_unit * rho,
            "z": z,
            "epsilon": self._epsilon(z, z_m, lo, hi),
            "barrier_hits": self._hits(t, x, p, error),
        }

    def check(self, t: Any, x: Any, u: Any, p: Any) -> list[Condition]:
        conditions = super().check(t, x, u, p)
        lo, hi = self._limits(x, p)
        e = p.angle_unit * self.error(u, p).e
        for i, axis in enumerate(AXES):
            n = i + 1
            text = f"rho_0[{n}] = {{}} deg, rho_inf[{n}] = {{}} deg: rho_0 > rho_inf > 0 is needed."
            shown = (p.rho_0[i] / DEGREE, p.rho_inf[i] / DEGREE)
            conditions.append(Condition(ca.fmin(p.rho_0[i] - p.rho_inf[i], p.rho_inf[i]), text, shown))
            text = f"overshoot[{n}] = {{}}: it must be between 0 and 1."
            within = ca.logic_and(p.overshoot[i] >= 0, p.overshoot[i] <= 1)
            conditions.append(Condition(within, text, (p.overshoot[i],)))
            nowhere = ca.logic_and(p.overshoot[i] == 0, e[i] == 0)
            text = (
                f"the initial {axis} error is {{}} deg and overshoot[{n}] is {{}}: epsilon would be infinite. "
                f"Set overshoot[{n}] > 0."
            )
            conditions.append(Condition(ca.logic_not(nowhere), text, (e[i] / DEGREE, p.overshoot[i])))
            text = (
                f"the initial {axis} error is {{}} deg, outside its bound of {{}} to {{}} deg. "
                f"Raise rho_0[{n}] or start nearer."
            )
            shown = (e[i] / DEGREE, lo[i] * p.rho_0[i] / DEGREE, hi[i] * p.rho_0[i] / DEGREE)
            inside = ca.fmin(e[i] - lo[i] * p.rho_0[i], hi[i] * p.rho_0[i] - e[i])
            conditions.append(Condition(ca.if_else(nowhere, 1, inside), text, shown))
        text = "barrier_margin = {}: it must be positive and below {}, half the width of the narrowest bound."
        most = (1 + ca.mmin(p.overshoot)) / 2
        margin = ca.fmin(p.barrier_margin, most - p.barrier_margin)
        return [*conditions, Condition(margin, text, (p.barrier_margin, most))]

    def _bound(self, t: Any, x: Any, p: Any) -> tuple[Any, Any]:
        """Return rho in the angle unit, and its part that falls to zero."""
        fall = (p.rho_0 - p.rho_inf) / p.angle_unit * ca.exp(-p.k * (t - x.t0))
        return fall + p.rho_inf / p.angle_unit, fall  # (5)

    def _limits(self, x: Any, p: Any) -> tuple[Any, Any]:
        return ca.if_else(x.side > 0, -p.overshoot, -1), ca.if_else(x.side > 0, 1, p.overshoot)  # (6)

    def _place(self, x: Any, p: Any, e: Any, rho: Any) -> tuple[Any, Any, Any, Any, Any]:
        """Return z, z moved inside the margins, its limits, and 1 where it was inside."""
        lo, hi = self._limits(x, p)
        z = e / rho  # (8)
        z_m = ca.fmax(lo + p.barrier_margin, ca.fmin(hi - p.barrier_margin, z))
        return z, z_m, lo, hi, z_m == z

    def _epsilon(self, z: Any, z_m: Any, lo: Any, hi: Any) -> Any:
        slope = (1 / (z_m - lo) + 1 / (hi - z_m)) / 2
        return ca.log((z_m - lo) / (hi - z_m)) / 2 + slope * (z - z_m)  # (9), (17)

    def _hits(self, t: Any, x: Any, p: Any, error: Error) -> Any:
        rho, _ = self._bound(t, x, p)
        _, _, _, _, inside = self._place(x, p, error.e, rho)
        return 3 - ca.sum1(inside)
