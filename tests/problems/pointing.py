"""One axis of a body on a weak spring, pointed by a PD law, in two units.

    J w' = u - c w - k theta,   theta' = w                                                         (1)
    u = K_p (theta_r - theta) - K_d w                                                              (2)

Symbols: theta angle, w rate, u torque, theta_r the angle wanted.
Source: Newton's law.
"""

from components.framework import Component, Input, Output, Parameter, State


class Axis(Component):
    solver_step = 1e-3

    J = Parameter(unit="kg.m2", start=100.0, doc="inertia")
    c = Parameter(unit="N.m.s/rad", start=0.5, doc="damping")
    k = Parameter(unit="N.m/rad", start=1.0, doc="stiffness")
    u = Input(unit="N.m", doc="torque")
    theta = State(unit="rad", start=0.1, output=True, doc="angle")
    w = State(unit="rad/s", output=True, doc="rate")

    def derivatives(self, t, x, u, p):
        return {"theta": x.w, "w": (u.u - p.c * x.w - p.k * x.theta) / p.J}  # (1)


class Law(Component):
    K_p = Parameter(unit="N.m/rad", start=4.0, doc="stiffness of the law")
    K_d = Parameter(unit="N.m.s/rad", start=28.0, doc="damping of the law")
    theta_r = Parameter(unit="rad", start=0.2, doc="angle wanted")
    theta = Input(unit="rad", doc="angle")
    w = Input(unit="rad/s", doc="rate")
    u = Output(unit="N.m", doc="torque")

    def outputs(self, t, x, u, p):
        return {"u": p.K_p * (p.theta_r - u.theta) - p.K_d * u.w}  # (2)
