"""The quarter car over a step of the road against scipy's DOP853 of its equations, with linear and cubic damping."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import solve_ivp

from cosim import prepare
from cosim.masters.explicit import Explicit
from cosim.masters.iterated import Iterated
from fmus.export.build import build

from ..cosim import both
from .quarter_car import LINEAR, Chassis, Wheel

LINKS = [("wheel.v_w", "chassis.v_w", "after_step"), ("chassis.F", "wheel.F")]
STOP = 1.0  # s
FAST = 64.2
"""1/s: a master of order p shows it up to some FAST * step, the ratio of the next term. The wheel swings with
sqrt((k_c + k_w) / m_w) = 64.2 rad/s, to v_s = 3.9 m/s, where the cubic damper acts with 2.3 d_c (1 / m_w + 1 / m_c),
63 1/s.
"""


def exact(t: np.ndarray, v_d: float) -> np.ndarray:
    """s, v_c, z_w, v_w at the times t, as rows: 400 and 40 kg, 15 and 150 kN/m, 1 kN s/m, road 0.1 m."""

    def rates(_, x):
        s, v_c, z_w, v_w = x
        v_s = v_c - v_w
        force = 15e3 * s + 1e3 * v_s + 1e3 * v_s**3 / v_d**2
        return [v_s, -force / 400.0, v_w, (force - 150e3 * (z_w - 0.1)) / 40.0]

    return solve_ivp(rates, (0.0, t[-1]), np.zeros(4), "DOP853", t_eval=t, rtol=1e-12, atol=1e-14).y.T


@pytest.fixture(scope="module", params=["native", "python"])
def prepared(request, tmp_path_factory):
    folder = tmp_path_factory.mktemp("quarter_car")
    fmus = {
        name: build(c, folder / f"{name}.fmu", request.param)
        for name, c in {"chassis": Chassis(), "wheel": Wheel()}.items()
    }
    with prepare(both.of(fmus, LINKS)) as ready:
        yield ready


def error(prepared, master, step: float, v_d: float) -> float:
    """The largest error of the extension s over the whole flight, by the largest |s|."""
    setup = replace(both.experiment(stop=STOP, step=step), master=master)
    run = prepared.fly(setup, parameters={"chassis.v_d": v_d})
    s = exact(run.time, v_d)[:, 0]
    return np.abs(run["chassis.s"] - s).max() / np.abs(s).max()


STEPS = (4e-3, 2e-3)
ATOL = FAST * STEPS[0]


def order(prepared, master, v_d: float) -> float:
    coarse, fine = (error(prepared, master, step, v_d) for step in STEPS)
    return np.log2(coarse / fine)


DAMPERS = pytest.mark.parametrize("v_d", [LINEAR, 6.0], ids=["linear", "cubic"])


@DAMPERS
def test_energy_falls_by_the_work_of_the_damper(v_d):
    """The reference itself: what the damper takes is what the masses and springs lose."""
    t = np.linspace(0, STOP, 2001)
    s, v_c, z_w, v_w = exact(t, v_d).T
    energy = 200 * v_c**2 + 7.5e3 * s**2 + 20 * v_w**2 + 75e3 * (z_w - 0.1) ** 2
    power = 1e3 * (v_c - v_w) ** 2 * (1 + ((v_c - v_w) / v_d) ** 2)
    work = np.sum((power[:-1] + power[1:]) / 2) * (t[1] - t[0])
    # the trapezoidal rule errs by some (FAST h)^2 / 12 of the whole, of a power that swings with twice the frequency
    assert_allclose(energy[0] - energy[-1], work, rtol=(FAST * 5e-4) ** 2)


@DAMPERS
def test_held_inputs_are_of_order_one(prepared, v_d):
    assert_allclose(order(prepared, Explicit(), v_d), 1.0, atol=ATOL)


@DAMPERS
def test_true_slopes_are_of_order_two(prepared, v_d):
    assert_allclose(order(prepared, Explicit(inputs="smooth", extrapolation=1), v_d), 2.0, atol=ATOL)


@DAMPERS
@pytest.mark.parametrize(("inputs", "expected"), [("ramp", 2.0), ("smooth", 4.0)])
def test_iterated_inputs(prepared, v_d, inputs, expected):
    """FMUs of pythonfmu, which hold the mean of the curve, are of order two."""
    if not all(d.can_interpolate_inputs for d in prepared.wiring.descriptions.values()):
        expected = 2.0
    assert_allclose(order(prepared, Iterated(inputs=inputs), v_d), expected, atol=ATOL)
