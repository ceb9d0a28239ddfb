"""The two-mass oscillator against its matrix exponential, in every exchange."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.linalg import expm

from cosim import prepare
from cosim.masters.explicit import Explicit
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


def error(prepared, master, step: float) -> float:
    """The largest error of x_1 over the whole flight, by the largest |x_1|."""
    setup = replace(both.experiment(stop=STOP, step=step), master=master)
    run = prepared.fly(setup)
    x_1 = exact(run.time)[:, 0]
    return np.abs(run["one.x_1"] - x_1).max() / np.abs(x_1).max()


def test_the_matrix_exponential_keeps_the_energy():
    x_1, v_1, x_2, v_2 = exact(np.linspace(0, STOP, 201)).T
    energy = v_1**2 / 2 + v_2**2 / 2 + 5 * x_1**2 + 500 * x_2**2 + 50 * (x_1 - x_2) ** 2
    assert_allclose(energy, 1e4, rtol=1e-11)


def orders(prepared, master, steps) -> np.ndarray:
    errors = [error(prepared, master, step) for step in steps]
    return np.log2(np.divide(errors[:-1], errors[1:]))


FAST = 33.5
"""The larger frequency, rad/s: a master of order p shows it up to some FAST * step, the ratio of the next term."""


@pytest.mark.parametrize("preset", ["declared", "jacobi"])
def test_held_inputs_are_of_order_one(prepared, preset):
    steps = (1e-3, 5e-4, 2.5e-4)
    assert_allclose(orders(prepared, Explicit(preset=preset), steps), 1.0, atol=FAST * steps[0])


SLOPES = Explicit(inputs="smooth", extrapolation=1)


def test_true_slopes_are_of_order_two(prepared):
    steps = (1e-2, 5e-3, 2.5e-3)
    assert_allclose(orders(prepared, SLOPES, steps), 2.0, atol=FAST * steps[0])
    assert error(prepared, SLOPES, 1e-2) < 3e-2


def test_a_wrong_slope_would_be_of_order_one(prepared):
    """The slope of a force that follows x_2 with x_2 held: what extrapolation is without smooth inputs."""
    steps = (1e-3, 5e-4)
    assert_allclose(orders(prepared, Explicit(extrapolation=1), steps), 1.0, atol=FAST * steps[0])
