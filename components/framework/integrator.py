"""The one internal integrator: a classical Runge-Kutta step of order 4 as a CasADi function.

    u(s) = u + s (u1 + s (u2 + s u3 / 3) / 2),  s the time since the communication point t                 (1)
    k1 = f(t + s, x, u(s)), k2 = f(t + s + h/2, x + h/2 k1, u(s + h/2)), k3 likewise with k2,              (2)
    k4 = f(t + s + h, x + h k3, u(s + h))
    x+ = project(x + h/6 (k1 + 2 k2 + 2 k3 + k4))                                                          (3)

The Python slaves run this function, the native ones the C code that CasADi writes for it: the same operations in the
same order.
"""

import casadi as ca


def rk4(rates: ca.Function, project: ca.Function | None) -> ca.Function:
    """Return advance(t, x, u, u1, u2, u3, p, c, s, h) -> x+, one internal step of size h that starts s after t.

    rates: f(t, x, u, p, c) -> dx. project: (x, p, c) -> x, applied to the result (a unit quaternion, a shadow set).
    """
    t, s, h = ca.MX.sym("t"), ca.MX.sym("s"), ca.MX.sym("h")
    x, u, p, c = (ca.MX.sym(n, rates.size_in(n)) for n in ("x", "u", "p", "c"))
    u1, u2, u3 = (ca.MX.sym(n, u.shape) for n in ("u1", "u2", "u3"))

    def f(after: ca.MX, state: ca.MX) -> ca.MX:
        since = s + after
        moved = u + since * (u1 + 0.5 * since * (u2 + since * u3 / 3))  # (1)
        return rates(t + since, state, moved, p, c)

    zero = ca.MX(0)
    k1 = f(zero, x)
    k2 = f(h / 2, x + h / 2 * k1)
    k3 = f(h / 2, x + h / 2 * k2)
    k4 = f(h, x + h * k3)
    end = x + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
    if project is not None:
        end = project(end, p, c)
    names = ["t", "x", "u", "u1", "u2", "u3", "p", "c", "s", "h"]
    return ca.Function("advance", [t, x, u, u1, u2, u3, p, c, s, h], [end], names, ["x_next"])
