"""What goes between an output and an input: exact, or by scipy's and Basilisk's own, and in flight."""

from functools import cache

import numpy as np
import pytest
from helpers import Point, assert_units
from numpy.testing import assert_allclose, assert_array_equal
from scipy import signal
from scipy.integrate import solve_ivp

from components.catalog import CATALOG
from components.framework import ComponentError
from cosim import Connection, Experiment, System, Value, simulate
from cosim.cli.library import Library

FILTERS = ("Delay", "LowPass", "Notch", "Quantiser", "RateLimiter", "Saturation")
OTHER = {  # values far from what does nothing
    "Quantiser": {"quantum": [0.1, 0.2, 0.3]},
    "RateLimiter": {"rate": [0.5, 1.0, 2.0]},
    "Saturation": {"limit": [0.1, 0.2, 0.3]},
}
every = pytest.mark.parametrize("name", FILTERS)


def made(name, width=3, unit="N.m", **values):
    return CATALOG[name](width=width, unit=unit, **values)


def passed(part, u):
    """y of a sampled component, sample by sample, for the rows u."""
    point = Point(part, u=u[0])
    y = []
    for row in u:
        point.u = np.ravel(row)
        point.x = point.rates_flat()
        y.append(point.outputs()["y"])
    return np.array(y)


# ---- all of them ---------------------------------------------------------------------------------------------------


@every
@pytest.mark.parametrize("unit", ["N.m", "rad/s", "N"])
def test_units(name, unit):
    assert_units(made(name, unit=unit, **OTHER.get(name, {})))


FEEDTHROUGH = {
    "Delay": {"y": ()},
    "LowPass": {},
    "Notch": {"y": ("u",)},
    "Quantiser": {"y": ("u",)},
    "RateLimiter": {"y": ("u",)},
    "Saturation": {"y": ("u",), "saturated": ("u",)},
}


@every
def test_direct_feedthrough(name):
    assert made(name).direct_feedthrough == FEEDTHROUGH[name]


def test_elements_do_not_meet():
    """But for a saturation that keeps the direction."""
    for name in set(FILTERS) - {"Saturation", "LowPass", "Delay"}:
        rows = [row["u"] for row in made(name).functions.output_dependencies]
        assert rows == [[0], [1], [2]], name


@every
@pytest.mark.parametrize("width", [1, 4])
def test_a_constant_passes_from_the_start_on(name, width):
    value = np.linspace(-2.0, 3.0, width)
    point = Point(made(name, width=width), u=value)
    for _ in range(3):
        shown = point.outputs() | point.states()
        assert_array_equal(shown["y"], value)
        assert point.violated() == []
        if point.component.sampled:
            point.x = point.rates_flat()
        else:
            assert not point.rates_flat().any()


@every
def test_no_element_is_no_filter(name):
    with pytest.raises(ComponentError, match=f"{name}: width = 0: a filter has one element at least"):
        made(name, width=0)


REFUSED = [
    ("Notch", {"frequency": [1, 0, 1]}, "frequency[2] = 0 rad/s: it must be positive."),
    ("Notch", {"zeta_p": [1, 1, -1]}, "zeta_p[3] = -1: it must be positive."),
    ("Notch", {"zeta_z": [-1, 1, 1]}, "zeta_z[1] = -1: it must not be negative."),
    ("LowPass", {"bandwidth": [0, 1, 1]}, "bandwidth[1] = 0 rad/s: it must be positive."),
    ("Quantiser", {"quantum": [0, -1, 0]}, "quantum[2] = -1 N.m: it must not be negative."),
    ("RateLimiter", {"rate": [0, 1, 1]}, "rate[1] = 0 N.m/s: it must be positive."),
    ("Saturation", {"limit": [0, 1, 1]}, "limit[1] = 0 N.m: it must be positive."),
    ("Delay", {"delay": -0.1}, "delay = -0.1 s: it must not be negative."),
    (
        "Delay",
        {"delay": 0.35, "samples": 3},
        "delay = 0.35 s: it must be 0, or from one to all samples, 0.1 s to 0.3 s. Take more, as in Delay:samples=6, "
        "or another sample_time.",
    ),
    (
        "Delay",
        {"delay": 0.05, "samples": 3},
        "delay = 0.05 s: it must be 0, or from one to all samples, 0.1 s to 0.3 s. Take more, as in Delay:samples=6, "
        "or another sample_time.",
    ),
]


@pytest.mark.parametrize(("name", "values", "message"), REFUSED)
def test_what_cannot_be_is_refused(name, values, message):
    assert message in Point(made(name, **values)).violated()


# ---- notch and low-pass: scipy's frequency response ----------------------------------------------------------------


def response(part, w):
    """y/u at the frequencies w, rad/s, of the first element, from its Jacobians."""
    point = Point(part)
    n = len(point.x)
    A, B = part.linearise(point.x)

    def shown(x, u):
        point.x, point.u = x, u
        return (point.outputs() | point.states())["y"][0]

    C = np.array([shown(e, 0 * point.u) for e in np.eye(n)])
    D = shown(np.zeros(n), np.eye(len(point.u))[0])
    return np.array([C @ np.linalg.solve(1j * f * np.eye(n) - A, B[:, 0]) + D for f in w])


