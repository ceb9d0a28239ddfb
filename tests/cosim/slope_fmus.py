"""Small FMUs in C for tests of slopes: a sine that tells them or not, a law of two inputs, integrators.

`Sine{n}`: y = sin t, which tells derivatives up to order n. `Law`: y = 2 u + w + u w, direct feedthrough, which tells
y' = (2 + w) u' + (1 + u) w'; without the mark of `refresh` it is `Closed`. `Cubic`, `Line`, `Held`: y' = u, x = u, that
take derivatives of inputs up to order 3, 1, none.
"""

from functools import partial
from pathlib import Path

from .c_fmu import build, real

SINE = "y = sin(m->now); m->slopes_out[0] = cos(m->now); m->slopes_out[SIZE] = -sin(m->now);"
TO_END = """
    double {u}1 = m->slope[{n}], {u}2 = m->second[{n}], {u}3 = m->third[{n}];
    {u} += h * ({u}1 + h / 2 * ({u}2 + h / 3 * {u}3));
    m->slope[{n}] += h * ({u}2 + h / 2 * {u}3);
    m->second[{n}] += h * {u}3;
"""
LAW = "y = 2 * u + w + u * w; m->slopes_out[2] = (2 + w) * m->slope[0] + (1 + u) * m->slope[1];"
INTEGRATOR = """
    y += h * (u + h / 2 * (m->slope[0] + h / 3 * (m->second[0] + h / 4 * m->third[0])));
"""


def made(folder: Path) -> dict[str, Path]:
    """All of them by their names."""
    sines = {
        f"Sine{n}": build(folder, f"Sine{n}", [real("y")], outputs=SINE, maxOutputDerivativeOrder=n) for n in (0, 1, 2)
    }
    law = partial(
        build,
        folder,
        variables=[real("u", "input"), real("w", "input"), real("y", depends="u w")],
        outputs=LAW,
        step=TO_END.format(u="u", n=0) + TO_END.format(u="w", n=1),
        maxOutputDerivativeOrder=1,
        input_derivatives=3,
    )
    integrator = partial(
        build,
        folder,
        variables=[real("u", "input"), real("y"), real("x", depends="u")],
        outputs="x = u; m->slopes_out[1] = u; m->slopes_out[2] = m->slope[0];",
        step=INTEGRATOR + TO_END.format(u="u", n=0),
        maxOutputDerivativeOrder=1,
    )
    return {
        **sines,
        "Law": law(name="Law"),
        "Closed": law(name="Closed", refresh=False),
        "Cubic": integrator(name="Cubic", input_derivatives=3),
        "Line": integrator(name="Line"),
        "Held": integrator(name="Held", canInterpolateInputs=False, maxOutputDerivativeOrder=0),
    }
