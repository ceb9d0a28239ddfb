"""True slopes: what they are worth, where they are known, and the same bits in both loops."""

from dataclasses import replace
from itertools import product
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.integrate import quad
from scipy.interpolate import CubicHermiteSpline
from scipy.linalg import expm

from cosim import simulate
from cosim.cli.library import Library
from cosim.errors import NotSupported, StepFailed
from cosim.masters import curves
from cosim.masters.curves import Ends
from cosim.masters.explicit import Explicit
from cosim.masters.initialization import slopes as first_slopes
from cosim.masters.initialization.initialize import Initialization
from cosim.masters.layout import Layout
from cosim.masters.slopes import Differences
from cosim.system import Connection, Experiment, System
from cosim.system.expand import wire
from cosim.system.timing import remarks
from cosim.system.wiring import Port
from fmus.description.read import read_description
from fmus.export.python.in_process import InProcessSlave

from .. import both, slope_fmus
from ..c_fmu import build, real
from ..fakes import Clock, Gain, Integrator, Mean
from ..feedback import Body, Feedback
from ..flights import run
from ..wired import wired
from .test_point import Voyage, resumed

SLOPES = Explicit(inputs="smooth", extrapolation=1)


LOOP = [("body.x", "law.x_in", "smooth"), ("body.v", "law.v_in", "smooth"), ("law.f", "body.f", "at_point")]
A = np.array([[0.0, 1.0, 0.0], [-3.0, -1.5, -1.0], [1.0, 0.0, 0.0]])
START = np.array([1.0, -0.5, 0.2])


def closed_form(time):
    """x, v, z by the matrix exponential, shape (n, 3)."""
    return np.array([expm(A * t) @ START for t in time])


def in_process():
    return {
        name: InProcessSlave(name, component, failed=lambda *a: AssertionError(a))
        for name, component in (("body", Body()), ("law", Feedback()))
    }


def fly(step, master=SLOPES, **slaves):
    system = System(
        name="loop",
        components={"body": Body, "law": Feedback},
        connections=[Connection(*link) for link in LOOP],
        # RK4 is exact beside the exchange: rates below 3 / s, (3 h)^5 / 120 a step, 1e-8 in all at h = 10 ms
        parameters={"body.solver.step": 1e-2, "law.solver.step": 1e-2},
    )
    experiment = Experiment(stop_time=4.0, communication_step_size=step, master=master)
    return simulate(system, experiment, **slaves)


def error(result):
    exact = closed_form(result.time)
    return max(np.abs(result[n] - exact[:, i]).max() for i, n in enumerate(("body.x", "body.v", "law.z")))


class TestOrder:
    """A body and a law with direct feedthrough, one evaluation a step."""

    def test_smooth_and_extrapolated_is_of_order_two(self):
        errors = [error(fly(step, slaves=in_process())) for step in (0.04, 0.02, 0.01)]
        orders = np.log2(np.array(errors[:-1]) / errors[1:])
        assert np.all(np.abs(orders - 2) < 0.1), errors  # the next term, h times a rate below 3 / s, bends it by less

    def test_held_it_is_of_order_one(self):
        errors = [error(fly(step, Explicit(inputs="held"), slaves=in_process())) for step in (0.02, 0.01)]
        assert abs(np.log2(errors[0] / errors[1]) - 1) < 0.1
        assert errors[1] > 100 * error(fly(0.01, slaves=in_process()))

    def test_one_slope_at_the_start_that_is_not_true_costs_the_order(self, monkeypatch):
        """Asked with input slopes of zero, the law says f' = -x instead of -k v - d f - x."""
        right = [error(fly(step, slaves=in_process())) for step in (0.02, 0.01)]
        honest = first_slopes.read

        def wrong(asked, slave, values):
            honest(replace(asked, factor=0.0 * asked.factor), slave, values)

        monkeypatch.setattr(first_slopes, "read", wrong)
        errors = [error(fly(step, slaves=in_process())) for step in (0.02, 0.01)]
        assert all(e > 3 * r for e, r in zip(errors, right, strict=True)), (errors, right)

    def test_twin_and_native_fmus_give_the_same(self):
        """Cubic inputs and output derivatives of the Python twin and of C: one arithmetic but for the order of sums."""
        native, twin = fly(0.02, locate=Library("native")), fly(0.02, slaves=in_process())
        for name in twin.names:
            assert_allclose(native[name], twin[name], rtol=0, atol=1e-13)


