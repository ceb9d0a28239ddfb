"""Error-controlled steps: what is refused, how long a step is, where it lands, what happens where it fails."""

import json
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from cosim import simulate
from cosim.errors import NotSupported, StepFailed, TimeError, ToleranceMissed, UnknownName
from cosim.masters.control.error_controlled import ErrorControlled as Control
from cosim.masters.error_controlled import ErrorControlled
from cosim.masters.master import Deviation, Outcome
from cosim.masters.point import Point
from cosim.masters.types import Texts
from cosim.time import Schedule
from fmus.export.build import build as build_component

from .. import both, sampled
from ..c_fmu import build, real
from ..fakes import Clock, Integrator
from ..flights import run
from .integrators import LINKS, loop


@pytest.fixture(scope="module")
def pair(tmp_path_factory):
    return loop(tmp_path_factory.mktemp("pair"))


def fly(fmus, links=tuple(LINKS), stop=4.0, step=0.5, out=None, **settings):
    setup = both.experiment(stop=stop, step=step, **{k: settings.pop(k) for k in ("every",) if k in settings})
    return simulate(both.of(fmus, links), replace(setup, master=ErrorControlled(**settings)), out=out)


class TestSettings:
    @pytest.mark.parametrize(
        ("given", "words"),
        [
            ({"relative": 0.0}, r"^relative = 0\. A tolerance must be above 0 and below 1, such as 1e-6\.$"),
            ({"relative": float("nan")}, r"^relative = nan\."),
            ({"absolute": -1e-6}, r"^absolute = -1e-06\."),
            ({"tolerances": {"a.y": 2.0}}, r'^tolerances\["a\.y"\] = 2\.'),
            ({"least_step": 0.0}, r"^least_step = 0 s\. A step must be longer than 0 s\.$"),
            ({"largest_step": -1.0}, r"^largest_step = -1 s\."),
            (
                {"least_step": 0.2, "largest_step": 0.1},
                r"^least_step = 0\.2 s is above largest_step = 0\.1 s\. Choose a least step that is the shorter one\.$",
            ),
        ],
    )
    def test_numbers_that_cannot_be(self, given, words):
        with pytest.raises(NotSupported, match=words):
            ErrorControlled(**given)

    def test_an_unknown_kernel(self):
        with pytest.raises(UnknownName, match=r'unknown kernel "yes" in ErrorControlled'):
            ErrorControlled(kernel="yes")  # pyright: ignore

    def test_they_are_plain_data(self):
        one, other = (ErrorControlled(tolerances={"a.y": 1e-9}) for _ in range(2))
        assert one == other and hash(one) == hash(other)


class TestRefused:
    """By name, before the first step, with what to use instead."""

    def test_a_state_that_cannot_be_saved(self, tmp_path):
        fmus = loop(tmp_path, canGetAndSetFMUstate=False, canSerializeFMUstate=False)
        words = r"^b cannot save its state \(canGetAndSetFMUstate=false\), so its step cannot be taken back\. Choose "
        with pytest.raises(NotSupported, match=words + r"master=Explicit\(\)"):
            fly(fmus)

    def test_that_of_an_fmu_in_no_loop_too(self):
        words = r"^clock cannot save its state .* master=Iterated\(\) where it is in no loop\.$"
        with pytest.raises(NotSupported, match=words):
            run(
                [Clock("clock"), Integrator("i", can_get_and_set_state=True)],
                [("clock.y", "i.u")],
                master=ErrorControlled(),
            )

    def test_a_constant_step(self, tmp_path):
        fmus = loop(tmp_path, canHandleVariableCommunicationStepSize=False)
        with pytest.raises(
            NotSupported, match=r"^b needs a constant step \(canHandleVariableCommunicationStepSize=fal"
        ):
            fly(fmus)

    def test_several_rates(self, pair):
        with pytest.raises(
            NotSupported, match=r"^ErrorControlled steps all components together, but b takes 2 steps in"
        ):
            simulate(
                both.of(pair, LINKS, steps={"b": 2}),
                replace(both.experiment(), master=ErrorControlled()),
            )

    def test_an_unknown_output(self, pair):
        words = r'^unknown connected output "a\.z" in tolerances\. Did you mean "a\.y"\?'
        with pytest.raises(UnknownName, match=words):
            fly(pair, tolerances={"a.z": 1e-9})

    def test_a_least_step_above_the_distance_of_rows(self, pair):
        words = r"^least_step = 2 s is above the distance of two rows, 1 s\. Choose a shorter one, or record fewer rows"
        with pytest.raises(NotSupported, match=words):
            fly(pair, least_step=2.0, step=0.5, every=2)

    def test_a_largest_step_that_cannot_be_counted(self, pair):
        words = (
            r"^largest_step = 1e-08 s is below the least step, 4\.76837e-07 s\. Choose a longer one, or give least_step"
        )
        with pytest.raises(NotSupported, match=words):
            fly(pair, largest_step=1e-8, step=0.5)

    def test_a_least_step_that_cannot_be_counted(self, pair):
        """A double at 1e8 s tells apart no steps below 1e-8 s."""
        with pytest.raises(TimeError, match=r"^least_step is .*: times up to 100000000 s cannot be counted in it\."):
            fly(pair, least_step=1e-9, stop=1e8, step=1e-6)


