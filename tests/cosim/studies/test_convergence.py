"""Order and error from rows whose error is known: y = exact + c h^p."""

import numpy as np
import pyarrow as pa
import pytest
from numpy.testing import assert_allclose

from cosim.results.result import Result
from cosim.studies.verification.convergence import angle, converge

T = np.linspace(0.0, 1.0, 11)


def rows(columns, time=T) -> Result:
    return Result(pa.table({"time": time, **columns}), {"units": {}})


def runs(order, size=1e-3, count=3):
    """Flights of y = cos t + c sin(t) h^p at h = 1, 1/2, 1/4: the error at h is c sin 1."""
    return [rows({"a.y": np.cos(T) + size * np.sin(T) * 2.0 ** (-order * n)}) for n in range(count)]


@pytest.mark.parametrize("order", [1, 2, 4, 1.5])
def test_order_and_error(order):
    (found,) = converge(runs(order), ["a.y"], 100)
    # c 2^-2p is a few 1e-6 at least, of values known to 1e-16
    assert_allclose([found.order, found.error], [order, 1e-3 * np.sin(1.0)], rtol=1e-9)
    assert_allclose(found.coarse, 1e-3 * np.sin(1.0) * (1 - 2.0**-order), rtol=1e-9)
    assert found.remark == ""


def test_only_rows_that_all_have_are_compared():
    coarse, middle, fine = runs(1)
    more = np.concatenate([T, [0.55, 0.65]])
    wild = np.concatenate([middle["a.y"], [1e9, 1e9]])
    at = np.argsort(more)
    (found,) = converge([coarse, rows({"a.y": wild[at]}, more[at]), fine], ["a.y"], 100)
    assert_allclose(found.order, 1.0, rtol=1e-9)


def test_the_element_with_the_largest_difference_is_named():
    def columns(n):
        return {"a.y[1]": T * 0, "a.y[2]": T * 2.0**-n, "a.y[3]": 0.5 * T * 2.0**-n}

    (found,) = converge([rows(columns(n)) for n in range(3)], ["a.y"], 100)
    assert (found.where, found.order) == ("a.y[2]", pytest.approx(1.0))


class TestAttitudes:
    """Turns about one axis by phi, as scalar-first quaternions."""

    @staticmethod
    def turned(phi, sign=1.0):
        q = sign * np.stack([np.cos(phi / 2), 0 * phi, 0.6 * np.sin(phi / 2), 0.8 * np.sin(phi / 2)], axis=1)
        return {f"plant.q_BN[{i + 1}]": q[:, i] for i in range(4)}

    def test_the_angle_between_two_is_found_whatever_their_signs(self):
        one, other = (rows(self.turned(phi, s))["plant.q_BN"] for phi, s in ((T, 1.0), (T + 1e-9, -1.0)))
        # 1e-9 from vectors known to 1e-16
        assert_allclose(angle(one, other), 1e-9, rtol=1e-6)

    def test_they_are_compared_as_angles_in_degrees(self):
        flights = [rows(self.turned(T * (1 + 1e-3 * 4.0**-n), (-1.0) ** n)) for n in range(3)]
        (found,) = converge(flights, ["plant.q_BN"], 100)
        assert found.unit == "deg" and found.where == ""
        assert_allclose([found.order, found.error], [2.0, np.degrees(1e-3)], rtol=1e-9)

    def test_four_numbers_of_another_name_are_no_attitude(self):
        columns = [{f"a.eta[{i}]": T * 2.0**-n for i in range(1, 5)} for n in range(3)]
        (found,) = converge([rows(c) for c in columns], ["a.eta"], 100)
        assert found.unit == "" and found.coarse == 0.5


class TestNoOrder:
    def remark(self, flights, steps=100, tolerance=0.0) -> str:
        (found,) = converge(flights, ["a.y"], steps, tolerance)
        assert found.order is None and found.error is None
        return found.remark

    def test_at_rounding(self):
        assert self.remark(runs(1, size=1e-15)) == "at rounding"

    def test_at_the_tolerance_of_the_iteration(self):
        assert self.remark(runs(0.2, size=1e-8), tolerance=1e-8) == "at the tolerance of the iteration"
        assert self.remark(runs(0.2, size=1e-8), tolerance=1e-10) == "the differences hardly shrink with the step"
        (found,) = converge(runs(1, size=1e-8), ["a.y"], 100, tolerance=1e-8)
        assert_allclose(found.order, 1.0, atol=1e-6)
        assert found.remark == "below the tolerance of the iteration"

    def test_the_same(self):
        assert self.remark(runs(1, size=0.0)) == "the same to the last bit"

    def test_no_convergence(self):
        assert self.remark(runs(0.2)) == "the differences hardly shrink with the step"
        assert self.remark(runs(-1)) == "the differences hardly shrink with the step"

    def test_a_coarse_difference_of_zero(self):
        one, _, other = runs(1)
        assert self.remark([one, one, other]) == "the differences hardly shrink with the step"

    def test_two_flights(self):
        assert self.remark(runs(1, count=2)) == "two flights tell a difference, no order"

    def test_not_finite(self):
        assert self.remark([*runs(1, count=2), rows({"a.y": T * np.nan})]) == "not finite"
