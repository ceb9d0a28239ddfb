"""Two small components: a plant of second order and a PD controller."""

from components.framework import Component, Input, Output, Parameter, State


class Plant(Component):
    """J angle'' + c angle' + k angle = tau."""

    solver_step = 0.01
    J = Parameter(unit="kg.m2", start=100.0, doc="inertia")
    c = Parameter(unit="N.m.s/rad", start=0.5, doc="damping")
    k = Parameter(unit="N.m/rad", start=1.0, doc="stiffness")
    tau = Input(unit="N.m", doc="torque")
    angle = State(unit="rad", start=0.2, output=True, doc="angle")
    rate = State(unit="rad/s", output=True, doc="rate")

    def derivatives(self, t, x, u, p):
        return {"angle": x.rate, "rate": (u.tau - p.c * x.rate - p.k * x.angle) / p.J}


class Controller(Component):
    """tau = -Kp angle - Kd rate."""

    Kp = Parameter(unit="N.m/rad", start=4.0, doc="stiffness")
    Kd = Parameter(unit="N.m.s/rad", start=28.0, doc="damping")
    angle = Input(unit="rad", start=0.2, doc="angle")
    rate = Input(unit="rad/s", doc="rate")
    tau = Output(unit="N.m", doc="torque")

    def outputs(self, t, x, u, p):
        return {"tau": -p.Kp * u.angle - p.Kd * u.rate}
