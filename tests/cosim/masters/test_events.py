"""Events: parameters that change in flight, in every master and both loops, against DOP853 leg by leg."""

from dataclasses import replace
from fractions import Fraction
from itertools import pairwise

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.integrate import solve_ivp

from components.actuators.reaction_wheels import ReactionWheels
from components.controllers.pid import PID
from cosim import (
    At,
    Connection,
    ErrorControlled,
    Experiment,
    Explicit,
    Iterated,
    Library,
    System,
    Value,
    prepare,
    simulate,
)
from cosim.errors import EventError, WiringErrors
from cosim.time import Schedule

from .. import both
from ..c_fmu import build, real
from ..oscillator import Damper, Mass, SampledDamper

SYSTEM = System(
    name="oscillator",
    components={"mass": Mass, "damper": Damper},
    connections=[Connection("mass.v", "damper.v", "after_step"), Connection("damper.f", "mass.f")],
)
EVENTS = [
    At(0.77, {"mass.k": 9.0}),
    At(1.0, {"damper.c": 2.0}),
    At(1.0, {"mass.k": 1.0}),
    At(Fraction(4, 3), {"damper.c": 0.1}),
]
LEGS = [(0.0, 4.0, 0.5), (0.77, 9.0, 0.5), (1.0, 1.0, 2.0), (4 / 3, 1.0, 0.1), (2.0, 0.0, 0.0)]
"""Begin, k and c of each part of the flight, in numbers of the test's own."""


def truth():
    z = np.array([1.0, 0.0])
    for (begin, k, c), (end, *_) in pairwise(LEGS):
        leg = solve_ivp(
            lambda t, y, k=k, c=c: [y[1], -k * y[0] - c * y[1]], (begin, end), z, "DOP853", rtol=1e-13, atol=1e-15
        )
        z = leg.y[:, -1]
    return z


def flown(master, events=EVENTS, step=0.1, system=SYSTEM, **more):
    """Fly in both loops; the tables must be equal bit by bit."""
    results = [
        simulate(
            system,
            Experiment(
                stop_time=2.0,
                communication_step_size=step,
                master=replace(master, kernel=loop),
                events=events,
                **more,
            ),
        )
        for loop in both.LOOPS
    ]
    assert [r.info["loop"]["name"] for r in results] == ["kernel", "python"]
    both.assert_same(*results)
    return results[0]


@pytest.mark.parametrize(
    "master, order",
    [
        (Explicit(), 1),
        (Explicit(inputs="smooth", extrapolation=1), 2),
        (Iterated("ramp"), 2),
        (Iterated(tolerance=1e-12), 4),
    ],
)
def test_the_order_stays_across_events(master, order):
    """A slope, prediction or value from before an event, used after it, would cost an order: the error falls as h^p."""
    flights = [flown(master, step=step) for step in (0.05, 0.025, 0.0125)]
    errors = [np.linalg.norm([f["mass.x"][-1], f["mass.v"][-1]] - truth()) for f in flights]
    slopes = np.log2(np.array(errors[:-1]) / errors[1:])
    assert slopes[-1] > order - 0.25, (errors, slopes)


def test_error_controlled_lands_on_them():
    result = flown(ErrorControlled(1e-10))
    assert_allclose([result["mass.x"][-1], result["mass.v"][-1]], truth(), atol=1e-9)
    assert result.info["loop"]["steps"]["accepted"] > 0


@pytest.mark.parametrize("master", [Explicit(), Iterated(), ErrorControlled()])
def test_rows_are_those_of_the_grid_and_of_the_events(master):
    result = flown(master)
    grid = np.arange(21) / 10
    assert_array_equal(result.time, np.sort(np.concatenate([grid, [0.77, 4 / 3]])))


def test_every_nth_row_and_those_of_events():
    """`every` counts the points of the grid, as without events."""
    assert_array_equal(flown(Explicit(), every=7).time, [0.0, 0.7, 0.77, 1.0, 4 / 3, 1.4, 2.0])


def test_the_row_of_an_event_shows_what_holds_from_there_on():
    """a = f - k x follows k directly: at the event it is the new one, and states have not moved."""
    result = flown(Explicit())
    at = result.time == 0.77
    x, f = result["mass.x"][at], result["mass.f"][at]
    assert_allclose(result["mass.a"][at], f - 9.0 * x, rtol=1e-14)
    later = result.time == 1.0
    assert_allclose(result["damper.f"][later], -2.0 * result["mass.v"][later], rtol=1e-14)
    assert_array_equal(result["mass.f"][later], result["damper.f"][later])  # and so does the input that follows it


def test_an_event_at_the_start_is_a_start_with_other_parameters():
    changed = flown(Explicit(), [At(0.0, {"mass.k": 9.0})])
    begun = flown(Explicit(), [], system=replace(SYSTEM, parameters={"mass.k": 9.0}))
    for name in ("mass.x", "mass.a", "damper.f"):
        assert_array_equal(changed[name], begun[name])


