"""The one internal integrator: a classical Runge-Kutta step of order 4 as a CasADi function.

    u(s) = u + s (u1 + s (u2 + s u3 / 3) / 2),  s the time since the communication point t                 (1)
    k1 = f(t + s, x, u(s)), k2 = f(t + s + h/2, x + h/2 k1, u(s + h/2)), k3 likewise with k2,              (2)
    k4 = f(t + s + h, x + h k3, u(s + h))
    x+ = project(x + h/6 (k1 + 2 k2 + 2 k3 + k4))                                                          (3)

The Python slaves run `rk4`. The native ones run the C code that CasADi writes for `rk4_from_first_rate`, which leaves
(1) and k1 to them: they may know these already. The operations are the same in the same order.
"""

from collections.abc import Callable

import casadi as ca

Rates = Callable[[ca.MX, ca.MX, int], ca.MX]


def rk4(rates: ca.Function, project: ca.Function | None) -> ca.Function:
    """Return advance(t, x, u, u1, u2, u3, p, c, s, h) -> x+, one internal step of size h that starts s after t.

    rates: f(t, x, u, p, c) -> dx. project: (x, p, c) -> x, applied to the result (a unit quaternion, a shadow set).
    """
    t, s, h = ca.MX.sym("t"), ca.MX.sym("s"), ca.MX.sym("h")
    x, u, p, c = (ca.MX.sym(n, rates.size_in(n)) for n in ("x", "u", "p", "c"))
    u1, u2, u3 = (ca.MX.sym(n, u.shape) for n in ("u1", "u2", "u3"))

    def f(after: ca.MX, state: ca.MX, _stage: int) -> ca.MX:
        since = s + after
        moved = u + since * (u1 + 0.5 * since * (u2 + since * u3 / 3))  # (1)
        return rates(t + since, state, moved, p, c)

    end = _end(f, x, f(ca.MX(0), x, 0), h)
    if project is not None:
        end = project(end, p, c)
    names = ["t", "x", "u", "u1", "u2", "u3", "p", "c", "s", "h"]
    return ca.Function("advance", [t, x, u, u1, u2, u3, p, c, s, h], [end], names, ["x_next"])


def rk4_from_first_rate(rates: ca.Function, project: ca.Function | None) -> ca.Function:
    """Return advance(t, x, k1, u_middle, u_end, p, c, k, g_middle, g_end, s, h) -> x+.

    rates: f(t, x, u, p, c, k, g) -> dx. u_middle, u_end: u(s + h/2), u(s + h), with what is kept of them in g. project:
    as for `rk4`.
    """
    t, s, h = ca.MX.sym("t"), ca.MX.sym("s"), ca.MX.sym("h")
    x, p, c, k = (ca.MX.sym(n, rates.size_in(n)) for n in ("x", "p", "c", "k"))
    u = [ca.MX.sym(n, rates.size_in("u")) for n in ("u_middle", "u_end")]
    g = [ca.MX.sym(n, rates.size_in("g")) for n in ("g_middle", "g_end")]
    k1 = ca.MX.sym("k1", x.shape)

    def f(after: ca.MX, state: ca.MX, stage: int) -> ca.MX:
        return rates(t + (s + after), state, u[stage - 1], p, c, k, g[stage - 1])

    end = _end(f, x, k1, h)
    if project is not None:
        end = project(end, p, c)
    names = ["t", "x", "k1", "u_middle", "u_end", "p", "c", "k", "g_middle", "g_end", "s", "h"]
    return ca.Function("advance", [t, x, k1, *u, p, c, k, *g, s, h], [end], names, ["x_next"])


def _end(f: Rates, x: ca.MX, k1: ca.MX, h: ca.MX) -> ca.MX:
    """Return (2) and (3) without its projection; f(time after the start, state, stage: 1 the middle, 2 the end)."""
    k2 = f(h / 2, x + h / 2 * k1, 1)
    k3 = f(h / 2, x + h / 2 * k2, 1)
    k4 = f(h, x + h * k3, 2)
    return x + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
