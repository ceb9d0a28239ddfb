"""Adaptive attitude tracking without prescribed performance (ATC).

    s = Lambda e + e'                                                                             (15)
    s' = theta'' - f:  r = 1,  f = theta_d'' - Lambda e'                                          (16)
The rest of the law, network and adaptation are (12)-(14) of euler_tracking.py.

Symbols: e error of the Euler angles 1-2-3, in the angle unit U (degrees unless set) as theta and theta_d are in (16).
Source: C. Zhang, Y. Sun, G. Ma, C. Li, Prescribed performance adaptive attitude tracking control for flexible
spacecraft, J. Harbin Inst. Tech. 50(4), 2018, the law without number in section 4;
(15), (16) are numbers of this file. Changed: theta_d'' where the print has theta_d.
Invariants: at e = e' = 0 and W = 0 the torque is that of the reference motion of a rigid vehicle.
Limits: those of euler_tracking.py; no bound on e.
"""

from typing import Any

from .euler_tracking import Error, EulerTracking, Surface


class AdaptiveTracking(EulerTracking):
    def surface(self, t: Any, x: Any, p: Any, error: Error) -> Surface:
        s = p.Lambda * error.e + error.e_dot  # (15)
        return Surface(s, 1, error.theta_d_ddot - p.Lambda * error.e_dot)  # (16)

    def derivatives(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        error = self.error(u, p)
        return self.adaptation(x, p, error, self.surface(t, x, p, error).s)

    def outputs(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        error = self.error(u, p)
        return self.law(x, u, p, error, self.surface(t, x, p, error))
