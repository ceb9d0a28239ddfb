"""A random walk in plain Python, its generator in its state: what no equations say."""

from components.framework import Input, Output, Parameter, PythonComponent, State


class Walk(PythonComponent):
    """x += u + r, with r from the numbers n+ = (16807 n) mod (2^31 - 1)."""

    scale = Parameter(unit="1", start=1e-3, doc="size of a step")
    u = Input(unit="1", doc="drift of a step")
    x = State(unit="1", output=True, doc="where it is")
    n = State(unit="1", start=12345.0, doc="the last number")
    y = Output(unit="1", doc="where it is, and the drift")

    def outputs(self, t, x, u, p):
        return {"y": x.x + u.u}

    def step(self, t, h, x, u, p):
        n = float((16807 * int(x.n)) % (2**31 - 1))
        return {"x": x.x + u.u + p.scale * (n / 2**31 - 0.5), "n": n}