def test_units_and_run_json():
    result = flown(Explicit(), [At(0.5, {"*.k": Value(2.0, "1/s2")})])
    assert result.info["events"] == [{"time": 0.5, "values": {"mass.k": {"value": 2.0, "unit": "1/s2"}}}]
    assert flown(Explicit(), []).info["events"] == []


def test_samples_come_as_without_the_event():
    """A sampled component between whose samples a step is divided: no sample more, none less."""
    parts = {"mass": Mass, "damper": SampledDamper}
    system = replace(SYSTEM, components=parts, parameters={**SYSTEM.parameters, "mass.solver.step": 1e-3})
    plain = flown(Explicit(), [], system=system)
    changed = flown(Explicit(), [At(0.345, {"mass.k": 4.0})], system=system)
    grid = changed.time != 0.345
    assert_array_equal(changed.time[grid], plain.time)
    assert_array_equal(changed["damper.n"][grid], plain["damper.n"])
    assert_allclose(changed["damper.f"][grid], plain["damper.f"], atol=1e-9)  # RK4 in two parts of a step: h^5
    at = changed["damper.f"][~grid]
    assert_array_equal(at, changed["damper.f"][changed.time == 0.3])
    later = flown(Explicit(), [At(0.345, {"damper.c": 5.0})], system=system)
    v, f = later["mass.v"], later["damper.f"]
    assert_array_equal(f[later.time == 0.345], f[later.time == 0.3])  # held: the gain counts from the next sample on
    assert_allclose(f[later.time == 0.4], -5.0 * v[later.time == 0.4], rtol=1e-14)


@pytest.mark.parametrize("backend", ["native", "python"])
class TestUnits:
    """What a unit makes of a parameter that is set in flight."""

    def fly(self, backend, *events):
        experiment = Experiment(stop_time=2.0, communication_step_size=0.1, events=events)
        return simulate(SYSTEM, experiment, locate=Library(backend))

    def test_both_back_ends_calculate_anew(self, backend):
        """The stiffness acts by a calculated parameter."""
        result = self.fly(backend, *EVENTS)
        assert_allclose(result["mass.x"], flown(Explicit())["mass.x"], rtol=1e-12)

    def test_a_condition_of_parameters_is_asked_for_again(self, backend):
        with pytest.raises(EventError) as caught:
            self.fly(backend, At(0.77, {"mass.k": -1.0}))
        assert "event at 0.77 s: mass.k = -1.0 was refused: mass: fmi2SetReal returned fmi2" in str(caught.value)
        assert "k = -1 1/s2: it must be positive." in str(caught.value)
        result = caught.value.result
        assert result.time[-1] == 0.77 and result.info["status"] == "failed"
        assert result.info["failure"]["component"] == "mass"

    def test_a_condition_of_the_start_is_not(self, backend):
        """x is near 0 at the time of the event."""
        x = flown(Explicit(), [])["mass.x"]
        at = 0.1 * int(np.flatnonzero(np.diff(np.sign(x)))[0])
        crossing = at + 0.1 * x[round(10 * at)] / (x[round(10 * at)] - x[round(10 * at) + 1])
        result = self.fly(backend, At(round(crossing, 4), {"mass.k": 5.0}))
        assert abs(result["mass.x"][result.time == round(crossing, 4)][0]) < 1e-2
        assert result.info["status"] == "finished"


def test_parameters_of_a_controller_are_tunable_but_for_the_vehicle_s():
    """The rule of the framework, on a law of a paper: gains may change, the inertia may not."""
    tunable = {v.name: v.tunable for v in PID().parameters}
    assert tunable["K_p"] and tunable["K_d"] and tunable["solver.step"] and not tunable["torque_limit"]
    wheels = {v.name: v.tunable for v in ReactionWheels().parameters}
    assert wheels["health"] and not wheels["spin_axes_B"]


def test_prepared_flights_begin_anew():
    """A tuned instance is reset: the next flight knows nothing of it."""
    experiment = Experiment(stop_time=2.0, communication_step_size=0.1)
    with prepare(SYSTEM) as prepared:
        before = prepared.fly(experiment)
        changed = prepared.fly(replace(experiment, events=EVENTS))
        after = prepared.fly(experiment)
    assert_array_equal(before["mass.x"], after["mass.x"])
    assert abs(changed["mass.x"][-1] - before["mass.x"][-1]) > 0.1


def test_slower_components_change_where_their_steps_end():
    system = replace(SYSTEM, steps={"damper": 2})
    result = flown(Explicit(preset="jacobi"), [At(0.4, {"damper.c": 2.0})], system=system)
    at = result.time == 0.4
    assert_allclose(result["damper.f"][at], -2.0 * result["mass.v"][at], rtol=1e-14)


def refused(system=SYSTEM, *events, **more):
    with pytest.raises(WiringErrors) as caught:
        simulate(system, Experiment(stop_time=2.0, communication_step_size=0.1, events=events, **more))
    return str(caught.value)


FIXED = "mass.mass is a fixed parameter, which cannot change after the start. Tunable in mass: k, solver.step."