END = 5000


def controls(least=1, largest=10**6, first=100, landings=(1000,), stop=END):
    return Control(Schedule(0, stop, 1, 1000, 1000), least, largest, first, landings)


def at(index, *pace):
    return Point(index, np.zeros(0), np.zeros(0), np.zeros(0), Texts(), np.array(pace))


def judged(point, error):
    return Outcome(point, Deviation("a.y", error, 1.0))


class TestControl:
    def test_the_first_step_is_the_experiment_s(self):
        assert controls().until(at(0), END, far=False) == 100

    def test_pi_control(self):
        """Gustafsson's law, written out: .7 is aimed at, .3 / 3 and .4 / 3 are its powers."""
        until = controls(landings=(10**6,), stop=10**6).until(at(1000, 100, 0.5, 0.2), 10**6, far=False)
        assert until - 1000 == int(100 * (0.7 / 0.5) ** 0.1 * (0.2 / 0.5) ** (0.4 / 3))

    @pytest.mark.parametrize(("error", "factor"), [(1e-4, 5.0), (0.9, (0.7 / 0.9) ** (1 / 3)), (1e9, 0.2)])
    def test_growth_is_limited(self, error, factor):
        until = controls(landings=(10**6,), stop=10**6).until(at(1000, 100, error, 0.0), 10**6, far=False)
        assert until - 1000 == int(100 * factor)

    @pytest.mark.parametrize(("index", "expected"), [(0, 300), (300, 600), (600, 800), (800, 1000), (950, 1000)])
    def test_a_landing_is_met_by_two_steps_of_one_size(self, index, expected):
        control = controls(least=10, largest=300)
        assert control.until(at(index, 100, 1e-4, 0.0), END, far=False) == expected

    def test_no_landing_is_passed(self):
        control = controls(landings=(1000, 300))
        for index, expected in ((250, 300), (299, 300), (900, 1000), (4990, 5000)):
            assert control.until(at(index, 900, 1e-4, 0.0), END, far=False) == expected

    def test_a_step_that_errs_too_much_is_shortened(self):
        control, point = controls(), at(0)
        control.until(point, END, far=False)
        assert not control.accepts(judged(point, 2.0))
        assert control.until(point, END, far=False) == int(100 * (0.7 / 2) ** (1 / 3))
        assert control.accepts(judged(at(70), 1.0))
        assert control.told() == {"steps": {"accepted": 1, "rejected": 1, "smallest": 0.07, "largest": 0.07}}

    def test_a_step_that_fails_is_shortened_most(self):
        control, point = controls(), at(0)
        control.until(point, END, far=False)
        assert not control.accepts(Outcome(point, None, 1, StepFailed("b", "fmi2Discard", 0.0, 0.1)))
        assert control.until(point, END, far=False) == 20

    def test_the_least_step_is_the_last_word(self):
        control, point = controls(least=90), at(0)
        control.until(point, END, far=False)
        assert not control.accepts(judged(point, 50.0))
        assert control.until(point, END, far=False) == 90
        with pytest.raises(ToleranceMissed) as caught:
            control.accepts(judged(point, 50.0))
        assert str(caught.value) == (
            "the step from 0 s, 0.09 s long, the least that is allowed: a.y may be wrong by 50 after it, allowed are "
            '1. Choose a larger tolerance (of this output alone: tolerances={"a.y": ...}) or a smaller least_step; '
            "where a law switches, master=Iterated() goes on."
        )


