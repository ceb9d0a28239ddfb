"""A sampled component alone, sample after sample: its outputs and states as rows."""

from collections.abc import Mapping

import casadi as ca
import numpy as np
from helpers import Point, split

from components.framework import Component


def stepped(part: Component) -> ca.Function:
    """(x, t, u, p) -> the states after a sample at t, and them and the outputs that they show."""
    f = part.functions
    x, t, u, p = (ca.MX.sym(n, f.update.size_in(k)) for k, n in ((1, "x"), (0, "t"), (2, "u"), (3, "p")))
    after = f.update(t, x, u, p, f.calculate(p))
    shown = f.outputs(t, after, u, p, f.calculate(p), ca.MX(0, 1))
    return ca.Function("stepped", [x, t, u, p], [after, ca.vertcat(after, shown)])


def samples(part: Component, times: np.ndarray, inputs: Mapping[str, np.ndarray] | None = None, **values):
    """States and outputs after samples at these times, rows; inputs: name -> rows; values: as of `helpers.Point`."""
    point = Point(part, **values)
    u, at = np.tile(point.u, (len(times), 1)), 0
    for v in part.inputs:
        if inputs and v.name in inputs:
            u[:, at : at + v.size] = np.reshape(inputs[v.name], (len(times), v.size))
        at += v.size
    if inputs:
        point.u, point.t = u[0], times[0]
        point.x = point.initial()
    p = np.tile(point.p, (len(times), 1)).T
    _, rows = stepped(part).mapaccum(len(times))(point.x, times[None], u.T, p)
    return split((*part.states, *part.outputs_declared), rows.full().T)