def test_frequency_response_of_the_notch():
    W, zeta_z, zeta_p = 25.0, 0.02, 0.4
    w = np.geomspace(0.1, 1e4, 400)
    _, expected = signal.freqs([1, 2 * zeta_z * W, W**2], [1, 2 * zeta_p * W, W**2], w)
    part = made("Notch", frequency=W, zeta_z=zeta_z, zeta_p=zeta_p)
    assert_allclose(response(part, w), expected, rtol=1e-10)  # conditioned by 1e4^2 / 25^2 at worst


def test_depth_width_and_lag_of_the_notch():
    """At its frequency zeta_z/zeta_p; gain 1/sqrt(2) at edges 2 zeta_p W apart; far below a lag of 2 zeta_p w/W."""
    W, zeta_p = 10.0, 0.3
    assert_allclose(abs(response(made("Notch", frequency=W, zeta_z=0.06, zeta_p=zeta_p), [W])), 0.2, rtol=1e-12)
    deep = made("Notch", frequency=W, zeta_z=0.0, zeta_p=zeta_p)
    middle = np.hypot(W, zeta_p * W)  # the edges' geometric mean is W
    edges = [middle - zeta_p * W, middle + zeta_p * W]
    assert_allclose(abs(response(deep, edges)), np.sqrt(0.5), rtol=1e-12)
    assert_allclose(np.angle(response(deep, [1e-4 * W])), -2e-4 * zeta_p, rtol=1e-6)


def test_frequency_response_of_the_low_pass():
    w = np.geomspace(0.01, 1e3, 100)
    _, expected = signal.freqs([5.0], [1, 5.0], w)
    assert_allclose(response(made("LowPass", bandwidth=5.0), w), expected, rtol=1e-12)


# ---- sampled ones: exact -------------------------------------------------------------------------------------------


@pytest.mark.parametrize("samples", [0, 1, 2, 7])
def test_a_delay_is_exact(samples):
    u = np.random.default_rng(1).normal(size=(30, 3))
    expected = np.concatenate([np.repeat(u[:1], samples, axis=0), u])[:30]
    assert_array_equal(passed(made("Delay", samples=samples), u), expected)


def test_sample_and_hold_follows_its_input():
    assert made("Delay", samples=0).direct_feedthrough == {"y": ("u",)}


@pytest.mark.parametrize("delay", [0.1, 0.25, 0.3, 0.42, 0.5])
def test_a_time_between_samples_is_on_the_line_between_them(delay):
    """numpy's interpolation of the samples, which hold their first value before the start."""
    u = np.random.default_rng(2).normal(size=(30, 2))
    y = passed(made("Delay", width=2, samples=5, delay=delay), u)
    t = 0.1 * np.arange(30)
    for i in range(2):
        assert_allclose(y[:, i], np.interp(t - delay, t, u[:, i]), atol=1e-14)


def test_a_step_takes_its_time_through_a_rate_limiter():
    """Exactly rate T a sample until it is there, each element at its own rate; then it stays."""
    u = np.tile([3.0, -3.0, 0.1], (40, 1))
    u[0] = 0
    y = passed(made("RateLimiter", rate=[1.0, 2.0, 4.0]), u)
    k = np.arange(40)[:, None]
    expected = np.sign(u[1]) * np.minimum(np.abs(u[1]), 0.1 * np.array([1.0, 2.0, 4.0]) * k)
    assert_allclose(y, expected, atol=1e-14)


def test_what_is_slow_passes_a_rate_limiter_unchanged():
    t = 0.1 * np.arange(50)[:, None]
    u = np.sin(t) * [0.9, 0.5, -0.1]
    assert_array_equal(passed(made("RateLimiter", rate=1.0), u), u)


# ---- without memory ------------------------------------------------------------------------------------------------


def test_a_quantiser_gives_the_nearest_whole_number_of_quanta():
    rng = np.random.default_rng(3)
    for q in (2.0**-10, 0.37, 1e3):
        whole, rest = rng.integers(-(2**15), 2**15, 3), rng.uniform(-0.499, 0.499, 3)
        y = Point(made("Quantiser", quantum=q), u=(whole + rest) * q).outputs()["y"]
        assert_array_equal(y, whole * q)


def test_a_quantiser_of_no_quantum_changes_nothing():
    u = [0.1, -1e-17, 1e17]
    assert_array_equal(Point(made("Quantiser"), u=u).outputs()["y"], u)


def test_saturation():
    u = np.array([0.5, -3.0, 0.25])
    y = Point(made("Saturation", limit=[1.0, 2.0, 0.2]), u=u).outputs()
    assert_array_equal(y["y"], [0.5, -2.0, 0.2])
    assert y["saturated"] == 2
    y = Point(made("Saturation", limit=[1.0, 2.0, 0.2], keep_direction=1.0), u=u).outputs()["y"]
    assert_allclose(y, u * 2 / 3, rtol=1e-15)  # |u_2| is 3/2 of its limit, |u_3| 5/4