class TestFlights:
    def test_the_estimate_of_two_half_steps(self, pair):
        """The trapezoidal rule errs by h^3 / 12 in a step of an oscillator of unit rate and amplitude.

        Two half steps err by a quarter of it: the longest of 400 s is where all of the tolerance, 2e-6 with the size,
        is used: h^3 = 12 4 2e-6. A tenth less and up to 5 % more, for the error turns with the state, of both
        components of which the norm takes the larger: between .7 and 1 of its length.
        """
        result = fly(pair, relative=1e-6, stop=20.0, step=20.0)
        steps = result.info["loop"]["steps"]
        longest = (12 * 4 * 2e-6) ** (1 / 3)
        assert 0.7 * longest < steps["largest"] < 1.2 * longest
        # the error of a step turns with the state: over a radian it sums to no more than all of them
        assert abs(result["a.y"][-1] - np.cos(20.0)) < 2e-6 * steps["accepted"]

    def test_rows_and_stop_are_met_exactly(self, pair):
        result = fly(pair, relative=1e-4, stop=1.0, step=0.3)
        assert_array_equal(result.time, [0.0, 0.3, 0.6, 0.9, 1.0])
        every = fly(pair, relative=1e-4, stop=1.0, step=0.1, every=3)
        assert_array_equal(every.time, result.time)
        assert every.info["communication_step_size"] == 0.1 and every.info["every"] == 3
        assert_allclose(every["a.y"], np.cos(every.time), atol=1e-4 * every.info["loop"]["steps"]["accepted"])

    def test_least_and_largest_step(self, pair):
        result = fly(pair, relative=1e-4, least_step=0.01, largest_step=0.02, stop=1.0)
        steps = result.info["loop"]["steps"]
        assert 0.01 <= steps["smallest"] <= steps["largest"] <= 0.02 * (1 + 1e-12)

    @pytest.mark.parametrize("status", ["fmi2Discard", "fmi2Error"])
    def test_a_step_that_is_refused_is_shortened(self, tmp_path, status):
        """An FMU that takes no step above 30 ms: it and its partner go back, and no row is missing."""
        fmus = loop(tmp_path, f"m->last = t; if (h > 0.03) return {status};")
        result = fly(fmus, relative=1e-2)
        steps = result.info["loop"]["steps"]
        assert steps["rejected"] >= 1 and 0.01 < steps["largest"] <= 0.03
        assert len(result) == 9
        assert_allclose(result["a.y"], np.cos(result.time), atol=4.0 * 0.03**2 / 12)

    def test_one_that_is_refused_at_any_length_ends_the_run(self, tmp_path):
        """In its own words; the rows so far are kept."""
        fmus = loop(tmp_path, "m->last = t; if (t > 1.2) return fmi2Discard;")
        with pytest.raises(StepFailed, match=r"^b returned fmi2Discard at communication point 1\.2") as caught:
            fly(fmus, relative=1e-2, least_step=0.001)
        assert not isinstance(caught.value, ToleranceMissed)
        assert_array_equal(caught.value.result.time[:3], [0.0, 0.5, 1.0])
        steps = caught.value.result.info["loop"]["steps"]
        assert steps["accepted"] > 2
        assert 1.2 < caught.value.result.time[-1] <= 1.2 + steps["largest"] / 2  # its second half began in time

    def test_an_error_that_no_step_makes_small(self, tmp_path):
        """What it gives depends on how long the step was."""
        strange = build(tmp_path, "Strange", [real("y")], step="y = h < 0.4 ? 1 / h : 0;")
        target = build(
            tmp_path, "Target", [real("u", "input"), real("y")], step="y += h * (u + 0.5 * h * m->slope[0]);"
        )
        words = r"^the step from 0 s, 0\.0\d+ s long, the least that is allowed: s\.y may be wrong by [\d.]+ after it"
        with pytest.raises(ToleranceMissed, match=words) as caught:
            fly({"s": strange, "t": target}, [("s.y", "t.u")], least_step=0.01)
        assert len(caught.value.result) == 1

    def test_a_flight_of_one_fmu_alone(self, tmp_path):
        clock = build(tmp_path, "Clock", [real("y")], step="y = t + h;")
        result = fly({"clock": clock}, [], stop=2.0, step=1.0)
        assert result.info["loop"]["steps"] == {"accepted": 2, "rejected": 0, "smallest": 1.0, "largest": 1.0}

    def test_run_json(self, pair, tmp_path):
        fly(pair, relative=1e-4, tolerances={"a.*": 1e-5}, out=tmp_path / "out")
        info = json.loads((tmp_path / "out" / "run.json").read_text())
        assert info["master"]["name"] == "ErrorControlled" and info["master"]["tolerances"] == [["a.*", 1e-5]]
        assert info["communication_step_size"] == 0.5 and info["loop"]["evaluations"] > 20
        assert set(info["loop"]["steps"]) == {"accepted", "rejected", "smallest", "largest"}

    def test_steps_land_on_samples(self, tmp_path):
        """A sum of y = t sampled each .1 s: rows each .3 s, and steps that would be as long."""
        fmus = {
            "line": build_component(sampled.Line(), tmp_path / "line.fmu"),
            "total": build_component(sampled.Total(), tmp_path / "total.fmu"),
        }
        result = fly(fmus, [("line.y", "total.u")], stop=1.2, step=0.3)
        assert result.info["loop"]["steps"]["largest"] <= 0.1 * (1 + 1e-12)
        assert_allclose(result["total.shown"], [sum(0.1 * n for n in range(3 * k + 1)) for k in range(5)], rtol=1e-12)
