"""A clock and a sampled sum, for tests of samples in a co-simulation."""

from components.framework import Component, Input, Output, State


class Line(Component):
    """y = t."""

    y = Output(unit="s", doc="time")

    def outputs(self, t, x, u, p):
        return {"y": t}


class Total(Component):
    """Adds its input at every sample."""

    sample_time = 0.1
    u = Input(unit="s", doc="what is added")
    total = State(unit="s", doc="sum")
    shown = Output(unit="s", doc="sum with the sample that is due")

    def update(self, t, x, u, p):
        return {"total": x.total + u.u}

    def outputs(self, t, x, u, p):
        return {"shown": x.total}


class Follower(Component):
    """y' = u."""

    u = Input(unit="s", doc="what is integrated")
    y = State(unit="s2", output=True, doc="its integral")

    def derivatives(self, t, x, u, p):
        return {"y": u.u}
