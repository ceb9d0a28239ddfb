"""The exact Jacobi recursion: what a master must return to the last digits, from the closed form of both units.

Over a step H with the torque u held the axis goes from z = (theta, w) to
    z+ = Phi z + Gamma u,   [Phi Gamma; 0 1] = (I + h M + ... + (h M)^4 / 24)^n,   h = H / n,   M = [A B; 0 0]       (1)
for n steps of RK4; the law gives u = K_p (theta_r - theta) - K_d w.
    ours: evaluated again at each communication point,  z_k+1 = Phi z_k + Gamma u(z_k)                               (2)
    any other: its output is the one that it made in its step,  z_k+1 = Phi z_k + Gamma u_k,  u_k+1 = u(z_k)         (3)
"""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from fmus.export.build import build

from ..cosim import both, c_fmu
from ..cosim.c_fmu import real
from .pointing import Axis, Law

H, STOP = 0.01, 5.0  # s
LINKS = [("axis.theta", "law.theta"), ("axis.w", "law.w"), ("law.u", "axis.u")]
M = np.array([[0.0, 1.0, 0.0], [-1.0 / 100, -0.5 / 100, 1.0 / 100], [0.0, 0.0, 0.0]])
K = np.array([-4.0, -28.0])  # u = 0.8 + K z
ROUNDING = 1e-12
"""Relative: 500 steps of some 40 operations, eps / 2 each, are 2e-12 at worst and 5e-14 at random."""


def over_a_step(n: int) -> tuple[np.ndarray, np.ndarray]:
    """Phi and Gamma (1)."""
    hM = H / n * M
    once = np.eye(3) + hM @ (np.eye(3) + hM / 2 @ (np.eye(3) + hM / 3 @ (np.eye(3) + hM / 4)))
    whole = np.linalg.matrix_power(once, n)
    return whole[:2, :2], whole[:2, 2]


def test_ours_is_the_recursion_of_fresh_outputs(fmus):
    run = both.fly(both.of(fmus, LINKS), stop=STOP, step=H, preset="jacobi")
    phi, gamma = over_a_step(10)  # solver.step is 1 ms
    z = np.array([0.1, 0.0])
    for _ in range(500):
        z = phi @ z + gamma * (0.8 + K @ z)  # (2)
    assert_allclose([run["axis.theta"][-1], run["axis.w"][-1]], z, rtol=ROUNDING)
    assert run["law.u"][0] == pytest.approx(0.4, rel=1e-15)  # 4 (0.2 - 0.1): the law sees the start of the axis


@pytest.fixture(params=["native", "python"])
def fmus(request, tmp_path):
    return {name: build(c, tmp_path / f"{name}.fmu", request.param) for name, c in (("axis", Axis()), ("law", Law()))}


RK4 = """
    double a = u / 100, t1 = w, w1 = a - 0.005 * w - 0.01 * theta;
    double t2 = w + h / 2 * w1, w2 = a - 0.005 * t2 - 0.01 * (theta + h / 2 * t1);
    double t3 = w + h / 2 * w2, w3 = a - 0.005 * t3 - 0.01 * (theta + h / 2 * t2);
    double t4 = w + h * w3, w4 = a - 0.005 * t4 - 0.01 * (theta + h * t3);
    theta += h / 6 * (t1 + 2 * t2 + 2 * t3 + t4);
    w += h / 6 * (w1 + 2 * w2 + 2 * w3 + w4);
"""


def test_others_units_are_the_recursion_of_their_own_outputs(tmp_path):
    """One step of RK4 a communication step; the law says no dependency, and its first torque is its start value, 0."""
    axis = [real("u", "input"), real("theta"), real("w")]
    law = [real("theta", "input"), real("w", "input"), real("u")]
    fmus = {
        "axis": c_fmu.build(tmp_path, "Axis", axis, initialized="theta = 0.1;", step=RK4, refresh=False),
        "law": c_fmu.build(tmp_path, "Law", law, step="u = 4 * (0.2 - theta) - 28 * w;", refresh=False),
    }
    run = both.fly(both.of(fmus, LINKS), stop=STOP, step=H, preset="jacobi")
    phi, gamma = over_a_step(1)
    z, u = np.array([0.1, 0.0]), 0.0
    for _ in range(500):
        z, u = phi @ z + gamma * u, 0.8 + K @ z  # (3)
    assert_allclose([run["axis.theta"][-1], run["axis.w"][-1], run["law.u"][-1]], [*z, u], rtol=ROUNDING)