class TestAtTheStart:
    def slopes(self, slaves, links, master=SLOPES, **held):
        """Port -> slope after initialization, of those that have slots."""
        wiring = master.timed(wired(links, slaves, held=held))
        layout = Layout.of(wiring)
        point = Initialization.of(wiring, layout).start({s.name: s for s in slaves}, 0.0)
        return {str(port): point.values[slot] for (port, n), slot in layout.derivative_slots.items() if n == 1}

    def test_of_a_law_it_is_the_derivative_along_the_loop(self):
        found = self.slopes(list(in_process().values()), LOOP)
        x, v, z = START
        force = -3 * x - 1.5 * v - z
        assert_allclose(found["law.f"], -3 * v - 1.5 * force - x, rtol=1e-14)
        assert_allclose([found["body.x"], found["body.v"]], [v, force], rtol=1e-14)

    def test_of_what_cannot_be_asked_again_it_is_none(self, kit):
        """The slope of a law follows slopes that FMI does not let it take without the mark of refresh."""
        for name, expected in (("Law", 2 * 1.0 + 1.0), ("Closed", np.nan)):
            system = both.of(
                {"s": kit["Sine1"], "law": kit[name], "i": kit["Cubic"]},
                [("s.y", "law.u", "smooth"), ("s.y", "law.w", "smooth"), ("law.y", "i.u", "smooth")],
            )
            voyage = Voyage(system, Explicit(kernel="never"), 1.0, 0.1)
            _, point = voyage.started()
            slope = point.values[voyage.course.layout.derivative_slots[Port("law", "y"), 1]]
            assert_allclose(slope, expected)

    def test_of_an_algebraic_loop_it_is_none(self, kit):
        links = [("l.y", "l.u", "at_point"), ("s.y", "l.w", "smooth"), ("l.y", "i.u", "smooth")]
        system = both.of({"s": kit["Sine1"], "l": kit["Law"], "i": kit["Cubic"]}, links)
        voyage = Voyage(system, Explicit(extrapolation=1, kernel="never"), 1.0, 0.1)
        _, point = voyage.started()
        assert np.isnan(point.values[voyage.course.layout.derivative_slots[Port("l", "y"), 1]])


class TestDifferences:
    def test_they_are_exact_on_a_parabola_after_a_line(self):
        """y = t^2 without slopes into y' = u: Hermite's integral h (a + b) / 2 + h^2 (a' - b') / 12 in every step."""

        class Parabola(Clock):
            def advance(self, t, h, v, slopes):
                v["y"] = (t + h) ** 2

        target = Integrator("i", can_interpolate_inputs=True, max_input_derivative_order=3)
        result = run([Parabola("p"), target], [("p.y", "i.u", "smooth")], stop=1.0)
        h = 0.1
        expected = result.time**3 / 3
        # the first step is the line from 0 to h^2 (h^3 / 2), the second begins with its slope h instead of 2 h
        expected[1:] += h**3 / 2 - h**3 / 3
        expected[2:] += h**2 * (h - 2 * h) / 12
        assert_allclose(result["i.y"], expected, rtol=1e-12)

    def test_with_steps_of_two_lengths(self):
        """The last step is shorter: (1) of slopes.py is still the slope of the parabola through three points."""
        d = Differences(*(np.array([i]) for i in (0, 1, 2)), 3)
        t, h, g = 0.7, 0.04, 0.1
        parabola = np.polynomial.Polynomial([1.3, -2.0, 5.0])
        begun = np.array([parabola(t), 0.0, parabola(t - g), g])
        newest = np.array([parabola(t + h), 0.0, 0.0, 0.0])
        d.take(begun, newest, h)
        assert_allclose(newest[1], parabola.deriv()(t + h), rtol=1e-12)