@pytest.mark.parametrize(
    "event, message",
    [
        (At(0.5, {"mass.mass": 2.0}), f"event at 0.5 s: {FIXED}"),
        (At(0.5, {"mass.x": 2.0}), "event at 0.5 s: mass.x is an initial state, which cannot change after the start."),
        (At(0.5, {"mass.f": 2.0}), "event at 0.5 s: parameter mass.f: it is an input: hold it"),
        (At(0.5, {"mass.kk": 2.0}), 'event at 0.5 s: unknown parameter "kk" in component "mass"'),
        (At(0.5, {"mas.k": 2.0}), 'event at 0.5 s: unknown component "mas"'),
        (
            At(0.5, {"mass.k": [1.0, 2.0]}),
            "event at 0.5 s: parameter mass.k: it is a scalar, the value is a vector of 2",
        ),
        (At(0.5, {"mass.k": Value(1.0, "kg")}), "it has unit 1/s2, the value has unit kg"),
        (At(0.5, {}), "event at 0.5 s: it changes nothing"),
    ],
)
def test_what_is_refused(event, message):
    assert message in refused(SYSTEM, event)


def test_two_values_at_one_time():
    events = At(0.5, {"mass.k": 2.0}), At(Fraction(1, 2), {"mass.k": 3.0})
    assert "event at 0.5 s: mass.k is set twice, to 2.0 and to 3.0. Leave one" in refused(SYSTEM, *events)


@pytest.mark.parametrize("time", [-1.0, 2.0, 3.0])
def test_outside_the_run(time):
    with pytest.raises(Exception, match=r"the time of an event is .* it must be from start_time, 0 s, on and before"):
        simulate(SYSTEM, Experiment(stop_time=2.0, communication_step_size=0.1, events=[At(time, {"mass.k": 1.0})]))


def test_within_a_step_of_a_slower_component():
    slow = replace(SYSTEM, steps={"damper": 2})
    told = refused(slow, At(0.5, {"damper.c": 1.0}))
    assert "damper is within a step of its own then, from 0.4 s to 0.6 s. Choose 0.4 s or 0.6 s." in told
    told = refused(slow, At(0.55, {"mass.k": 1.0}))
    assert "it lies between the communication points 0.5 s and 0.6 s, and damper takes 2 of these steps in one" in told


def test_an_fmu_with_a_constant_step(tmp_path):
    """It flies with events on the grid, and is refused by name with one between."""
    fmu = build(
        tmp_path,
        "Constant",
        [real("k", "tunable", start=1.0), real("y")],
        outputs="y = k;",
        canHandleVariableCommunicationStepSize=False,
    )
    system = System(name="s", components={"a": str(fmu)})
    told = refused(system, At(0.55, {"a.k": 2.0}))
    assert "and a needs a constant step (canHandleVariableCommunicationStepSize=false). Choose 0.5 s or 0.6 s." in told
    result = flown(Explicit(), [At(0.5, {"a.k": 2.0})], system=system)
    assert_array_equal(result["a.y"], np.where(result.time < 0.49, 1.0, 2.0))


class TestSchedule:
    """Points, rows and events by a plain list of times."""

    @pytest.mark.parametrize("events", [[], [0.25], [0.0, 0.25, 0.27, 0.3, 0.95], [1.02, 1.0]])
    @pytest.mark.parametrize("every", [1, 3, 100])
    def test_against_a_list(self, events, every):
        schedule = Schedule.of(0.0, 1.05, 0.1, every, events)
        grid = [k / 10 for k in range(11)] + [1.05]
        times = sorted({*grid, *events})
        assert [schedule.time(k) for k in range(schedule.steps + 1)] == times
        assert [times[k] for k in schedule.event_points] == sorted(events)
        rows = {*grid[:-1:every], *events, 1.05}
        assert [t for k, t in enumerate(times) if schedule.recorded(k)] == sorted(rows)

    def test_in_finer_steps_they_are_points_like_others(self):
        fine = Schedule.of(0.0, 1.0, 0.1, 2, [0.25]).divided(4)
        assert fine.dividing == () and [fine.time(k) for k in fine.event_points] == [0.25]
        assert [fine.time(k) for k in range(fine.steps + 1) if fine.recorded(k)] == [0, 0.2, 0.25, 0.4, 0.6, 0.8, 1.0]


def test_a_sample_that_is_due_at_the_event_follows_it():
    """A system without parameters, too: the law of a sample at the event's time has the new gain."""
    parts = {"mass": Mass, "damper": SampledDamper}
    links = [Connection("mass.v", "damper.v", "after_step"), Connection("damper.f", "mass.f")]
    system = System(name="sampled", components=parts, connections=links)
    flown = simulate(system, both.experiment(stop=0.5, events=[At(0.3, {"damper.c": 0.9})]))
    at = flown.time >= 0.3
    assert_allclose(flown["damper.f"][at], -0.9 * flown["mass.v"][at], rtol=1e-15)
    assert_allclose(flown["damper.f"][~at], -0.5 * flown["mass.v"][~at], rtol=1e-15)
