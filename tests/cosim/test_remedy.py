"""A flight that diverges says which exchange did, and which step passes: on a loop whose limit is known, 20 ms."""

import json
import math
import re
from dataclasses import replace
from fractions import Fraction

import pytest

from components.framework import Component, State
from cosim import prepare, remedy
from cosim.errors import StepFailed
from cosim.masters.error_controlled import ErrorControlled
from cosim.masters.explicit import Explicit
from cosim.studies import papers
from cosim.system import System
from fmus.export.build import build

from . import both, relay
from .fakes import Gain, Integrator
from .flights import run


@pytest.fixture(autouse=True)
def patience(monkeypatch):
    """The machine may be busy."""
    monkeypatch.setattr(remedy, "WALL_TIME", 300.0)


LOOP = pytest.mark.parametrize("loop", ["auto", "never"])


class Runaway(Component):
    """x' = x^2 is infinite at 1 s, whatever the step."""

    x = State(unit="1/s", start=1.0, output=True, doc="what grows")

    def derivatives(self, t, x, u, p):
        return {"x": x.x**2}


@pytest.fixture(scope="module")
def prepared(tmp_path_factory):
    folder = tmp_path_factory.mktemp("relay")
    components = {"store": relay.Store(), "gain": relay.Gain()}
    fmus = {n: build(c, folder / f"{n}.fmu", "native") for n, c in components.items()}
    with prepare(both.of(fmus, relay.LINKS)) as ready:
        yield ready


def failure(prepared, step, stop, loop="auto", **more) -> StepFailed:
    with pytest.raises(StepFailed) as caught:
        prepared.fly(both.experiment(stop=stop, step=step, loop=loop), **more)
    return caught.value


def assert_infinite(t: float, h: float) -> None:
    """x_k+1 = (1 - k h) x_k is infinite after 709.8 / log|1 - k h| steps; 600 x, in the sums of RK4, 6.4 earlier."""
    growth = math.log(abs(1 - 100 * h))
    assert (709.8 - 6.4) / growth * h - h <= t <= 709.8 / growth * h


class TestARelay:
    @LOOP
    def test_half_the_step_passes(self, prepared, loop, tmp_path):
        """At 32 ms a factor of -2.2, infinite after some 28.6 s. At 16 ms -0.6."""
        error = failure(prepared, 0.032, 40.0, loop, out=tmp_path / "r")
        assert_infinite(error.time, 0.032)
        assert "Explicit() diverged at steps of 32 ms; at 16 ms the same flight passes t = 31.4" in error.remedy
        assert error.remedy.endswith(
            " s: --step 16ms (communication_step_size=0.016), or --master iterated (master=Iterated())."
        )
        assert str(error).endswith(f"\n    {error.remedy}")
        told = json.loads((tmp_path / "r" / "run.json").read_text())
        assert told["failure"]["remedy"] == error.remedy and error.remedy in told["why"]
        assert error.result.info["failure"]["remedy"] == error.remedy

    def test_a_step_that_diverges_more_slowly_does_not_pass(self, prepared):
        """At 60 ms -5, infinite after some 26.3 s. At 30 ms -2: 2^964 = 1e290 at 28.9 s, finite yet. At 15 ms -0.5."""
        error = failure(prepared, 0.06, 40.0)
        assert_infinite(error.time, 0.06)
        assert "diverged at steps of 60 ms; at 15 ms the same flight passes t = 28.9" in error.remedy

    def test_none_of_them_passes(self, prepared):
        """At 400 ms a factor of -39, at 25 ms still -1.5."""
        told = re.fullmatch(
            r"at steps of 200 ms, 100 ms, 50 ms and 25 ms the same flight fails too, at (.+), (.+), (.+) and (.+) s: "
            r"Explicit\(\) may need a shorter step still; --master iterated \(master=Iterated\(\)\) passes at 400 ms\.",
            failure(prepared, 0.4, 100.0).remedy,
        )
        for t, h in zip(told.groups(), (0.2, 0.1, 0.05, 0.025), strict=True):
            assert_infinite(float(t), h)

    def test_the_trials_end_with_the_flight(self, prepared):
        assert "passes t = 29 s" in failure(prepared, 0.032, 29.0).remedy

    def test_they_may_be_left_out(self, prepared):
        error = failure(prepared, 0.032, 40.0, advise=False)
        assert error.remedy == "" and "a shorter step may help" in str(error)

    def test_their_time_is_bounded(self, prepared, monkeypatch):
        monkeypatch.setattr(remedy, "WALL_TIME", 0.0)
        assert failure(prepared, 0.032, 40.0).remedy == ""

    def test_parameters_of_the_flight_are_those_of_the_trials(self, prepared):
        """k = 400: -11.8 at 32 ms, -5.4 at 16 ms, -2.2 at 8 ms, -0.6 at 4 ms."""
        error = failure(prepared, 0.032, 40.0, parameters={"gain.k": 400.0})
        assert "at 4 ms the same flight passes" in error.remedy

    def test_another_flight_follows(self, prepared):
        failure(prepared, 0.032, 40.0)
        assert prepared.fly(both.experiment(stop=1.0, step=0.01)).info["status"] == "finished"


