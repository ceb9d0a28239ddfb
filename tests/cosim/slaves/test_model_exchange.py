"""FMUs for model exchange alone: what CVode and the events make of them, against closed forms."""

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose

from cosim import Connection, Experiment, System, prepare, simulate
from cosim.errors import NotSupported, StepFailed
from cosim.masters.iterated import Iterated

from .. import ball_fmu, c_fmu

G, KEPT = 9.81, 0.7
STEPS = Experiment(stop_time=2.0, communication_step_size=0.1)


@pytest.fixture(scope="module")
def ball(tmp_path_factory):
    return ball_fmu.build(tmp_path_factory.mktemp("ball"))


def alone(path, **more):
    return System(name="s", components={"a": str(path)}, hold_unconnected=True, **more)


def bounced(t):
    """Height and number of bounces of a ball dropped from 1 m, flight by flight."""
    begin, speed, height = 0.0, 0.0, 1.0
    for n in range(100):
        lands = begin + (speed + math.sqrt(speed**2 + 2 * G * height)) / G
        if t < lands:
            since = t - begin
            return height + speed * since - 0.5 * G * since**2, n
        speed, begin, height = KEPT * (G * (lands - begin) - speed), lands, 0.0
    raise AssertionError("it bounces too often")


def test_a_ball_bounces_at_its_times(ball):
    result = simulate(alone(ball), STEPS)
    heights, bounces = zip(*map(bounced, result.time.tolist()), strict=True)
    # CVode keeps 1e-9 of a nominal of 1 m and 2 m/s a step; some hundred steps, and a bounce makes 1/KEPT of an error
    assert_allclose(result["a.height"], heights, atol=1e-6)
    assert result["a.bounces"].tolist() == list(bounces)
    assert (result.info["loop"]["name"], result.info["loop"]["reason"]) == ("python", "a has no interface in C")


def test_events_in_time_and_discrete_inputs(ball, tmp_path):
    """`ticks` counts multiples of 0.35 s; `seen` shows the input of the step before, for event mode has seen it."""
    counter = c_fmu.build(
        tmp_path, "Counter", [c_fmu.integer("n")], outputs="n = (int)m->whole[0];", step="m->whole[0]++;"
    )
    system = System(
        name="s",
        components={"c": str(counter), "a": str(ball)},
        connections=[Connection("c.n", "a.shown")],
        hold_unconnected=True,
    )
    result = simulate(system, STEPS)
    assert result["a.ticks"].tolist() == [math.floor(t / 0.35 + 1e-9) for t in result.time.tolist()]
    assert result["a.seen"].tolist() == [0, *range(20)]


def test_inputs_are_held_over_a_step(ball, tmp_path):
    """push = 9.81 + a step function of the step's number n: speed grows by 0.1 n in step n, the ball goes up only."""
    push = c_fmu.build(
        tmp_path, "Push", [c_fmu.real("y")], outputs="y = 9.81 + (double)m->whole[0];", step="m->whole[0]++;"
    )
    system = System(
        name="s",
        components={"p": str(push), "a": str(ball)},
        connections=[Connection("p.y", "a.push")],
        hold_unconnected=True,
    )
    result = simulate(system, STEPS)
    assert_allclose(result["a.speed"], 0.1 * np.concatenate([[0], np.cumsum(np.arange(20))]), atol=1e-7)


def test_the_steps_of_a_run_do_not_matter(ball):
    fine = simulate(alone(ball), Experiment(stop_time=2.0, communication_step_size=0.01, every=10))
    coarse = simulate(alone(ball), STEPS)
    assert_allclose(fine["a.height"], coarse["a.height"], atol=1e-6)


def test_it_flies_again(ball):
    with prepare(alone(ball, parameters={"a.height": 1.5})) as prepared:
        first, second = prepared.fly(STEPS), prepared.fly(STEPS)
    assert first["a.height"][0] == 1.5
    assert first.table.equals(second.table)


def test_it_may_ask_for_the_end(ball):
    result = simulate(alone(ball, parameters={"a.end": 0.9}), STEPS)
    assert (result.info["status"], result.info["event"]["variable"]) == ("finished", "a")
    # the first event after 0.9 s is that in time at 1.05 s, or a bounce before it
    assert result.time[-1] == pytest.approx(math.floor(10 * min(1.05, next_bounce(0.9))) / 10)


def test_it_may_ask_for_the_end_after_a_step_of_the_integrator(ball):
    """The ball falls until 0.45 s: nothing but fmi2CompletedIntegratorStep stops it between 0.42 s and 0.5 s."""
    result = simulate(alone(ball, parameters={"a.halts": 0.42}), STEPS)
    assert (result.info["status"], result.info["event"]["variable"]) == ("finished", "a")
    assert 0.3 < result.time[-1] < 0.55


def next_bounce(t):
    n = bounced(t)[1]
    return next(x for x in np.arange(t, 3, 1e-4) if bounced(x)[1] > n)


def test_derivatives_that_fail_are_told(ball):
    with pytest.raises(StepFailed) as caught:
        simulate(alone(ball, parameters={"a.refuses": 0.55}), STEPS)
    told = str(caught.value)
    assert told.startswith("a returned fmi2Error from fmi2GetDerivatives at communication point 0.")
    assert "no derivative after 0.55 s" in told
    assert 0.4 <= caught.value.result.time[-1] <= 0.5


def test_masters_that_repeat_steps_refuse_it(ball):
    system = System(
        name="s",
        components={"a": str(ball), "b": str(ball)},
        connections=[Connection("a.height", "b.push", "ramp"), Connection("b.height", "a.push", "ramp")],
        hold_unconnected=True,
    )
    with pytest.raises(NotSupported, match="a cannot save its state"):
        simulate(system, Experiment(stop_time=1.0, communication_step_size=0.1, master=Iterated()))
