"""Native FMUs: samples, against the rule in plain Python."""

import math

import pytest
from numpy.testing import assert_allclose


class Rule:
    """What Sum has to do, in other words: a list of ticks, counted in units of time that are whole numbers."""

    def __init__(self, period: int, unit: float):
        self.period, self.unit, self.tick = period, unit, 0
        self.total, self.last, self.shown = 0.5, 0.25 * 2.0, math.nan

    def sample(self, time: int, u: float) -> tuple[float, float, float]:
        total = self.total + 4 * u + 0.1 * self.last
        return total, u, total * (1 + math.sin(time * self.unit)) + 10 * u

    def commit(self, time: int, u: float) -> None:
        assert time == self.tick * self.period
        self.total, self.last, self.shown = self.sample(time, u)
        self.tick += 1

    def output(self, time: int, u: float) -> float:
        """What is to be read at a communication point: the sample that is due, or what is held."""
        return self.sample(time, u)[2] if time == self.tick * self.period else self.shown


@pytest.mark.parametrize("commit_shown", [0, 1])
@pytest.mark.parametrize("ramp", [0.0, 0.7])
@pytest.mark.parametrize("step", [10, 30, 5, 4, 7, 13, 2], ids=lambda n: f"{n / 10:g}T")
def test_samples(open_slave, step, ramp, commit_shown):
    """Steps of multiples, fractions and any other ratio of the sample time, inputs held or moving."""
    unit = 0.01
    rule = Rule(period=10, unit=unit)
    slave = open_slave("Sum").begin()
    slave.set({"solver.commit_shown": commit_shown})
    slave.exitInitializationMode()
    now, u = 0, 0.25
    for k in range(40):
        shown_with = u
        if k % 2:  # what is committed does not hang on anybody reading it
            assert_allclose(slave.get("shown", "total"), [rule.output(now, u), rule.total], rtol=1e-12)
        u = math.sin(k)
        slave.set({"u": u})
        if k % 3 == 0:  # outputs follow a set where a sample is due, and only there
            shown_with = u
            assert_allclose(slave.get("shown"), [rule.output(now, u)], rtol=1e-12)
        if ramp:
            slave.setRealInputDerivatives(slave.vr("u"), [1], [ramp])
        slave.doStep(now * unit, step * unit)
        for time in range(now, now + step):
            if time == rule.tick * rule.period:
                at_point = shown_with if commit_shown else u
                rule.commit(time, at_point if time == now else u + ramp * (time - now) * unit)
        now, u = now + step, u + ramp * step * unit


def test_a_sample_just_before_or_after_its_tick(open_slave):
    """Communication points that miss the tick by less than 1 ns."""
    for miss in (-4e-10, 4e-10):
        slave = open_slave("Sum").start()
        slave.set({"u": 0.0})
        slave.doStep(0.0, 0.1 + miss)
        slave.set({"u": 3.0})
        slave.doStep(0.1 + miss, 0.05)
        assert slave.get("last") == [3.0]


def test_sample_zero_is_due_at_any_start_time(open_slave):
    slave = open_slave("Clock").start(start=100.05)
    assert slave.get("y") == [100.05]
    slave.doStep(100.05, 0.3)
    assert_allclose(slave.get("y"), [100.3], rtol=1e-15)
