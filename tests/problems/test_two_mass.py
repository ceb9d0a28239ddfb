"""The two-mass oscillator against its matrix exponential, in every exchange."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.linalg import expm

from cosim import prepare
from cosim.masters.explicit import Explicit
from cosim.masters.iterated import Iterated
from fmus.export.build import build

from ..cosim import both
from .two_mass import Mass, MassAndSpring

LINKS = [("two.x_2", "one.x_2", "after_step"), ("one.f", "two.f")]
STOP = 2.0  # s
# x_1, v_1, x_2, v_2: unit masses, springs 10, 100, 1000 N/m
A = np.array([[0, 1, 0, 0], [-110, 0, 100, 0], [0, 0, 0, 1], [100, 0, -1100, 0]], float)
START = np.array([0.0, 100.0, 0.0, -100.0])


def exact(t: np.ndarray) -> np.ndarray:
    """The states at equally spaced times, as rows."""
    step, rows = expm(A * (t[1] - t[0])), [START]
    for _ in t[1:]:
        rows.append(step @ rows[-1])
    return np.array(rows)


@pytest.fixture(scope="module", params=["native", "python"])
def prepared(request, tmp_path_factory):
    folder = tmp_path_factory.mktemp("two_mass")
    components = {"one": MassAndSpring(), "two": Mass()}
    fmus = {name: build(c, folder / f"{name}.fmu", request.param) for name, c in components.items()}
    with prepare(both.of(fmus, LINKS)) as ready:
        yield ready


def error(prepared, master, step: float, inside: float = 1e-3) -> float:
    """The largest error of x_1 over the whole flight, by the largest |x_1|; `inside`: the FMUs' own step, s."""
    setup = replace(both.experiment(stop=STOP, step=step), master=master)
    run = prepared.fly(setup, parameters={"one.solver.step": inside, "two.solver.step": inside})
    x_1 = exact(run.time)[:, 0]
    return np.abs(run["one.x_1"] - x_1).max() / np.abs(x_1).max()


STEPS = (1e-2, 5e-3)


def order(prepared, master, steps=STEPS, inside: float = 1e-3) -> float:
    coarse, fine = (error(prepared, master, step, inside) for step in steps)
    return np.log2(coarse / fine)


FAST = 33.5
"""The larger frequency, rad/s: a master of order p shows it up to some FAST * step, the ratio of the next term."""


ATOL = FAST * STEPS[0]


@pytest.mark.parametrize("preset", ["declared", "jacobi"])
def test_held_inputs_are_of_order_one(prepared, preset):
    assert_allclose(order(prepared, Explicit(preset=preset)), 1.0, atol=ATOL)


SLOPES = Explicit(inputs="smooth", extrapolation=1)


def test_true_slopes_are_of_order_two(prepared):
    assert_allclose(order(prepared, SLOPES), 2.0, atol=ATOL)
    assert error(prepared, SLOPES, 1e-2) < 3e-2


def test_a_wrong_slope_would_be_of_order_one(prepared):
    """The slope of a force that follows x_2 with x_2 held: what extrapolation is without smooth inputs."""
    assert_allclose(order(prepared, Explicit(extrapolation=1)), 1.0, atol=ATOL)


def interpolates(prepared) -> bool:
    """Whether the FMUs take curves; those of pythonfmu hold the mean of the curve, which is of order two."""
    return all(d.can_interpolate_inputs for d in prepared.wiring.descriptions.values())


def test_an_iterated_line_is_of_order_two(prepared):
    ramp = Iterated(inputs="ramp")
    assert_allclose(order(prepared, ramp), 2.0, atol=ATOL)
    if interpolates(prepared):
        assert error(prepared, ramp, 1e-2) < 3e-3


def test_an_iterated_cubic_is_of_order_four(prepared):
    cubic = Iterated(inputs="smooth")
    if interpolates(prepared):
        # An own step of 0.25 ms errs by some (FAST 0.25 ms)^4 / 120 a radian, 67 of them: 3e-9, 1 % of the finer one.
        assert_allclose(order(prepared, cubic, inside=2.5e-4), 4.0, atol=ATOL)
        assert error(prepared, cubic, 1e-2) < 4e-6
    else:
        assert_allclose(order(prepared, cubic), 2.0, atol=ATOL)
