"""The linear algebra and Newton's method of a loop, on maps whose solutions and Jacobians are known."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from cosim.masters.implicit import newton
from cosim.masters.implicit.linear import broyden, solve
from cosim.masters.implicit.plan import Loop, Memory

EPS = np.finfo(float).eps


class TestLinear:
    @pytest.mark.parametrize("n", [1, 2, 5, 12])
    def test_solutions(self, n):
        """Partial pivoting errs by no more than some n eps times the condition number."""
        rng = np.random.default_rng(n)
        for _ in range(20):
            matrix, right = rng.normal(size=(n, n)), rng.normal(size=n)
            expected = np.linalg.solve(matrix, right)
            found = solve(matrix.copy(), right.copy())
            bound = 10 * n * EPS * np.linalg.cond(matrix) * np.abs(expected).max()
            assert_allclose(found, expected, rtol=0, atol=bound)

    def test_a_pivot_is_looked_for(self):
        assert_allclose(solve(np.array([[0.0, 2.0], [3.0, 1.0]]), np.array([4.0, 5.0])), [1.0, 2.0], rtol=2 * EPS)

    def test_nothing_given_is_changed(self):
        matrix, right = np.array([[0.0, 2.0], [3.0, 1.0]]), np.array([4.0, 5.0])
        solve(matrix, right)
        assert matrix.tolist() == [[0, 2], [3, 1]] and right.tolist() == [4, 5]

    @pytest.mark.parametrize("matrix", [[[0.0]], [[1.0, 2.0], [2.0, 4.0]], [[np.nan, 1.0], [1.0, 0.0]]])
    def test_singular(self, matrix):
        assert solve(np.array(matrix), np.ones(len(matrix))) is None

    def test_broyden(self):
        """Along the step the new matrix is the secant; across it nothing changes."""
        rng = np.random.default_rng(1)
        a, jacobian, x = rng.normal(size=(3, 3)), rng.normal(size=(3, 3)), rng.normal(size=3)
        step = np.linalg.solve(jacobian, -a @ x)
        updated = broyden(jacobian, a @ (x + step), step)
        assert_allclose(updated @ step, a @ step, rtol=1e-12)
        across = np.cross(step, [1.0, 0.0, 0.0])
        assert_allclose(updated @ across, jacobian @ across, rtol=1e-12, atol=1e-14)

    def test_a_step_of_no_length_changes_nothing(self):
        jacobian = np.eye(2)
        assert broyden(jacobian, np.ones(2), np.zeros(2)).tolist() == [[1, 0], [0, 1]]


def loop(n, slopes=0):
    """A loop of n values with nominal value 1, of which the first have slopes."""
    size = n + slopes
    return Loop(
        turns=(0,),
        slots=np.arange(size),
        value=np.array([*range(n), *range(slopes)]),
        slope=np.array([False] * n + [True] * slopes),
        nominal=np.ones(size),
        partner=np.array([n + i if i < slopes else -1 for i in range(n)]),
        memory=slice(0, Memory.length(size)),
        names=tuple(f"a.y{i}" for i in range(size)),
        members=(),
    )


class Map:
    """F of a loop, with its evaluations counted; `jacobian(x)` of F(x) - x."""

    def __init__(self, f, jacobian=None):
        self.f, self.jacobian, self.calls, self.renewed = f, jacobian, 0, 0

    def __call__(self, x):
        self.calls += 1
        return np.atleast_1d(self.f(x)).astype(float)

    def renew(self, x, result):
        self.renewed += 1
        assert_allclose(result, self.f(x))
        return np.atleast_2d(self.jacobian(x))


def find(f, start, tolerance=1e-10, memory=None, h=0.1):
    start = np.atleast_1d(np.array(start, float))
    n = len(start)
    memory = memory or Memory(np.zeros(Memory.length(n)), n)
    seen = []

    def evaluate(x):
        seen.append(x.copy())
        return f(x)

    renewals = [f.renew] if f.jacobian else []
    return newton.find(loop(n), memory, start, h, tolerance, evaluate, renewals), seen, memory


class TestFind:
    def test_a_linear_map_takes_one_correction(self):
        """Evaluated where it is guessed and where Newton leads, which is the solution."""
        a, b = np.array([[0.2, 0.5], [-0.4, 0.1]]), np.array([1.0, 2.0])
        f = Map(lambda x: a @ x + b, lambda x: a - np.eye(2))
        found, seen, memory = find(f, [0.0, 0.0])
        assert found.known and (f.calls, f.renewed) == (2, 1)
        assert_allclose(seen[-1], np.linalg.solve(np.eye(2) - a, b), rtol=1e-14)
        assert memory.known and memory.step == 0.1 and memory.before.tolist() == [0, 0]

    def test_what_was_learned_serves_the_next_step(self):
        a, b = np.array([[0.2, 0.5], [-0.4, 0.1]]), np.array([1.0, 2.0])
        f = Map(lambda x: a @ x + b, lambda x: a - np.eye(2))
        _, seen, memory = find(f, [0.0, 0.0])
        found, _, _ = find(f, seen[-1], memory=memory)  # guessed on the line through both: off again
        assert found.known and (f.calls, f.renewed) == (4, 1)

    @pytest.mark.parametrize("factor", [0.5, -0.9, -5.0, 20.0])
    def test_a_map_that_iteration_alone_would_not_solve(self, factor):
        """x = factor (x - x^3 / 6): the sine's first terms, contracting or not."""
        f = Map(lambda x: factor * (x - x**3 / 6) + 0.1, lambda x: factor * (1 - x**2 / 2) - 1)
        found, seen, _ = find(f, 0.05)
        assert found.known and f.calls <= 6
        (x,) = seen[-1]
        assert abs(factor * (x - x**3 / 6) + 0.1 - x) < 1e-9 * abs(factor)

    def test_a_nonlinear_pair(self):
        """x = cos y / 2, y = sin x / 2, by Newton's method of scipy."""
        from scipy.optimize import fsolve

        f = Map(
            lambda x: np.array([np.cos(x[1]) / 2, np.sin(x[0]) / 2]),
            lambda x: np.array([[-1, -np.sin(x[1]) / 2], [np.cos(x[0]) / 2, -1]]),
        )
        found, seen, _ = find(f, [0.0, 0.0], tolerance=1e-12)
        expected = fsolve(lambda x: [np.cos(x[1]) / 2 - x[0], np.sin(x[0]) / 2 - x[1]], [0, 0], xtol=1e-14)
        assert found.known and f.renewed == 1
        assert_allclose(seen[-1], expected, atol=1e-10)  # the last change is below 1e-12: what is left is a part of it

    def test_without_a_jacobian_it_gives_up(self):
        f = Map(lambda x: 0.5 * x + 1)
        found, seen, memory = find(f, 0.0)
        assert not found.known and len(seen) == 1 and not memory.known

    def test_a_singular_jacobian(self):
        f = Map(lambda x: x + 1, lambda x: np.zeros((1, 1)))
        found, seen, memory = find(f, 0.0)
        assert not found.known and len(seen) == 1 and not memory.known

    def test_a_value_that_is_not_a_number(self):
        f = Map(lambda x: np.array([x[0], np.nan]), lambda x: -np.eye(2))
        found, seen, memory = find(f, [0.0, 0.0])
        assert not found.known and found.worst == 1 and found.size == np.inf and len(seen) == 1
        assert not memory.known

    def test_no_solution(self):
        """x = x^2 + 1 has none: Newton's method goes to and fro, and the change that is left is told."""
        f = Map(lambda x: x**2 + 1, lambda x: 2 * x - 1)
        found, seen, memory = find(f, 0.3)
        assert not found.known and found.size > 1e-10 and len(seen) <= newton.MOST
        assert not memory.known


