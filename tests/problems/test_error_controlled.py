"""Error-controlled steps on problems with exact solutions: what is estimated is what is wrong."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.integrate import solve_ivp
from scipy.linalg import expm

from cosim import prepare
from cosim.masters.error_controlled import ErrorControlled
from cosim.masters.iterated import Iterated
from cosim.masters.point import Point
from cosim.masters.watch import Block, Watch
from fmus.export.build import build

from ..cosim import both
from . import quarter_car, two_mass
from .test_two_mass import FAST, START, A


def fmus(folder, components, backend):
    return {name: build(c, folder / f"{name}.fmu", backend) for name, c in components.items()}


@pytest.fixture(scope="module", params=["native", "python"])
def masses(request, tmp_path_factory):
    components = {"one": two_mass.MassAndSpring(), "two": two_mass.Mass()}
    made = fmus(tmp_path_factory.mktemp("masses"), components, request.param)
    with prepare(both.of(made, [("two.x_2", "one.x_2"), ("one.f", "two.f")])) as ready:
        yield ready


@pytest.fixture(scope="module", params=["native", "python"])
def car(request, tmp_path_factory):
    components = {"chassis": quarter_car.Chassis(), "wheel": quarter_car.Wheel()}
    made = fmus(tmp_path_factory.mktemp("car"), components, request.param)
    with prepare(both.of(made, [("wheel.v_w", "chassis.v_w"), ("chassis.F", "wheel.F")])) as ready:
        yield ready


def interpolates(prepared) -> bool:
    return all(d.can_interpolate_inputs for d in prepared.wiring.descriptions.values())


def one_step(prepared, master, h, parameters):
    """The outcome of one step of length h from a start."""
    setup = replace(both.experiment(stop=h, step=h), master=master)
    plan = prepared._plan(setup, parameters, ("*",))
    with prepared._crew() as crew:
        point = plan.initialization.start(crew, 0.0, None, None)
        algorithm, _ = plan.course.algorithm(crew, None)
        outcome = algorithm.advance(point, plan.course.schedule.steps)
        outcome.settle(True)
    return outcome


def ratio(prepared, h, start, truth, inside):
    """Estimated over true error of one step, of the output that decides: true is that of the solution compared with.

    That is the ramp's where FMUs take curves; else the one in a whole step, of which the estimate is a third.
    """
    start = start | {f"{name}.solver.step": inside for name in prepared.wiring.components}
    deviation = one_step(prepared, ErrorControlled(relative=1e-9, kernel="never"), h, start).deviation
    inputs, part = ("ramp", 1) if interpolates(prepared) else ("smooth", 3)
    setup = replace(both.experiment(stop=h, step=h), master=Iterated(inputs, 1e-13, kernel="never"))
    found = prepared.fly(setup, parameters=start)[deviation.variable][-1]
    return part * deviation.error / abs(found - truth[deviation.variable])


class TestEstimate:
    @pytest.mark.parametrize("phase", range(6))
    def test_two_masses(self, masses, phase):
        """From states along the flight; the terms that the estimate leaves out are FAST h of it, and more.

        Of the outputs the one decides that is furthest off, so that no true error that passes zero is met.
        """
        h = 2e-3
        x_1, v_1, x_2, v_2 = state = expm(A * 0.07 * phase) @ START
        end = expm(A * h) @ state
        start = {"one.x_1": x_1, "one.v_1": v_1, "two.x_2": x_2, "two.v_2": v_2}
        truth = {"one.f": 100 * (end[0] - end[2]), "two.x_2": end[2]}
        found = ratio(masses, h, start, truth, inside=1e-4)
        if interpolates(masses):
            assert_allclose(found, 1.0, atol=FAST * h)
        assert 1 / 3 < found < 3

    @pytest.mark.parametrize("v_d", [quarter_car.LINEAR, 6.0], ids=["linear", "cubic"])
    @pytest.mark.parametrize("phase", range(1, 6))
    def test_quarter_car(self, car, v_d, phase):
        h = 1e-3

        def rates(_, x):
            s, v_c, z_w, v_w = x
            force = 15e3 * s + 1e3 * (v_c - v_w) * (1 + (v_c - v_w) ** 2 / v_d**2)
            return [v_c - v_w, -force / 400.0, v_w, (force - 150e3 * (z_w - 0.1)) / 40.0]

        def after(x, t):
            return solve_ivp(rates, (0, t), x, "DOP853", rtol=1e-13, atol=1e-16).y[:, -1]

        state = after(np.zeros(4), 0.013 * phase)
        s, v_c, _, v_w = after(state, h)
        names = ("chassis.s", "chassis.v_c", "wheel.z_w", "wheel.v_w")
        start = dict(zip(names, state, strict=True)) | {"chassis.v_d": v_d}
        force = 15e3 * s + 1e3 * (v_c - v_w) * (1 + (v_c - v_w) ** 2 / v_d**2)
        assert 1 / 3 < ratio(car, h, start, {"chassis.F": force, "wheel.v_w": v_w}, inside=1e-4) < 3


def error(prepared, tolerance, **more):
    """The largest error of x_1 at the rows over .5 s, of its largest; and the run."""
    setup = both.experiment(stop=0.5, step=0.05)
    master = ErrorControlled(relative=tolerance, **more)
    inside = 2e-5 if interpolates(prepared) else 1e-3
    parameters = {"one.solver.step": inside, "two.solver.step": inside}
    run = prepared.fly(replace(setup, master=master), parameters=parameters)
    exact = np.array([expm(A * t) @ START for t in run.time])[:, 0]
    return np.abs(run["one.x_1"] - exact).max() / np.abs(exact).max(), run


def test_the_error_follows_the_tolerance(masses):
    """Curves: the step's length goes as the tolerance to 1/4, for a ramp of a force errs by h^4 in a position, and the
    cubic, which is flown, errs by h^4 over the flight: the error goes as the tolerance.

    Held means: they err by h^3 in a position in a step, by h^2 over the flight, as the tolerance to 2/3.

    PI control aims at some part of what is allowed, a fifth to all of it by what the problem does: 5^(4/4), or 5^(2/3)
    between the two ends. At the coarsest tolerance FAST h is .5: as much again as exp(.5).
    """
    smooth = interpolates(masses)
    tolerances = (1e-4, 1e-9) if smooth else (1e-4, 1e-6)
    coarse, fine = (error(masses, tolerance)[0] for tolerance in tolerances)
    decades = np.log(tolerances[0] / tolerances[1])
    assert_allclose(np.log(coarse / fine) / decades, 1 if smooth else 2 / 3, atol=(np.log(5) + 0.5) / decades)
    assert coarse < tolerances[0] * 0.5 / 6e-3  # of each step no more than is allowed, the shortest is 6 ms


def test_rows_come_at_the_points_of_the_experiment(masses):
    _, run = error(masses, 1e-4)
    assert_array_equal(run.time, [k / 20 for k in range(11)])
    steps = run.info["loop"]["steps"]
    assert run.info["communication_step_size"] == 0.05
    assert steps["accepted"] > 10 and 0 < steps["smallest"] <= steps["largest"] <= 0.05


def test_a_tolerance_of_its_own_rules_an_output(masses):
    """A thousandth of the error allowed in the force, to the power of 2/3 to 1 of it, and what PI control adds."""
    loose, run = error(masses, 1e-3)
    strict, more = error(masses, 1e-3, tolerances={"one.f": 1e-6})
    assert strict < 1e-3 ** (2 / 3) * 5 ** (2 / 3) * np.exp(0.5) * loose
    assert more.info["loop"]["steps"]["accepted"] > 3 * run.info["loop"]["steps"]["accepted"]


def test_the_kernel_gives_the_same_bits(masses):
    runs = [error(masses, 1e-4, kernel=kernel)[1] for kernel in both.LOOPS]
    assert [run.info["loop"]["name"] for run in runs] == ["kernel", "python"]
    both.assert_same(*runs)
    assert runs[0].info["loop"]["steps"] == runs[1].info["loop"]["steps"]
    assert runs[0].info["loop"]["evaluations"] == runs[1].info["loop"]["evaluations"]


class Steps:
    """Steps of the oscillator one by one; the first is far too long, so that it is rejected some times."""

    def __init__(self, prepared):
        master = ErrorControlled(relative=1e-5)
        setup = replace(both.experiment(stop=0.4, step=0.2), master=master)
        self.prepared, self.plan = prepared, prepared._plan(setup, None, ("*",))
        self.course = self.plan.course

    def fly(self, crew, point, until):
        """Fly as every run does, until a step ends at `until` points; return the point, the steps' ends, the tale."""
        algorithm, control = self.algorithm(crew), self.course.control()
        ends = []
        while point.index < until:
            outcome = algorithm.advance(point, control.until(point, self.course.schedule.steps, far=False))
            counts = control.accepts(outcome)
            outcome.settle(counts)
            if counts:
                point = outcome.point
                ends.append(point.index)
        return point, ends, control.told()["steps"]

    def algorithm(self, crew):
        layout = self.course.layout
        return self.course.algorithm(crew, Watch(layout, self.course.schedule, Block(2, len(layout.columns.names))))[0]

    def start(self, crew):
        return self.plan.initialization.start(crew, 0.0, None, None)