# ---- in flight -----------------------------------------------------------------------------------------------------

SIZE, FAST, ANGLE = np.array([1.0, -2.0, 3.0]), 2.0, 0.7


@cache
def chain(backend):
    """A sinusoid into a delay of three samples of 50 ms, into a notch of its frequency, into the rest in a row."""
    system = System(
        name="chain",
        components={
            "source": "HarmonicTorque",
            "delay": "Delay:width=3,unit=N.m,samples=3",
            "notch": "Notch:width=3,unit=N.m",
            "limiter": "RateLimiter:width=3,unit=N.m",
            "quantiser": "Quantiser:width=3,unit=N.m",
            "saturation": "Saturation:width=3,unit=N.m",
            "low": "LowPass:width=3,unit=N.m",
            "held": "Notch:width=3,unit=N.m",
        },
        connections=[
            Connection("source.tau_dist_B", "delay.u", "after_step"),
            Connection("source.tau_dist_B", "notch.u", "ramp"),
            Connection("source.tau_dist_B", "limiter.u", "after_step"),
            Connection("limiter.y", "quantiser.u", "after_step"),
            Connection("quantiser.y", "saturation.u", "after_step"),
            Connection("saturation.y", "low.u", "after_step"),
            Connection("low.y", "held.u"),
        ],
        parameters={
            "source.sine": Value((SIZE * np.cos(ANGLE)).tolist(), "N.m"),
            "source.cosine": Value((SIZE * np.sin(ANGLE)).tolist(), "N.m"),
            "source.frequency": FAST,
            "delay.sample_time": 0.05,
            "notch.frequency": Value(FAST / (2 * np.pi), "Hz"),
            "notch.zeta_z": 0.0,
            "limiter.rate": 5.0,
            "quantiser.quantum": 0.25,
            "saturation.limit": 1.2,
        },
    )
    experiment = Experiment(stop_time=2.0, communication_step_size=0.01)
    return simulate(system, experiment, locate=Library(backend))


@pytest.mark.parametrize("backend", ["native", "python"])
def test_in_flight(backend):
    """The delay shows what came in three samples ago; the notch what DOP853 says of its transfer function."""
    run = chain(backend)
    u, t = run["source.tau_dist_B"], run.time
    sample = 5 * (np.arange(len(t)) // 5) - 15
    assert_array_equal(run["delay.y"], u[np.maximum(sample, 0)])

    def rates(time, x):  # of 1 / (s^2 + 2 s + 4)
        return [x[1], np.sin(FAST * time + ANGLE) - 4 * x[0] - 2 * x[1]]

    # (s^2 + 4) / (s^2 + 2 s + 4) = 1 - 2 s / (s^2 + 2 s + 4), from what the input of the start has settled at
    found = solve_ivp(rates, (0, 2), [np.sin(ANGLE) / 4, 0], "DOP853", t_eval=t, rtol=1e-11, atol=1e-13)
    expected = np.sin(FAST * t + ANGLE) - 2 * found.y[1]
    # Native: a line between points h apart is off by h^2/8 u''. Python: its middle, held, is off by A B h^3/12 u' a
    # step, |A| = 3.2, |B| = 2, forgotten in 1/(zeta_p W) = 1 s. y has twice the band.
    h = 0.01
    off = {"native": h**2 / 8 * 4, "python": 2 * h**2 / 12 * 3.2 * 2 * 2}[backend] * np.abs(SIZE).max()
    assert_allclose(run["notch.y"], expected[:, None] * SIZE, atol=off)


def test_both_back_ends_show_the_same():
    """All but the notch whose input is a ramp, of which the python back end takes the middle; bit by bit."""
    native, python = chain("native"), chain("python")
    for name in ("delay.y", "limiter.y", "quantiser.y", "saturation.y", "saturation.saturated", "low.y", "held.y"):
        assert np.ptp(native[name], axis=0).any(), name
        assert_array_equal(native[name], python[name], err_msg=name)


@pytest.mark.peers
def test_basilisk_limits_a_torque_the_same_way():
    """Its saturation of one actuator, between -limit and limit."""
    pytest.importorskip("Basilisk")
    from Basilisk.architecture import messaging
    from Basilisk.simulation import saturationSingleActuator

    limits, u = np.array([0.5, 2.0, 3.0]), np.array([-0.7, 1.3, 3.1])
    y = Point(made("Saturation", limit=limits), u=u).outputs()["y"]
    for value, limit, found in zip(u, limits, y, strict=True):
        module = saturationSingleActuator.SaturationSingleActuator()
        command = messaging.SingleActuatorMsgPayload()
        command.input = value
        source = messaging.SingleActuatorMsg().write(command)
        module.actuatorInMsg.subscribeTo(source)
        module.setMinInput(-limit)
        module.setMaxInput(limit)
        module.Reset(0)
        module.UpdateState(0)
        assert_allclose(found, module.actuatorOutMsg.read().input, rtol=1e-9)
