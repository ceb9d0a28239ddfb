"""The vectors of the Python loop, and what it does with many numbers or few: the same bits, in NumPy or without."""

import math
from types import SimpleNamespace

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from cosim.masters.point import Point
from cosim.masters.slots import FEW, NEWEST, POINT, SOME, Slots, conversion, finiteness, place
from cosim.masters.types import Texts
from cosim.time import Schedule

from ..fakes import Clock, Fake, Integrator, describe
from ..flights import run

COUNTS = [1, FEW, FEW + 1, 40]


def slots_of(size: int) -> Slots:
    none = np.zeros(0, dtype=np.int64)
    inputs = SimpleNamespace(links=(), slots=none, source=none, factor=np.zeros(0), addend=np.zeros(0))
    return Slots(SimpleNamespace(size=size, inputs=inputs, columns=SimpleNamespace(slots=np.arange(size))))


@pytest.mark.parametrize("count", COUNTS)
@pytest.mark.parametrize("plain", [True, False])
def test_inputs_are_factor_by_value_plus_addend_to_the_last_bit(count, plain):
    random = np.random.default_rng(1)
    slots = slots_of(50)
    slots.point[:], slots.newest[:] = random.normal(size=(2, 50))
    slots.newest[3] = -0.0
    sources = random.integers(0, 50, count)
    sources[0] = 3
    factor, addend = (np.ones(count), np.zeros(count)) if plain else random.normal(size=(2, count))
    given = np.full(count, np.nan)
    conversion(SimpleNamespace(factor=factor, addend=addend), slots, slots.places(NEWEST, sources), given)()
    expected = [float(f) * float(slots.newest[s]) + float(d) for f, s, d in zip(factor, sources, addend, strict=True)]
    assert given.tobytes() == np.array(expected).tobytes()
    if plain:
        assert math.copysign(1.0, given[0]) == 1.0  # 1 * -0.0 + 0.0 is 0.0


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("count", [1, 2, 40, SOME, SOME + 1])
@pytest.mark.parametrize("gap", [0, 1])
def test_a_number_that_is_not_finite_is_never_missed(count, gap):
    slots = np.arange(5, 5 + count) + gap * (np.arange(count) > 0)
    vector = np.zeros(SOME + 10)
    vector[slots] = np.linspace(-1e200, 1e300, count)
    are_finite = finiteness(vector, slots)
    assert are_finite()
    for slot in slots:
        for bad in (math.nan, math.inf, -math.inf):
            kept, vector[slot] = vector[slot], bad
            assert not are_finite()
            vector[slot] = kept
    vector[slots[0]], vector[4] = 1.0, math.nan  # of another variable
    assert are_finite()


def test_infinities_that_cancel_are_not_finite():
    assert not finiteness(np.array([math.inf, 1.0, -math.inf]), np.arange(3))()


def test_no_number_at_all_is_finite():
    assert finiteness(np.array([math.nan]), np.zeros(0, dtype=np.int64))()


class Enormous(Fake):
    """Its numbers are finite, their sum is not."""

    def __init__(self, name: str):
        super().__init__(name, describe(outputs=["y", "z"]), y=1.5e308, z=1.5e308)


def test_a_sum_that_overflows_ends_no_run():
    assert not finiteness(np.full(2, 1.5e308), np.arange(2))()
    result = run([Enormous("c"), Integrator("b")], [("c.y", "b.u")])
    assert result.info["status"] == "finished"
    assert_array_equal(result["c.z"], 1.5e308)


def test_slots_that_follow_each_other_are_a_slice():
    assert place(np.array([3, 4, 5])) == slice(3, 6)
    assert_array_equal(place(np.array([3, 5, 4])), [3, 5, 4])


def test_a_point_comes_back_as_it_was_put_and_shares_nothing():
    slots = slots_of(4)
    point = Point(7, np.arange(4.0), np.arange(4.0) + 10, np.zeros((2, 0)), Texts((b"a",)), np.array([1.5]))
    slots.put(point)
    back = slots.reached()
    assert (back.index, back.texts.all(), back.memory.tolist()) == (7, (b"", b"a"), [1.5])
    assert_array_equal(back.newest, point.newest)
    slots.coming[:] = -1.0
    slots.arrive(8, 0.8)
    assert (slots.index, back.index, back.values.tolist()) == (8, 7, [0.0, 1.0, 2.0, 3.0])
    assert slots.row().tolist() == [0.8, -1.0, -1.0, -1.0, -1.0]
    assert slots.all[slots.places(POINT, np.array([2]))] == -1.0


class Breaks(Integrator):
    """Is interrupted within its step from 0.5 s on, as by a second Ctrl-C."""

    def do_step(self, t, h):
        super().do_step(t, h)
        if t >= 0.45:
            raise KeyboardInterrupt


def test_an_interrupt_within_a_step_keeps_the_rows_up_to_it():
    result = run([Clock("c"), Breaks("b")], [("c.y", "b.u")])
    assert result.info["status"] == "interrupted"
    assert_array_equal(result.time, [Schedule.of(0, 1, 0.1, 1).time(k) for k in range(6)])
    assert_array_equal(result["c.y"], result.time)