def same(a, b) -> bool:
    arrays = ("values", "newest", "memory")
    return a.states == b.states and all(getattr(a, n).tobytes() == getattr(b, n).tobytes() for n in arrays)


@pytest.fixture
def flown(masses):
    """Steps, and where they lead."""
    steps = Steps(masses)
    with masses._crew() as crew:
        point, ends, told = steps.fly(crew, steps.start(crew), steps.course.schedule.steps)
        return steps, point.with_states(crew), ends, told


def test_steps_that_were_rejected_leave_no_trace(masses, flown):
    """Who takes at once the steps that counted comes to the same bits, in the FMUs too."""
    steps, end, ends, told = flown
    assert told["rejected"] > 0
    with masses._crew() as crew:
        algorithm, point = steps.algorithm(crew), steps.start(crew)
        for until in ends:
            outcome = algorithm.advance(point, until)
            outcome.settle(True)
            point = outcome.point
        assert same(point.with_states(crew), end)


def test_a_point_that_was_saved_goes_on_to_the_same_bits(masses, flown):
    """Step control, Jacobians and guesses are in the point: other instances, another control take it up."""
    steps, end, ends, _ = flown
    with masses._crew() as crew:
        middle, before, _ = steps.fly(crew, steps.start(crew), ends[len(ends) // 2])
        sent = middle.with_states(crew).to_bytes()
    with masses._crew() as crew:
        point = Point.from_bytes(sent)
        steps.start(crew)
        point.restore(crew)
        point, after, _ = steps.fly(crew, point, steps.course.schedule.steps)
        assert same(point.with_states(crew), end) and before + after == ends
