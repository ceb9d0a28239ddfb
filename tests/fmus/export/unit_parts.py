"""Components with unit vectors of every kind. A file of its own, for a python FMU carries it."""

import casadi as ca
import numpy as np

from components.framework import Component, Output, Parameter, PythonComponent, State
from components.mathematics import quaternion

TILTED = ((0.6, 0.0), (0.0, -0.0), (0.8, 1.0))


class Pointing(Component):
    """A turning attitude, a mounting, an axis that is tunable, and two axes as columns."""

    mounting = Parameter(unit="1", shape=(4,), start=(1, 0, 0, 0), unit_length=True, doc="mounting")
    line = Parameter(unit="1", shape=(3,), start=(0, 0, 1), unit_length=True, tunable=True, doc="line of sight")
    axes = Parameter(unit="1", shape=(3, 2), start=TILTED, unit_length=True, doc="axes")
    q = State(unit="1", shape=(4,), start=(1, 0, 0, 0), unit_length=True, output=True, doc="attitude")
    seen = Output(unit="1", shape=(3,), doc="line, mounted")
    sizes = Output(unit="1", shape=(2,), doc="squared lengths of the axes")

    def derivatives(self, t, x, u, p):
        return {"q": quaternion.rate(x.q, 0.1 * p.axes[:, 0])}

    def outputs(self, t, x, u, p):
        return {"seen": quaternion.rotate(p.mounting, p.line), "sizes": ca.vertcat(*ca.sum1(p.axes**2).T.nz)}


class PlainPointing(PythonComponent):
    """The same in plain Python, as far as it goes."""

    line = Parameter(unit="1", shape=(3,), start=(0, 0, 1), unit_length=True, doc="line of sight")
    length = Output(unit="1", doc="length of line")

    def outputs(self, t, x, u, p):
        return {"length": float(np.linalg.norm(p.line))}
