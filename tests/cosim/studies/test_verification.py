"""adcs verify on loops in closed form: order, error, what ends a flight, the largest step that flies."""

import json
from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest
from numpy.testing import assert_allclose

from cosim import prepare
from cosim.errors import NotSupported, UnknownName
from cosim.masters.error_controlled import ErrorControlled
from cosim.masters.explicit import Explicit
from cosim.masters.iterated import Iterated
from cosim.studies.verification import FILE, verify
from cosim.studies.verification.limit import largest_step, rounded
from cosim.studies.verification.trial import OutOfTime, Trial
from cosim.system import Experiment
from fmus.export.build import build

from .. import both, relay, sampled
from ..c_fmu import build as build_c
from ..c_fmu import real

MS = Fraction(1, 1000)


@pytest.fixture(scope="module")
def prepared(tmp_path_factory):
    folder = tmp_path_factory.mktemp("relay")
    components = {"store": relay.Store(), "gain": relay.Gain()}
    with prepare(
        both.of({n: build(c, folder / f"{n}.fmu", "native") for n, c in components.items()}, relay.LINKS)
    ) as p:
        yield p


def setup(step, stop=1.0, **more) -> Experiment:
    return Experiment(stop_time=stop, communication_step_size=step, **more)


class TestOrderAndError:
    def test_the_extrapolated_error_is_the_error(self, prepared):
        """x_k = (1 - k h)^n against exp(-k t): the order and the error of the flight at h are known."""
        found = verify(prepared, setup(1e-3))
        store, gain = found.variables
        assert (store.variable, gain.variable) == ("store.x", "gain.u")  # no plant: what is connected
        n = np.arange(1001)
        error = np.abs((1 - 0.1) ** n - np.exp(-0.1 * n)).max()
        # Both are exact up to the next term of the error, k h = 0.1 of it.
        assert_allclose([store.order, store.error / error], 1.0, atol=0.1)
        assert_allclose(gain.error, 100 * store.error, rtol=1e-9)
        assert found.compared == (MS, MS / 2, MS / 4)
        assert [t.ended for t in found.trials] == ["finished"] * 3 and found.complete

    def test_parameters_and_the_settings_of_the_master_count(self, prepared):
        found = verify(prepared, setup(1e-3, master=Explicit(preset="jacobi")), parameters={"gain.k": 10.0})
        assert_allclose(found.variables[0].order, 1.0, atol=0.01)
        assert found.exchange == "Explicit(preset='jacobi')"

    def test_the_iterated_master(self, prepared):
        """k h = 0.08: the next term of the error is as small a part; u = k x is known at both ends with its slope."""
        found = verify(prepared, setup(8e-3, master=Iterated(tolerance=1e-13)), parameters={"gain.k": 10.0})
        assert_allclose(found.variables[0].order, 4.0, atol=0.08)
        n = found.trials[0].result.time / 8e-3
        exact = np.exp(-0.08 * n)
        error = np.abs(found.trials[0].result["store.x"] - exact).max()
        assert_allclose(found.variables[0].error, error, rtol=0.1)
        assert all(t.evaluations > 1 for t in found.trials)
        assert all(t.evaluations == 1 for t in verify(prepared, setup(1e-3)).trials)

    def test_rows_are_shared_whatever_is_recorded(self, prepared):
        every, rarely = (verify(prepared, setup(1e-3, every=n)).variables[0] for n in (1, 10))
        # the largest error is at k t = 1, t = 10 ms, which both have
        assert_allclose(rarely.error, every.error, rtol=1e-12)

    def test_a_system_is_prepared(self, prepared):
        assert verify(prepared.system, setup(1e-3)).variables == verify(prepared, setup(1e-3)).variables


