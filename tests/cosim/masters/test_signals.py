"""Signals that feed inputs, in every master and both loops: the same bits, and what the signal itself would do.

A free body is the judge: its rate is the integral of the force and its position the integral of that, of a piecewise
polynomial both in closed form (scipy's PPoly), whatever lies within a communication step.
"""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline, PPoly

from cosim import Connection, ErrorControlled, Experiment, Explicit, Iterated, Signal, System, prepare, simulate
from cosim.errors import WiringErrors
from cosim.masters.point import Point
from cosim.slaves.tabulated import Tabulated
from cosim.system import feeds
from cosim.system.expand import wire
from cosim.time import Schedule

from .. import both
from ..fakes import Integrator, describe
from ..free_body import FreeBody, Spring

MASTERS = {
    "explicit": Explicit(),
    "with slopes": Explicit(inputs="smooth", extrapolation=1),
    "jacobi": Explicit(preset="jacobi"),
    "iterated": Iterated(),
    "iterated ramp": Iterated("ramp"),
    "error-controlled": ErrorControlled(),
}


def noise(interpolation, n=30, seed=1, stop=2.0):
    """Samples at uneven times, several in some steps of 0.1 s and none in others."""
    rng = np.random.default_rng(seed)
    t = np.concatenate([[0.0], np.sort(rng.uniform(0.01, stop - 0.01, n)), [stop]])
    return Signal((t, rng.normal(size=n + 2)), unit="N", interpolation=interpolation)


def exact(signal) -> PPoly:
    """The signal as scipy has it, from its samples alone."""
    t, y = signal.time, signal.values[:, 0]
    if signal.interpolation == "cubic":
        return CubicSpline(t, y)
    if signal.interpolation == "linear":
        return PPoly(np.array([np.diff(y) / np.diff(t), y[:-1]]), t)
    return PPoly(y[None, :-1], t)


def body(signal, **more):
    more.setdefault("parameters", {"body.solver.step": 1e-3})  # else a free body takes a communication step whole
    return System(name="body", components={"body": FreeBody}, inputs={"body.f": signal}, **more)


def flown(system, master, stop=2.0, step=0.1, **more):
    """Fly in both loops; the tables must be equal bit by bit."""
    kernel, python = (
        simulate(
            system,
            Experiment(stop_time=stop, communication_step_size=step, master=replace(master, kernel=loop), **more),
        )
        for loop in both.LOOPS
    )
    assert (kernel.info["loop"]["name"], python.info["loop"]["name"]) == ("kernel", "python")
    both.assert_same(kernel, python)
    return kernel


@pytest.mark.parametrize("interpolation", ["linear", "cubic"])
@pytest.mark.parametrize("master", MASTERS.values(), ids=MASTERS)
def test_a_free_body_is_where_the_signal_takes_it(master, interpolation):
    """Impulse and first moment are exact: the rate to rounding, the position to the RK4 step inside the FMU.

    x is of degree 5 in a cubic force, RK4 is exact to degree 4 of it: what is left of h^5 x^(5) / 120, with the largest
    fifth derivative, v''' / m, below 1e7 for noise in steps of 1e-2 s, and h its internal step of 1e-3 s, is 1e-10.
    """
    signal = noise(interpolation)
    result = flown(body(signal), master)
    u = exact(signal)
    assert_allclose(result["body.v"], u.antiderivative()(result.time) / 2, atol=1e-14)
    assert_allclose(result["body.x"], u.antiderivative(2)(result.time) / 2, atol=1e-10)


@pytest.mark.parametrize("interpolation", ["linear", "previous", "cubic"])
@pytest.mark.parametrize("master", MASTERS.values(), ids=MASTERS)
def test_rows_show_the_signal_of_that_instant(master, interpolation):
    """The input itself, and what follows it directly: a step ends at the value that it has there, not at a mean."""
    signal = noise(interpolation)
    result = flown(body(signal), master)
    u = exact(signal)(result.time)
    if interpolation == "previous":
        u[-1] = signal.values[-1, 0]  # PPoly goes on with the piece before
    assert_allclose(result["body.f"], u, atol=1e-13)
    assert_allclose(result["body.a"], u / 2, atol=1e-12)


def test_a_step_within_a_step_is_its_mean():
    """previous: the impulse is exact, so that the rate is; the position is off by what the mean does before a jump."""
    signal = Signal(([0.0, 0.43, 2.0], [0.0, 2.0, 2.0]), interpolation="previous")
    result = flown(body(signal), Explicit())
    t = result.time
    assert_allclose(result["body.v"], np.maximum(t - 0.43, 0), atol=1e-15)
    after = t > 0.45
    late = 0.5 * 0.07**2 - 0.5 * 0.07 * 0.1  # the mean, 0.7, acts over the whole step
    assert_allclose(result["body.x"][after], 0.5 * (t[after] - 0.43) ** 2 - late, atol=1e-13)


