"""A component with parameters, states and outputs of every shape."""

import casadi as ca
import numpy as np

from components.framework import (
    CalculatedParameter,
    Component,
    Input,
    Output,
    Parameter,
    State,
)


class Lag(Component):
    """A matrix gain before lags: parameters, states and outputs of every shape."""

    n: int = 2

    K = Parameter(unit="1", shape=("n", 3), start=lambda c: np.arange(3.0 * c.n).reshape(c.n, 3), doc="gain")
    T = Parameter(unit="s", start=2.0, tunable=True, doc="time constant")
    rate = CalculatedParameter(unit="1/s", doc="1 / T")
    u = Input(unit="N.m", shape=(3,), start=(1.0, 2.0, 3.0), doc="input")
    x = State(unit="N.m", shape=("n",), output=True, doc="lagged")
    y = Output(unit="N.m", shape=("n", 3), doc="K u_j, element by element")
    w = Output(unit="N.m/s", doc="a rate")

    def calculate(self, p):
        return {"rate": 1 / p.T}

    def derivatives(self, t, x, u, p):
        return {"x": p.rate * (p.K @ u.u - x.x)}

    def outputs(self, t, x, u, p):
        return {"y": p.K * ca.repmat(u.u.T, self.n, 1), "w": p.rate * ca.sum1(x.x)}
