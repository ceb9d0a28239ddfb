"""Linear components: their eigenvalues are known. A file of its own, for a python FMU carries it."""

import casadi as ca

from components.framework import Component, Parameter, State


class Linear(Component):
    """x' = A x."""

    solver_step = 1e-3

    n: int = 2
    A = Parameter(unit="1/s", shape=("n", "n"), start=0.0, doc="matrix")
    x = State(unit="1", shape=("n",), start=1.0, output=True, doc="state")

    def derivatives(self, t, x, u, p):
        return {"x": p.A @ x.x}


class Chain(Component):
    """A chain of `n` states, whose fastest decay is at 4 k."""

    solver_step = 1e-3

    n: int = 150
    k = Parameter(unit="1/s", start=2500.0, doc="coupling")
    x = State(unit="1", shape=("n",), start=1.0, output=True, doc="state")

    def derivatives(self, t, x, u, p):
        before, after = ca.vertcat(0, x.x[:-1]), ca.vertcat(x.x[1:], 0)
        return {"x": p.k * (before - 2 * x.x + after)}