def test_a_step_at_a_point_acts_from_there():
    """0.1 + 0.2 is the point 0.3: nothing of the jump comes before."""
    signal = Signal(([0.0, 0.1 + 0.2, 2.0], [0.0, 2.0, 2.0]), interpolation="previous")
    result = flown(body(signal), Explicit())
    assert_allclose(result["body.x"], 0.5 * np.maximum(result.time - 0.3, 0) ** 2, atol=1e-13)
    assert_array_equal(result["body.f"], np.where(result.time < 0.29, 0.0, 2.0))


@pytest.mark.parametrize("master, order", [(Explicit(), 1), (Iterated("ramp"), 2), (Iterated(tolerance=1e-12), 4)])
def test_the_order_of_the_exchange_stays(master, order):
    """An oscillator fed by a smooth signal, over two FMUs, against DOP853: knots at 30 ms, steps of 100 to 25 ms."""
    signal = Signal.of(lambda t: np.sin(3 * t), step=0.03, stop=2.0, unit="N", interpolation="cubic")
    system = System(
        name="oscillator",
        components={"body": FreeBody, "spring": Spring},
        connections=[Connection("body.x", "spring.x", "after_step"), Connection("spring.f", "body.f")],
        inputs={"spring.f_0": signal},
    )
    u = exact(signal)
    truth = solve_ivp(
        lambda t, z: [z[1], (u(t) - 4 * z[0]) / 2], (0, 2), [0, 0], "DOP853", rtol=1e-12, atol=1e-14, max_step=0.03
    )
    errors = []
    for step in (0.1, 0.05, 0.025):
        result = flown(system, master, step=step)
        errors.append(abs(result["body.x"][-1] - truth.y[0, -1]))
    slopes = np.log2(np.array(errors[:-1]) / errors[1:])
    assert slopes[-1] > order - 0.2, (errors, slopes)


def test_units_are_converted_at_wiring():
    signal = Signal(([0.0, 2.0], [1.0, 1.0]), unit="N")
    with pytest.raises(WiringErrors, match=r"signal of arrays: it feeds body.f: it has unit N, the value has unit kg"):
        simulate(body(Signal(([0, 2], [1, 1]), unit="kg")), Experiment(stop_time=2.0, communication_step_size=0.1))
    description = describe(inputs=["tau[1]", "tau[2]"], units={"tau": "N.m"})
    vector = Signal(([0.0, 1.0], [[1.0, 2.0]] * 2), unit="mN.m")
    wiring = wire(System(name="s", components={"a": "a.fmu"}, inputs={"a.tau": vector}), {"a": description})
    assert [link.conversion.factor for link in wiring.links] == [1e-3, 1e-3]
    assert flown(body(signal), Explicit()).info["inputs"]["body.f"]["unit"] == "N"


def test_an_fmu_without_interpolation_is_held_at_the_mean_and_one_of_order_one_at_the_line():
    """Fakes: i' = u. The line has the mean and the first moment, of which an integrator needs the first alone."""
    signal = noise("linear")
    u = exact(signal).antiderivative()
    for can in (False, True):
        slave = Integrator("i", can_interpolate_inputs=can)
        system = System(name="s", components={"i": "fake"}, inputs={"i.u": signal})
        master = Explicit(kernel="never")
        result = simulate(
            system, Experiment(stop_time=2.0, communication_step_size=0.1, master=master), slaves={"i": slave}
        )
        assert_allclose(result["i.y"], u(result.time), atol=1e-14)
        means = np.diff(u(result.time)) / 0.1
        assert np.allclose(slave.inputs_at_steps("u"), means) != can


def test_slower_components_take_the_signal_over_their_own_steps():
    signal = noise("linear")
    result = flown(body(signal, steps={"body": 4}), Explicit())
    u, points = exact(signal), slice(None, None, 4)
    assert_allclose(result["body.v"][points], u.antiderivative()(result.time[points]) / 2, atol=1e-14)


def test_one_element_is_fed_and_the_rest_held():
    component = describe(inputs=["tau[1]", "tau[2]", "tau[3]"])
    system = System(
        name="s", components={"a": "a.fmu"}, held={"a.tau": 0.0}, inputs={"a.tau[2]": Signal(([0, 1], [1, 2]))}
    )
    wiring = wire(system, {"a": component})
    assert [str(port) for port in wiring.held] == ["a.tau[1]", "a.tau[3]"]
    assert [str(link.target) for link in wiring.links] == ["a.tau[2]"]


