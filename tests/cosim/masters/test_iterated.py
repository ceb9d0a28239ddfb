"""The iterated master: closed forms, what is refused, what is held, what leaves no trace, what does not converge."""

import json
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from cosim import simulate
from cosim.errors import NotConverged, NotSupported, StepFailed, UnknownName
from cosim.masters.iterated import Iterated
from fmus.export.build import build as build_component

from .. import both, sampled
from ..c_fmu import build, integer, real
from .integrators import LINKS, integrator, loop, trapezoidal

TIGHT = Iterated(tolerance=1e-13)
RELAY = dict(outputs="y = u > 0.2718 ? -1 : 1;", step="u += h * m->slope[0];")
FOLLOWS = dict(outputs="y = -u;", canInterpolateInputs=False)


def setup(stop=1.0, step=0.1, master=TIGHT, **more):
    return replace(both.experiment(stop=stop, step=step, **more), master=master)


def rows(result):
    return np.column_stack([result["a.y"], result["b.y"]])


@pytest.fixture(scope="module")
def pair(tmp_path_factory):
    return loop(tmp_path_factory.mktemp("pair"))


def follower(folder, **more):
    """y = -u at once, of an FMU that cannot interpolate its input."""
    return build(folder, "Follower", [real("u", "input"), real("y", depends="u")], **FOLLOWS, **more)


class TestClosedForms:
    """Of the implicit exchange, to the iteration's 1e-13 of each step and rounding."""

    def test_lines_are_the_trapezoidal_rule(self, pair):
        result = both.fly(both.of(pair, LINKS), setup())
        assert_allclose(rows(result), trapezoidal(0.1, 10), atol=1e-12)

    def test_an_fmu_that_cannot_interpolate_is_held_at_the_middle(self, tmp_path):
        """To an integrator the middle of a line is the line."""
        fmus = loop(tmp_path, canInterpolateInputs=False)
        result = both.fly(both.of(fmus, LINKS), setup(master=replace(TIGHT, inputs="ramp")))
        assert_allclose(rows(result), trapezoidal(0.1, 10), atol=1e-12)

    def test_and_read_again_with_the_end_where_it_follows_its_input(self, tmp_path, pair):
        """x' = -x: y is what x is at the end, not in the middle."""
        system = both.of({"a": pair["a"], "b": follower(tmp_path)}, LINKS)
        result = both.fly(system, setup())
        assert_allclose(result["b.y"], -result["a.y"], atol=1e-12)
        assert_allclose(result["a.y"], ((1 - 0.05) / (1 + 0.05)) ** np.arange(11), atol=1e-12)

    def test_what_is_in_no_loop_steps_once(self, tmp_path):
        """y = t into an integrator: no evaluations of loops, and t^2 / 2."""
        clock = build(tmp_path, "Clock", [real("y")], step="y = t + h;", canGetAndSetFMUstate=False)
        system = both.of({"i": integrator(tmp_path, "I"), "clock": clock}, [("clock.y", "i.u")])
        result = simulate(system, setup(master=replace(TIGHT, kernel="never")))
        assert_allclose(result["i.y"], result.time**2 / 2, atol=1e-14)
        assert result.info["loop"]["evaluations"] == 0

    def test_run_json_tells_the_evaluations(self, tmp_path, pair):
        simulate(both.of(pair, LINKS), setup(), out=tmp_path / "out")
        info = json.loads((tmp_path / "out" / "run.json").read_text())
        # a linear map: guessed and corrected, one more for each unknown of the first Jacobian, which is by differences
        assert 10 < info["loop"]["evaluations"] <= 2 * 10 + 2
        assert info["master"] == {"name": "Iterated", "inputs": "smooth", "tolerance": 1e-13, "kernel": "auto"}


class TestRefused:
    def test_settings(self):
        for tolerance in (0.0, -1e-9, float("nan"), 1.0):
            with pytest.raises(
                NotSupported, match=rf"^tolerance = {tolerance:g}\. It must be above 0 and below 1, such"
            ):
                Iterated(tolerance=tolerance)
        with pytest.raises(UnknownName, match=r'^unknown inputs "smoth" in Iterated\. Did you mean "smooth"'):
            Iterated("smoth")  # pyright: ignore

    def test_a_state_that_cannot_be_saved(self, tmp_path):
        fmus = loop(tmp_path, canGetAndSetFMUstate=False)
        words = r"^b cannot save its state \(canGetAndSetFMUstate=false\), so its step cannot be repeated\. Choose mas"
        with pytest.raises(NotSupported, match=words):
            simulate(both.of(fmus, LINKS), setup())

    def test_several_rates(self, pair):
        with pytest.raises(
            NotSupported, match=r"^Iterated steps all components together, but b takes 2 steps in one\."
        ):
            simulate(both.of(pair, LINKS, steps={"b": 2}), setup())

    def test_what_follows_its_input_and_can_be_read_only_after_a_step(self, tmp_path, pair):
        """It has no refresh mark: what it shows is of the middle of the step."""
        system = both.of({"a": pair["a"], "b": follower(tmp_path, refresh=False)}, LINKS)
        words = (
            r"^b cannot interpolate u \(canInterpolateInputs=false\), and y follows it directly, but cannot be read "
        )
        with pytest.raises(NotSupported, match=words):
            simulate(system, setup())


