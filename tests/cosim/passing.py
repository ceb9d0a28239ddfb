"""Units that pass values on: one follows what others make of it.

Source: none needed.
"""

from components.framework import Component, Input, Output, Parameter, State


class Passer(Component):
    """y = now; z' = later - z: `now` is wanted before what follows from y, `later` may come from there."""

    now = Input(unit="m/s", doc="passed on")
    later = Input(unit="m/s", doc="followed")
    z = State(unit="m/s", output=True, doc="what follows")
    y = Output(unit="m/s", doc="what is passed on")

    def derivatives(self, t, x, u, p):
        return {"z": u.later - x.z}

    def outputs(self, t, x, u, p):
        return {"y": u.now}


class Doubler(Component):
    """y = 2 u."""

    u = Input(unit="m/s", doc="what is doubled")
    y = Output(unit="m/s", doc="twice that")

    def outputs(self, t, x, u, p):
        return {"y": 2 * u.u}


class Level(Component):
    """y = level."""

    level = Parameter(unit="m/s", start=1.0, tunable=True, doc="what is told")
    y = Output(unit="m/s", doc="told")

    def outputs(self, t, x, u, p):
        return {"y": p.level}