class TestPrepared:
    def test_another_signal_for_each_flight(self):
        constant = [Signal(([0, 1], [c, c])) for c in (1.0, 3.0)]
        experiment = Experiment(stop_time=1.0, communication_step_size=0.1)
        with prepare(body(constant[0])) as prepared:
            for signal, rate in [(constant[1], 1.5), (None, 0.5), (constant[0], 0.5)]:
                result = prepared.fly(experiment, inputs=None if signal is None else {"body.f": signal})
                assert_allclose(result["body.v"][-1], rate, rtol=1e-14)

    def test_in_place_of_a_held_input_and_of_a_connection(self):
        system = System(
            name="s",
            components={"body": FreeBody, "spring": Spring},
            connections=[Connection("body.x", "spring.x", "after_step"), Connection("spring.f", "body.f")],
            held={"spring.f_0": 1.0},
        )
        experiment = Experiment(stop_time=1.0, communication_step_size=0.1)
        one = Signal(([0, 1], [2, 2]))
        with prepare(system) as prepared:
            free = prepared.fly(experiment, inputs={"body.f": one})
            pushed = prepared.fly(experiment, inputs={"spring.f_0": one})
        assert_allclose(free["body.v"][-1], 1.0, rtol=1e-14)
        assert_array_equal(pushed["spring.f_0"], 2.0)
        assert free.info["connections"].keys() == {"spring.x"}
        assert "spring.f_0" not in pushed.info["held"]


def test_a_point_carries_what_was_told(tmp_path):
    """A checkpoint: the state of the instance that signals are goes through bytes."""
    signal = noise("linear")
    wiring = wire(body(signal, parameters={}), {"body": describe(inputs=["f"])})
    (feed,) = wiring.feeds.values()
    pieces = feeds.pieces(feed, Schedule.of(0.0, 2.0, 0.1, 1))
    one, other = (Tabulated(feed, feeds.description(feed), pieces, dict) for _ in range(2))
    one.setup_experiment(0.0)
    one.do_step(0.3, 0.1)
    other.setup_experiment(0.0)
    empty = Point(0, *(np.zeros(1) for _ in range(2)), np.zeros((2, 0)), None)  # type: ignore[arg-type]
    replace(empty, states={"f": one.serialize_state(one.get_state())}).restore({"f": other})
    told = tuple(range(5))
    assert_array_equal(other.get_real(told), one.get_real(told))
    assert_array_equal(other.get_output_derivatives((0,), (1,)), one.get_output_derivatives((0,), (1,)))


@pytest.mark.parametrize(
    "inputs, message",
    [
        ({"body.f": Signal(([0, 1], [1, 2]))}, "it reaches from 0 to 1 s, the flight from 0 to 2 s. It feeds body.f"),
        ({"body.f": Signal(([0.5, 3], [1, 2]))}, "it reaches from 0.5 to 3 s, the flight from 0 to 2 s"),
        ({"body.f": Signal(([0, 2], [[1, 2]] * 2))}, "it has 2 columns, body.f has 1 element"),
        ({"body.f": "gust.csv"}, "inputs has for body.f str 'gust.csv', which is no Signal. Write Signal('gust.csv')"),
        ({"body.g": Signal(([0, 2], [1, 2]))}, 'unknown input "g" in component "body". There: f.'),
        ({"bdy.f": Signal(([0, 2], [1, 2]))}, 'unknown component "bdy"'),
        ({"body.x": Signal(([0, 2], [1, 2]))}, "it feeds body.x, which is no input. Inputs: f."),
    ],
)
def test_what_is_refused(inputs, message):
    system = System(name="body", components={"body": FreeBody}, inputs=inputs, hold_unconnected=True)
    with pytest.raises(WiringErrors) as caught:
        simulate(system, Experiment(stop_time=2.0, communication_step_size=0.1))
    assert message in str(caught.value)


def test_a_signal_beside_a_connection_is_refused():
    system = System(
        name="s",
        components={"body": FreeBody, "spring": Spring},
        connections=[Connection("body.x", "spring.x", "after_step"), Connection("spring.f", "body.f")],
        held={"spring.f_0": 1.0},
        inputs={"body.f": Signal(([0, 1], [1, 1]))},
    )
    with pytest.raises(WiringErrors, match=r"input body.f has 2 sources: spring.f, body \(signals\).f"):
        simulate(system, Experiment(stop_time=1.0, communication_step_size=0.1))