class TestMean:
    ENDS = Ends(*(np.array([x]) for x in (1.2, -0.4, 3.0, 0.7)))

    def test_mean_and_values_are_those_of_the_cubic(self):
        h = 0.3
        curve = CubicHermiteSpline([0, h], [1.2, -0.4], [3.0, 0.7])
        assert_allclose(curves.mean(self.ENDS, h), quad(curve, 0, h, epsabs=1e-14)[0] / h, rtol=1e-13)
        for s in (0.0, 0.11, h):
            assert_allclose(curves.at(self.ENDS, h, s), [[curve(s)], [curve(s, 1)]], rtol=1e-12)

    def test_a_target_that_cannot_interpolate_is_held_at_it(self):
        """A clock's curve is the line: its mean is its middle; a sine's is what quadrature of the cubic says."""

        class Sine(Clock):
            def advance(self, t, h, v, slopes):
                v["y"] = np.sin(t + h)
                self.now = t + h

            def slope(self, name, order):
                return np.cos(getattr(self, "now", 0.0))

        target = Integrator("i")
        run([Sine("s", max_output_derivative_order=1), target], [("s.y", "i.u", "smooth")], stop=1.0, step=0.2)
        t = np.arange(6) * 0.2
        curve = CubicHermiteSpline(t, np.sin(t), np.cos(t))
        expected = [quad(curve, a, a + 0.2, epsabs=1e-14)[0] / 0.2 for a in t[:-1]]
        assert_allclose(target.inputs_at_steps("u"), expected, rtol=1e-13)


class TestDerivativesAtTheStart:
    def test_are_those_of_the_cubic(self):
        """To the roundings of some ten operations on both sides, each of the largest term, 12 (a - b) / h^3."""
        ends, h = Ends(*np.random.default_rng(3).normal(size=(4, 20))), 0.3
        cubic = CubicHermiteSpline([0, h], [ends.a, ends.b], [ends.da, ends.db])
        largest = np.finfo(float).eps * 12 * np.abs(ends.a - ends.b).max() / h**3
        assert_allclose(curves.second(ends, h), cubic(0, 2), atol=20 * largest * h, rtol=0)
        assert_allclose(curves.third(ends, h), cubic(0, 3), atol=20 * largest, rtol=0)

    def test_have_the_bits_of_numbers_where_the_step_is_an_array_of_no_dimension(self):
        ends, h = Ends(*np.random.default_rng(4).normal(size=(4, 20))), 1.02 - 1.01
        for order in (curves.second, curves.third):
            one_by_one = [order(Ends(*map(float, column)), h) for column in np.transpose(ends)]
            assert order(ends, np.array(h)).tobytes() == order(ends, h).tobytes() == np.array(one_by_one).tobytes()

    def test_a_slope_that_is_not_known_is_that_of_the_line_and_large_ones_are_known(self):
        ends = Ends(*np.array([[0.0] * 4, [2.0] * 4, [1.5e308, 1.5e308, np.nan, 3.0], [1.0, 1.0, 5.0, np.nan]]))
        known = ends.known(0.5)
        assert_array_equal(known.da, [1.5e308, 1.5e308, 4.0, 4.0])
        assert_array_equal(known.db, [1.0, 1.0, 4.0, 4.0])
        large = Ends(*(part[:2] for part in ends))
        for kept, part in zip(large.known(0.5), large, strict=True):
            assert_array_equal(kept, part)