class TestEnds:
    def test_a_divergent_step_does_not_hide_the_finer_ones(self, prepared):
        """k h = 3.2: a factor of -2.2 a step is infinite after 900 steps, 29 s; at half of it the factor is -0.6."""
        found = verify(prepared, setup(0.032, stop=30.0))
        assert [t.finished for t in found.trials] == [False, True, True, True]
        assert found.trials[0].ended.startswith("StepFailed: ") and 28 < found.trials[0].reached < 30
        assert found.compared == (16 * MS, 8 * MS, 4 * MS)
        assert found.variables[0].order is not None

    def test_a_flight_that_diverges_may_be_finite(self, prepared):
        """The same for 1 s: 2.2^31 = 4e10."""
        found = verify(prepared, setup(0.032))
        assert [t.finished for t in found.trials] == [False, True, True, True]
        assert found.trials[0].ended == "diverges: store.x reaches 4.12e+10, at 16 ms 1"

    def test_finer_ones_may_grow_more_than_coarser_ones(self, prepared):
        """k h = 40, 20, 10, 5 for 4 s: 39^10, 19^20, 9^40, 4^80, of which none is judged as the finest."""
        found = verify(prepared, setup(0.4, stop=4.0), search=60.0)
        assert [t.finished for t in found.trials] == [False, False, False, True]
        assert found.variables == ()
        assert found.limit.remark == "no two flights agree in size to compare with: begin at a shorter step"

    def test_an_event_ends_each_flight(self, tmp_path):
        clock = build_c(tmp_path, "Clock", [real("y")], step="y = t + h;")
        taker = build_c(tmp_path, "Taker", [real("u", "input"), real("v")], step="v += h * u;")
        system = both.of({"clock": clock, "taker": taker}, [("clock.y", "taker.u"), ("taker.v", "clock2.u")][:1])
        found = verify(system, setup(0.25, stop=2.0, stop_when="clock.y"))
        assert [t.ended for t in found.trials] == [
            "ended by clock.y at 0.75 s", "ended by clock.y at 0.625 s", "ended by clock.y at 0.5625 s",
        ]  # fmt: skip
        assert found.variables[0].remark == "the same to the last bit"

    def test_a_step_that_is_refused_is_told(self, tmp_path):
        """A sample of 0.1 s: 0.3 s meets it, 0.15 s does not."""
        parts = {"line": sampled.Line(), "total": sampled.Total()}
        fmus = {name: build(c, tmp_path / f"{name}.fmu", "native") for name, c in parts.items()}
        found = verify(both.of(fmus, [("line.y", "total.u")]), setup(0.3, stop=3.0))
        assert [t.finished for t in found.trials] == [True, False, False, False]
        assert found.trials[1].ended == (
            'WiringErrors: system "test" has 1 mistake: WiringError: total samples every 0.1 s, '
            "but steps of 0.15 s do not meet that. Choose a communication step of 0.1, 0.05, 0.02, 0.01 s, or a "
            "multiple of the sample time."
        )

    def test_a_step_that_cannot_be_halved_is_told(self, prepared):
        found = verify(prepared, setup(1e-9, stop=4e-9))
        assert [t.finished for t in found.trials] == [True, False, False, False]
        assert found.trials[1].ended.startswith("TimeError: communication_step_size is 1/2000000000 s: ")

    def test_what_cannot_be_flown_at_all_is_refused(self, prepared):
        with pytest.raises(UnknownName, match="stop_when"):
            verify(prepared, setup(1e-3, stop_when="store.z"))

    def test_nothing_to_compare(self, tmp_path):
        alone = build_c(tmp_path, "Alone", [real("y")], step="y = t + h;")
        with pytest.raises(NotSupported, match=r"nothing to compare: no plant, and no connected output .* Connect one"):
            verify(both.of({"a": alone}, []), setup(0.1))

    def test_a_master_with_steps_of_its_own(self, prepared):
        with pytest.raises(NotSupported, match=r"ErrorControlled chooses its own steps.* Choose --master explicit or"):
            verify(prepared, setup(1e-3, master=ErrorControlled()))

    def test_an_interrupt_keeps_what_was_flown(self, prepared):
        def press(t, stop):
            raise KeyboardInterrupt

        found = verify(prepared, setup(1e-3), progress=press)
        assert not found.complete and len(found.trials) == 1 and found.variables == ()