@LOOP
def test_the_exchange_is_not_the_reason(tmp_path, loop):
    path = build(Runaway(), tmp_path / "runaway.fmu", "native")
    with prepare(System(name="r", components={"a": str(path)}, parameters={"a.solver.step": 1e-3})) as prepared:
        assert failure(prepared, 0.1, 2.0, loop).remedy == (
            "at steps of 50 ms, 25 ms, 12.5 ms and 6.25 ms the same flight fails too, at 1, 1, 1 and 1 s: "
            "the exchange is not the reason."
        )


def test_given_instances_fly_no_trial():
    with pytest.raises(StepFailed) as caught:
        run([Integrator("i", x0=1.0), Gain("g", k=-1e3)], [("i.y", "g.u", "after_step"), ("g.y", "i.u")], stop=40.0)
    assert caught.value.remedy == "" and "a shorter step may help" in str(caught.value)


class TestWhatATrialTells:
    FAILED = StepFailed("a", "fmi2OK", 3.0, 0.1, variable="x", value=float("inf"))

    def find(self, iterated=False, **attempts):
        """What is found where steps in ms pass (True), fail (False) or cannot be flown (None)."""

        def attempt(step):
            passed = attempts[f"ms{step * 1000}"]
            return None if passed is None else remedy.Attempt(passed, 4.0, {"x": 1.0})

        return remedy.find("E()", Fraction(0), Fraction(8, 1000), attempt, lambda: iterated)

    def test_a_way_out_that_does_not_pass_is_not_told(self):
        assert self.find(ms4=True, ms2=True).endswith("--step 4ms (communication_step_size=0.004).")
        assert self.find(True, ms4=True, ms2=True).endswith(", or --master iterated (master=Iterated()).")

    def test_a_trial_that_cannot_be_judged_tells_nothing(self):
        assert self.find(ms4=True, ms2=None) == self.find(ms4=None) == self.find(ms4=False, ms2=False, ms1=None) == ""

    def test_a_gap_is_no_pass(self):
        assert "at 1 ms the same flight passes" in self.find(ms4=True, ms2=False, ms1=True, **{"ms1/2": True})

    def test_a_fraction(self):
        passed = remedy.Attempt(True, 4.0)
        words = remedy.find("E()", Fraction(0), Fraction(1, 15), lambda _: passed, lambda: False)
        assert "--step 1/30s (communication_step_size=Fraction(1, 30))" in words

    def test_failures_are_one_by_the_length_of_the_flight(self):
        """2 and 1 s of flights that begin at 5000 s: not the same."""
        times = iter((5002.0, 5001.5, 5001.2, 5001.0))
        words = remedy.find(
            "E()", Fraction(5000), Fraction(1), lambda _: remedy.Attempt(False, next(times)), lambda: False
        )
        assert words.endswith("E() may need a shorter step still.")

    def test_an_interrupt_ends_them(self):
        def fly(experiment, look):
            raise KeyboardInterrupt

        error = replace(self.FAILED)
        remedy.advise(error, both.experiment(stop=10.0), Explicit(), fly)
        assert error.remedy == ""

    def test_a_master_with_steps_of_its_own_is_not_tried(self):
        error = replace(self.FAILED)
        remedy.advise(error, both.experiment(stop=10.0), ErrorControlled(), lambda *_: pytest.fail("it was flown"))
        assert error.remedy == ""

    def test_what_did_not_grow_is_not_tried(self):
        error = StepFailed("a", "fmi2Error", 3.0, 0.1, messages=("the wheel came off",))
        remedy.advise(error, both.experiment(stop=10.0), Explicit(), lambda *_: pytest.fail("it was flown"))
        assert error.remedy == ""


def test_a_stiff_control_loop_held_too_long():
    """zhang2018 with its torque held."""
    from cosim.cli.library import Library

    system, experiment = papers.scenario("zhang2018-ppatc")
    with prepare(system, Library("native")) as prepared, pytest.raises(StepFailed) as caught:
        prepared.fly(replace(experiment, communication_step_size=4e-3, master=Explicit()))
    told = caught.value.remedy
    assert told.startswith("Explicit() diverged at steps of 4 ms; at 2 ms the same flight passes t = ")
    assert told.endswith(" s: --step 2ms (communication_step_size=0.002), or --master iterated (master=Iterated()).")
