"""Two integrators in a loop, x' = v and v' = -x, exact for inputs on lines: the trapezoidal rule, in FMUs of C.

x_k+1 = x_k + h (v_k + v_k+1) / 2,   v_k+1 = v_k - h (x_k + x_k+1) / 2                                (1)
"""

import numpy as np

from ..c_fmu import build, real

LINKS = [("a.y", "b.u"), ("b.y", "a.u")]
A = np.array([[0.0, 1.0], [-1.0, 0.0]])
START = np.array([1.0, 0.0])


def integrator(folder, name, sign=1, start=0.0, before="", **more):
    """An FMU: y' = sign u; `before`: what comes first in fmi2DoStep."""
    step = f"{before} y += {sign} * h * (u + 0.5 * h * m->slope[0]);"
    return build(folder, name, [real("u", "input"), real("y", start=start)], step=step, **more)


def loop(folder, before="", **more):
    """Paths of both, x first, from x = 1 and v = 0; `before` and capabilities of the second."""
    first = integrator(folder, "First", 1, 1.0)
    return {"a": first, "b": integrator(folder, "Second", -1, 0.0, before, **more)}


def trapezoidal(h, steps):
    """The rows of (1)."""
    forward, backward = np.eye(2) + h / 2 * A, np.eye(2) - h / 2 * A
    rows = [START]
    for _ in range(steps):
        rows.append(np.linalg.solve(backward, forward @ rows[-1]))
    return np.array(rows)