class TestLimit:
    """Held, |1 - k h| <= 1 up to h = 2 / k = 20 ms."""

    @pytest.mark.parametrize("first", [1e-3, 0.05, Fraction(1, 300)])
    def test_the_largest_step_that_flies(self, prepared, first):
        """At 21 ms the factor is 1.1, 1.1^238 = 7e9 after 5 s."""
        limit = verify(prepared, setup(first, stop=5.0), search=60.0).limit
        assert (limit.flies, limit.fails, limit.remark) == (20 * MS, 21 * MS, "")

    def test_what_fails_is_said(self, prepared):
        limit = verify(prepared, setup(1e-3, stop=5.0), search=60.0).limit
        assert limit.how.startswith("diverges: store.x reaches ")

    def test_none_up_to_a_tenth_of_the_flight(self, prepared):
        limit = verify(prepared, setup(1e-3, stop=0.1), search=60.0).limit
        assert limit.fails is None
        assert limit.remark == "none diverges up to 10 ms, 10 steps of the flight"

    def test_it_is_not_searched_unasked(self, prepared):
        assert verify(prepared, setup(1e-3)).limit is None

    def test_its_time_is_bounded(self, prepared):
        limit = verify(prepared, setup(1e-3, stop=5.0), search=1e-9).limit
        assert limit.remark == "the search ran out of its time"

    def test_it_needs_some_time(self, prepared):
        with pytest.raises(NotSupported, match=r"a search of -1 s. Give it some time: search=60.0, --limit-time 60s"):
            verify(prepared, setup(1e-3), search=-1.0)

    def test_refused_steps_say_nothing_of_the_exchange(self):
        limit = largest_step(lambda step: trial(step, True, refused=step > 3 * MS), MS, None, 100 * MS)
        assert (limit.flies, limit.fails) == (2 * MS, None)
        assert limit.remark == "steps of 4 ms are refused: refused"

    def test_a_flight_that_failed_already_is_the_upper_end(self):
        limit = largest_step(lambda step: trial(step, step <= 3 * MS), 2 * MS, trial(4 * MS, False), 100 * MS)
        assert (limit.flies, limit.fails) == (3 * MS, MS * 31 / 10)

    def test_the_bracket_is_kept_where_time_runs_out(self):
        def attempt(step):
            if step == 3 * MS:
                raise OutOfTime
            return trial(step, step <= 2 * MS)

        limit = largest_step(attempt, MS, None, 100 * MS)
        assert (limit.flies, limit.fails, limit.remark) == (2 * MS, 4 * MS, "the search ran out of its time")

    def test_an_interrupt_keeps_the_bracket(self):
        def attempt(step):
            raise KeyboardInterrupt

        limit = largest_step(attempt, MS, None, 100 * MS)
        assert (limit.flies, limit.fails, limit.remark) == (MS, None, "the search was interrupted")

    @pytest.mark.parametrize(
        ("step", "expected"), [(Fraction(1, 30), "0.033"), (Fraction(127, 10**6), "0.00013"), (Fraction(99, 10), "9.9")]
    )
    def test_two_digits(self, step, expected):
        assert rounded(step) == Fraction(expected)


class Flown:
    info = {"status": "finished"}


def trial(step, finished, refused=False) -> Trial:
    return Trial(step, finished, "refused" if refused else "x", 1.0, 0.0, 0.0, 1.0, None if refused else Flown())


class TestCommand:
    @pytest.fixture
    def system(self, folder, prepared):
        components = {n: str(r) for n, r in prepared.system.components.items()}
        (folder / "s.py").write_text(
            "from cosim import Connection, Experiment, System\n"
            "def system():\n"
            f"    links = [Connection(*c) for c in {relay.LINKS!r}]\n"
            f"    return System(name='s', components={components!r}, connections=links), "
            "Experiment(stop_time=1.0, communication_step_size=0.001)\n"
        )
        return "s.py"

    def test_the_table_and_the_file(self, adcs, folder, system):
        done = adcs("verify", system, "--out", "v", "--limit", "--stop", "5")
        assert done.status == 0, done.err
        assert "s by Explicit(), 5 s" in done.out
        assert "1 ms - 0.5 ms" in done.out and "error at 1 ms" in done.out
        assert "largest step: 20 ms flies, 21 ms does not (diverges: store.x reaches " in done.out
        content = json.loads((folder / "v" / FILE).read_text())
        assert [f["step"] for f in content["flights"]] == ["0.001 s", "0.0005 s", "0.00025 s"]
        assert_allclose(content["variables"][0]["order"], 1.0, atol=0.1)
        assert (content["limit"]["flies"], content["limit"]["fails"]) == ("0.02 s", "0.021 s")
        again = adcs("verify", system, "--out", "v")
        assert again.status == 2 and "already holds a result" in again.err
        assert adcs("verify", system, "--out", "v", "--force", "--stop", "1").status == 0

    def test_options_of_the_flight(self, adcs, system):
        done = adcs("verify", system, "--step", "2ms", "--stop", "0.5", "--master", "jacobi", "--set", "gain.k=20")
        assert "s by Explicit(preset='jacobi'), 0.5 s" in done.out
        assert "2 ms - 1 ms" in done.out
        done = adcs("verify", system, "--inputs", "smooth", "--extrapolation", "1", "--stop", "0.5")
        assert "s by Explicit(inputs='smooth', extrapolation=1), 0.5 s" in done.out

    def test_nothing_but_divergence(self, adcs, system):
        done = adcs("verify", system, "--step", "400ms", "--stop", "80")
        assert done.status == 1
        assert "fewer than two flights came to their end: nothing to compare. Try a shorter step: --step" in done.out

    def test_a_mistake_of_the_system(self, adcs, system):
        done = adcs("verify", system, "--set", "gain.z=1")
        assert done.status == 2 and "gain" in done.err


def test_a_plant_is_what_is_compared():
    from cosim.cli import scenario
    from cosim.cli.library import Library

    system, experiment = scenario.load("zhang2018-ppatc")
    found = verify(system, replace(experiment, stop_time=1.0), locate=Library("native"))
    names = [v.variable for v in found.variables]
    assert names[0] == "plant.q_BN" and found.variables[0].unit == "deg"
    assert {n.split(".")[0] for n in names} == {"plant"}
