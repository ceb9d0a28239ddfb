"""A free body, and a spring that may hold it; both take a force from outside.

Source: none needed.
"""

from components.framework import Component, Input, Output, Parameter, State


class FreeBody(Component):
    """x' = v, m v' = f; a = f / m follows the force directly."""

    m = Parameter(unit="kg", start=2.0, doc="mass")
    f = Input(unit="N", doc="force")
    x = State(unit="m", output=True, doc="position")
    v = State(unit="m/s", output=True, doc="rate")
    a = Output(unit="m/s2", doc="acceleration")

    def derivatives(self, t, x, u, p):
        return {"x": x.v, "v": u.f / p.m}

    def outputs(self, t, x, u, p):
        return {"a": u.f / p.m}


class Spring(Component):
    """f = f_0 - k x."""

    k = Parameter(unit="N/m", start=4.0, doc="stiffness")
    x = Input(unit="m", doc="position")
    f_0 = Input(unit="N", doc="force from outside")
    f = Output(unit="N", doc="force")

    def outputs(self, t, x, u, p):
        return {"f": u.f_0 - p.k * u.x}