class TestWhatIsNoCurve:
    def test_a_step_mean_stays_held(self):
        target = Integrator("i", can_interpolate_inputs=True, max_input_derivative_order=3)
        result = run([Mean("m"), target], [("m.y", "i.u")], stop=1.0, master=SLOPES)
        assert_allclose(result["i.y"], result.time**2, rtol=1e-12)
        assert target.slopes == {} and target.higher == {}

    @pytest.mark.parametrize("timing", ["smooth", "at_point"])
    def test_a_sampled_source_holds_what_it_showed_at_the_start(self, timing):
        """The stairs of a sampled sum, in the steps between samples too: t_n = n 0.1 is shown from n 0.1 on."""
        file = Path(__file__).parents[1] / "sampled.py"
        system = System(
            name="stairs",
            components={"line": f"{file}:Line", "total": f"{file}:Total", "i": f"{file}:Follower"},
            connections=[Connection("line.y", "total.u", "smooth"), Connection("total.shown", "i.u", timing)],
        )
        experiment = Experiment(stop_time=1.0, communication_step_size=0.05, master=SLOPES)
        result = simulate(system, experiment, locate=Library("native"))
        shown = result["total.shown"]
        assert_allclose(result["i.y"], np.concatenate([[0.0], np.cumsum(0.05 * shown[:-1])]), atol=1e-12)


@pytest.fixture(scope="module")
def kit(tmp_path_factory):
    return slope_fmus.made(tmp_path_factory.mktemp("slopes"))


def net(kit, timing, law="Law", steps=None):
    """Sources that tell derivatives or not, a law, targets of every kind, and a way back into the law."""
    names = {"s0": "Sine0", "s1": "Sine1", "s2": "Sine2", "law": law, "cubic": "Cubic", "line": "Line", "held": "Held"}
    links = [
        ("s1.y", "law.u", timing),
        ("cubic.y", "law.w", "at_point"),
        ("law.y", "line.u", timing),
        ("s2.y", "cubic.u", timing),
        ("s0.y", "held.u", timing),
    ]
    return both.of({name: kit[fmu] for name, fmu in names.items()}, links, steps=steps or {})


RATES = (
    {},
    {"s1": 2, "s2": 2},
    {"law": 2, "line": 4},
    {"cubic": 3, "held": 2},
    {"s0": 4, "s1": 2, "law": 2, "line": 2},
)


class TestBothLoops:
    @pytest.mark.parametrize("steps", RATES, ids=str)
    @pytest.mark.parametrize("timing", ["at_point", "after_step", "midpoint", "ramp", "smooth"])
    def test_timings_and_rates(self, kit, timing, steps):
        for extrapolation in (0, 1, 2):
            both.fly(net(kit, timing, steps=steps), stop=1.25, extrapolation=extrapolation)

    @pytest.mark.parametrize("law", ["Law", "Closed"])
    def test_presets_and_inputs(self, kit, law):
        settings = [
            (preset, inputs, extrapolation)
            for preset, inputs, extrapolation in product(
                ("declared", "jacobi", "gauss_seidel"), ("declared", "held", "ramp", "smooth"), (0, 1, 2)
            )
            if preset != "jacobi" or inputs == "declared"
        ]
        for (preset, inputs, extrapolation), steps in product(settings, ({}, {"s1": 2})):
            system = net(kit, "after_step", law, steps)
            both.fly(system, stop=0.95, preset=preset, inputs=inputs, extrapolation=extrapolation)

    @pytest.mark.parametrize("kernel", both.LOOPS)
    @pytest.mark.parametrize("steps", [{}, {"s1": 2, "law": 4, "line": 4}], ids=str)
    def test_a_saved_point_flies_on_to_the_same_bits(self, kit, kernel, steps):
        """Slopes that are told, differences of the last points, and what was begun of slow steps are in it."""
        voyage = Voyage(net(kit, "smooth", steps=steps), replace(SLOPES, kernel=kernel), 1.3, 0.1)
        for middle in (1, 6):
            straight, parts = resumed(voyage, middle)
            assert straight.tobytes() == parts.tobytes()

    def test_a_slope_that_is_not_finite_ends_the_run_in_both(self, kit, tmp_path):
        """The target refuses it; a slope that is no number is one that is not known."""
        sources = {
            value: build(
                tmp_path, f"Bad{i}", [real("y")], outputs=f"m->slopes_out[0] = {value};", maxOutputDerivativeOrder=1
            )
            for i, value in enumerate(("NAN", "INFINITY"))
        }
        target = build(
            tmp_path, "Strict", [real("u", "input"), real("y")],
            on_set_slopes="if (!isfinite(m->slope[0])) return fmi2Error;",
        )  # fmt: skip
        flown = both.fly(both.of({"s": sources["NAN"], "i": target}, [("s.y", "i.u")]), extrapolation=1)
        assert set(flown["i.y"]) == {0.0}
        failed = both.failure(
            StepFailed, both.of({"s": sources["INFINITY"], "i": target}, [("s.y", "i.u")]), extrapolation=1
        )
        assert "fmi2SetRealInputDerivatives" in str(failed)


