"""A stiff loop of two units whose held exchange diverges above a step known in closed form.

    x' = -u,   u = k x,   u held over a step H:  x_k+1 = (1 - k H) x_k                             (1)
so that x stays bounded up to H = 2 / k, and its sign and size are known in every step.

Source: none needed.
"""

from components.framework import Component, Input, Output, Parameter, State


class Store(Component):
    u = Input(unit="1/s", doc="what flows out, a second")
    x = State(unit="1", start=1.0, output=True, doc="what is stored")

    def derivatives(self, t, x, u, p):
        return {"x": -u.u}  # (1)


class Gain(Component):
    k = Parameter(unit="1/s", start=100.0, doc="gain")
    x = Input(unit="1", doc="what is stored")
    u = Output(unit="1/s", doc="what flows out, a second")

    def outputs(self, t, x, u, p):
        return {"u": p.k * u.x}  # (1)


LINKS = [("store.x", "gain.x", "after_step"), ("gain.u", "store.u")]
