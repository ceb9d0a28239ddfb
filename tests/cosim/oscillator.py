"""An oscillator of two units whose stiffness and damping may change in flight.

Source: none needed.
"""

from components.framework import CalculatedParameter, Component, Condition, Input, Output, Parameter, State


class Mass(Component):
    """x'' = a, a = f - k x; `mass` stands for what is fixed, x must not begin at 0, and k stay positive."""

    k = Parameter(unit="1/s2", start=4.0, tunable=True, doc="stiffness over mass")
    mass = Parameter(unit="kg", start=1.0, doc="mass")
    minus_k = CalculatedParameter(unit="1/s2", doc="-k")
    f = Input(unit="m/s2", doc="force over mass")
    x = State(unit="m", start=1.0, output=True, doc="position")
    v = State(unit="m/s", output=True, doc="rate")
    a = Output(unit="m/s2", doc="acceleration")

    def derivatives(self, t, x, u, p):
        return {"x": x.v, "v": u.f / p.mass + p.minus_k * x.x}

    def outputs(self, t, x, u, p):
        return {"a": u.f / p.mass + p.minus_k * x.x}

    def calculate(self, p):
        return {"minus_k": -p.k}

    def check(self, t, x, u, p):
        return [
            Condition(p.k, "k = {} 1/s2: it must be positive.", (p.k,)),
            Condition(x.x**2 - 1e-6, "x = {} m: it must not begin at 0.", (x.x,)),
        ]


class Damper(Component):
    """f = -c v."""

    c = Parameter(unit="1/s", start=0.5, tunable=True, doc="damping over mass")
    v = Input(unit="m/s", doc="rate")
    f = Output(unit="m/s2", doc="force over mass")

    def outputs(self, t, x, u, p):
        return {"f": -p.c * u.v}


class SampledDamper(Component):
    """f = -c v, held from sample to sample; n counts them."""

    sample_time = 0.1
    c = Parameter(unit="1/s", start=0.5, tunable=True, doc="damping over mass")
    v = Input(unit="m/s", doc="rate")
    f = Output(unit="m/s2", doc="force over mass")
    n = State(unit="1", output=True, doc="samples")

    def update(self, t, x, u, p):
        return {"n": x.n + 1}

    def outputs(self, t, x, u, p):
        return {"f": -p.c * u.v}