class TestTold:
    """A line for each pair of components that gets less than what was asked for by name."""

    def told(self, kit, links, master, **fmus):
        system = both.of({name: kit[fmu] for name, fmu in fmus.items()}, links)
        wiring = wire(system, {name: read_description(kit[fmu]) for name, fmu in fmus.items()})
        return remarks(master.timed(wiring))

    CANNOT = "cannot interpolate its inputs (canInterpolateInputs=false), and is given the"

    @pytest.mark.parametrize(
        ("target", "timing", "words"),
        [
            ("Held", "smooth", f"(smooth): i {CANNOT} mean of the curve, held over each step"),
            ("Held", "ramp", f"(ramp): i {CANNOT} middle of the line, held over each step"),
            (
                "Line",
                "smooth",
                "(smooth): i does not say that it takes input derivatives of order 3, and is given a line",
            ),
        ],
    )
    def test_inputs(self, kit, target, timing, words):
        (line,) = self.told(kit, [("s.y", "i.u", timing)], Explicit(), s="Sine1", i=target)
        assert line == f"s -> i is weaker than asked for {words}"

    def test_extrapolation(self, kit):
        for target, order, words in (
            ("Line", 2, "(extrapolation 2): the two FMUs know derivatives of order 1 only"),
            ("Held", 1, f"(extrapolation 1): i {self.CANNOT} mean of the line, held over each step"),
        ):
            (line,) = self.told(kit, [("s.y", "i.u")], Explicit(extrapolation=order), s="Sine2", i=target)
            assert line == f"s -> i is weaker than asked for {words}"
        assert self.told(kit, [("s.y", "i.u")], Explicit(extrapolation=2), s="Sine2", i="Cubic") == []

    def test_a_slope_that_is_not_true_limits_the_order(self, kit, tmp_path):
        """The law's second derivative would be told, but one of its inputs is held: its slope is by differences."""
        law = build(
            tmp_path, "Second", [real("u", "input"), real("y", depends="u")], outputs="y = u;",
            maxOutputDerivativeOrder=2,
        )  # fmt: skip
        system = both.of(
            {"s": kit["Sine0"], "law": law, "i": kit["Cubic"]},
            [("s.y", "law.u", "after_step"), ("law.y", "i.u")],
        )
        result = both.fly(system, extrapolation=2)
        assert result.info["warnings"] == [
            "law -> i is weaker than asked for (extrapolation 2): the two FMUs know derivatives of order 1 only"
        ]

    def test_in_run_json_and_in_the_log(self, kit, caplog, monkeypatch):
        monkeypatch.setattr("cosim.flight._told", set())  # each line is logged once a process
        result = both.fly(both.of({"s": kit["Sine1"], "i": kit["Held"]}, [("s.y", "i.u", "smooth")]))
        (line,) = result.info["warnings"]
        assert line.startswith("s -> i is weaker than asked for (smooth)") and line in caplog.text

    def test_nobody_is_told_of_what_he_did_not_ask_for(self):
        gain = Gain("g")
        assert run([Clock("c"), gain], [("c.y", "g.u")]).info["warnings"] == []

    def test_jacobi_has_nothing_to_carry(self):
        with pytest.raises(NotSupported, match='preset="jacobi" with inputs="smooth": no source steps first'):
            Explicit("jacobi", inputs="smooth")
