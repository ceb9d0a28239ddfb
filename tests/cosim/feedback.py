"""A body and a law with direct feedthrough, whose loop has a closed form; all numbers without units."""

from components.framework import Component, Input, Output, Parameter, State


class Body(Component):
    """x' = v, v' = f."""

    f = Input(unit="1", doc="force on a unit mass")
    x = State(unit="1", start=1.0, output=True, doc="position")
    v = State(unit="1", start=-0.5, output=True, doc="speed")

    def derivatives(self, t, x, u, p):
        return {"x": x.v, "v": u.f}


class Feedback(Component):
    """f = -k x - d v - z, z' = x."""

    x_in = Input(unit="1", doc="position")
    v_in = Input(unit="1", doc="speed")
    k = Parameter(unit="1", start=3.0, doc="stiffness")
    d = Parameter(unit="1", start=1.5, doc="damping")
    z = State(unit="1", start=0.2, output=True, doc="integral of the position")
    f = Output(unit="1", doc="force")

    def derivatives(self, t, x, u, p):
        return {"z": u.x_in}

    def outputs(self, t, x, u, p):
        return {"f": -p.k * u.x_in - p.d * u.v_in - x.z}