class TestPredict:
    """Guesses continue what is on a line, and with slopes what is on a cubic."""

    def test_a_line(self):
        memory = Memory(np.zeros(Memory.length(1)), 1)
        memory.learn(0.2, np.array([1.0]), np.eye(1))
        assert_allclose(newton.predict(loop(1), memory, np.array([2.0]), 0.1), [2.5], rtol=2 * EPS)

    def test_a_cubic(self):
        def at(t):
            return np.array([1 + t - 2 * t**2 + 3 * t**3, 1 - 4 * t + 9 * t**2])

        memory = Memory(np.zeros(Memory.length(2)), 2)
        memory.learn(0.2, at(0.0), np.eye(2))
        assert_allclose(newton.predict(loop(1, 1), memory, at(0.2), 0.3), at(0.5), rtol=1e-13)

    def test_the_first_step_follows_the_slope(self):
        memory = Memory(np.zeros(Memory.length(2)), 2)
        assert newton.predict(loop(1, 1), memory, np.array([1.0, 4.0]), 0.5).tolist() == [3.0, 4.0]
        assert newton.predict(loop(1, 1), memory, np.array([1.0, np.nan]), 0.5).tolist() == [1.0, 0.0]


def test_the_size_of_a_change():
    """Of a value by its nominal and its size; of a slope by what it makes in the step."""
    size, worst = newton.size(loop(1, 1), np.array([0.1, 4.0]), np.array([3.0, 7.0]), 0.5)
    assert (size, worst) == (0.5 * 4.0 / 4.0, 1)
    assert newton.size(loop(1, 1), np.array([np.nan, 4.0]), np.array([3.0, 7.0]), 0.5)[1] == 0