class TestHeld:
    def test_discrete_outputs(self, tmp_path):
        """A count is no curve: who takes it has in a step what it was at its start."""
        count = build(tmp_path, "Count", [real("u", "input"), integer("n"), real("y")], step="n += 1; y = n;")
        taker = build(tmp_path, "Taker", [integer("k", "input"), real("y")], step="y += h * k;")
        system = both.of({"c": count, "t": taker}, [("c.n", "t.k"), ("t.y", "c.u")])
        result = both.fly(system, setup())
        assert result["c.n"].tolist() == list(range(11))
        assert_allclose(result["t.y"], 0.1 * np.cumsum([0, *range(10)]), rtol=1e-12)

    def test_a_sampled_component_in_the_loop(self, tmp_path, pair):
        """s_n = s_n-1 + y_n, held; y_n+1 = y_n + h s_n."""
        total = build_component(sampled.Total(), tmp_path / "total.fmu")
        system = both.of({"a": pair["a"], "s": total}, [("a.y", "s.u"), ("s.shown", "a.u")])
        result = both.fly(system, setup())
        y, s, expected = 1.0, 1.0, [(1.0, 1.0)]
        for _ in range(10):
            y = y + 0.1 * s
            s = s + y
            expected.append((y, s))
        assert_allclose(np.column_stack([result["a.y"], result["s.shown"]]), expected, rtol=1e-12)


class TestTakenBack:
    def test_steps_that_were_repeated_leave_no_trace(self, tmp_path):
        """An FMU that counts its steps has made one in each."""
        variables = [real("u", "input"), real("y"), real("made")]
        counting = build(tmp_path, "Counting", variables, step="y -= h * (u + 0.5 * h * m->slope[0]); made += 1;")
        result = both.fly(both.of({"a": integrator(tmp_path, "A", 1, 1.0), "b": counting}, LINKS), setup())
        assert result.info["loop"]["evaluations"] > 10
        assert_array_equal(result["b.made"], np.arange(11))
        assert_allclose(rows(result), trapezoidal(0.1, 10), atol=1e-12)

    def test_a_refused_step_is_halved(self, tmp_path):
        """Both go back and come in two steps to the same point."""
        fmus = loop(tmp_path, "m->last = t; if (h > 0.06) return fmi2Discard;")
        result = both.fly(both.of(fmus, LINKS), setup())
        assert_array_equal(result.time, np.arange(11) / 10)
        assert_allclose(rows(result), trapezoidal(0.05, 20)[::2], atol=1e-12)

    def test_one_that_is_refused_for_good_ends_the_run(self, tmp_path):
        fmus = loop(tmp_path, "m->last = t; if (t > 0.45) return fmi2Discard;")
        error = both.failure(StepFailed, both.of(fmus, LINKS), setup())
        assert str(error).startswith("b returned fmi2Discard at communication point 0.5 s")
        assert len(error.result) == 6

    def test_it_is_not_halved_where_a_step_must_be_constant(self, tmp_path):
        fmus = loop(
            tmp_path,
            "m->last = t; if (t > 0.45) return fmi2Discard;",
            canHandleVariableCommunicationStepSize=False,
        )
        error = both.failure(StepFailed, both.of(fmus, LINKS), setup())
        assert error.step == pytest.approx(0.1)


class TestNotConverged:
    @pytest.fixture
    def relay(self, tmp_path, pair):
        """x' = y, y = -1 where x > .2718, else 1: in the step that comes there nothing agrees, however short it is."""
        law = build(
            tmp_path,
            "Relay",
            [real("u", "input"), real("y", depends="u", start=1.0)],
            **RELAY,
        )
        start = integrator(tmp_path, "X")
        return both.of({"a": start, "b": law}, LINKS)

    def test_it_is_halved_and_then_told(self, relay, tmp_path):
        with pytest.raises(NotConverged) as caught:
            simulate(relay, setup(), out=tmp_path / "out")
        error = caught.value
        assert str(error).startswith("the step from 0.2")
        for words in ("does not converge", "halved 8 times", "allowed are 1e-13", "Choose a shorter step or a larger"):
            assert words in str(error)
        assert error.loop and error.halvings == 8 and error.change > 1e-13
        info = json.loads((tmp_path / "out" / "run.json").read_text())
        assert (info["status"], info["error"]) == ("failed", "NotConverged")
        assert_array_equal(error.result.time, [0.0, 0.1, 0.2])
        assert_allclose(error.result["a.y"], [0.0, 0.1, 0.2], atol=1e-12)

    def test_both_loops_say_the_same(self, relay):
        both.failure(NotConverged, relay, setup())

    def test_why_it_was_not_halved(self, tmp_path):
        law = build(
            tmp_path,
            "Relay",
            [real("u", "input"), real("y", depends="u", start=1.0)],
            **RELAY,
            canHandleVariableCommunicationStepSize=False,
        )
        system = both.of({"a": integrator(tmp_path, "X"), "b": law}, LINKS)
        with pytest.raises(NotConverged, match=r"it was not halved \(b needs a constant step\)\. Sought were "):
            simulate(system, setup())
