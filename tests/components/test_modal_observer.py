"""Modal observer: exact from a matched start, whatever the inertia; with gains its error has the poles asked for."""

import numpy as np
import pytest
from geng2012_loop import CONNECTIONS, loop, plant, start
from helpers import Monolithic, Point, numbers, split
from numpy.testing import assert_allclose
from published import as_in
from scipy.integrate import solve_ivp

from components.estimators.modal_observer import place_gains
from components.framework import ComponentError

ModalObserver = as_in("geng2012-compensated", "observer")

OBSERVER = ModalObserver()
VEHICLE = {n: start(OBSERVER, n) for n in ("J", "delta", "Omega", "zeta")}
POLES = np.array(
    [-0.5 + 0.7j, -0.5 - 0.7j, -0.6 + 1.1j, -0.6 - 1.1j, -0.7 + 1.9j, -0.7 - 1.9j, -0.8 + 2.5j, -0.8 - 2.5j]
)
RNG = np.random.default_rng(3)
ALL = ("omega_BN_B",)


def gains() -> dict:
    L_eta, L_psi = place_gains(**VEHICLE, poles=POLES)
    return {"L_eta": L_eta, "L_psi": L_psi}


def test_feedthrough():
    seen = ("omega_BN_B", "h_B")
    assert OBSERVER.direct_feedthrough == {"eta": seen, "eta_dot": seen, "valid": ()}


def test_start():
    """eta = 0 and psi = delta w: the modes are taken to be at rest; or as they are given, with gains too."""
    w = [0.02, -0.03, 0.01]
    y = Point(OBSERVER, omega_BN_B=w).outputs()
    assert_allclose([*y["eta"], *y["eta_dot"]], 0, atol=1e-15)
    assert_allclose(Point(OBSERVER, omega_BN_B=w).states()["z_psi"], VEHICLE["delta"] @ w)
    given = dict(eta_start=[0.1, -0.2, 0.3, 0.4], eta_dot_start=[0.4, 0.3, -0.2, 0.1])
    y = Point(ModalObserver(**gains()), omega_BN_B=w, **given).outputs()
    assert_allclose(y["eta"], given["eta_start"], atol=1e-12)
    assert_allclose(y["eta_dot"], given["eta_dot_start"], atol=1e-12)


def test_it_is_exact_from_a_matched_start_although_the_inertia_is_off():
    """geng2012, figures: 1e-9. The closed loop of the paper as one ODE, J of the plant 20 % off."""
    system = Monolithic(loop(network=0, constant_gain=0.0), CONNECTIONS)
    t = np.linspace(0, 15, 151)
    x = system.solve(t, rtol=1e-10, atol=1e-13)
    y, states = system.outputs(t, x), system.split(x)
    assert np.abs(states["plant.eta"]).max() > 0.05
    assert np.abs(y["observer.eta"] - states["plant.eta"]).max() < 1e-9
    assert np.abs(y["observer.eta_dot"] - y["plant.eta_dot"]).max() < 1e-9


def estimate(observer: ModalObserver, eta_0, time, torque=(0.3, -0.2, 0.1), h=None, told_h=None, **plant_values):
    """The error of eta over time: the plant under a constant torque, its modes not where the observer takes them.

    h(t): what actuators store in the plant, nothing if not given; told_h: what the observer is told of it, h if not.
    """

    def at(part, t, momentum):
        part.u[3:6] = momentum(t)
        part.t = t
        return part

    h = h or (lambda _: np.zeros(3))
    body, watch = Point(plant(1.0, eta=eta_0, **plant_values), tau_B=torque), Point(observer, tau_B=torque)
    assert body.component.inputs[1].name == "h_B" and watch.component.inputs[0].name == "omega_BN_B"
    watch.u = np.roll(watch.u, -3)  # torque, momentum, rate, in the order of the plant
    n = len(body.x)

    def watching(t, w):
        at(watch, t, told_h or h)
        watch.u[6:] = w
        return np.roll(watch.u, 3)

    def both(t, x):
        """Set both to the time and the states; the observer's inputs in its own order."""
        body.x = x[:n]
        return watching(t, at(body, t, h).outputs()["omega_BN_B"])

    def rates(t, x):
        u = both(t, x)
        return np.concatenate([body.rates_flat(), numbers(watch.functions.rates(t, x[n:], u, watch.p, watch.c))])

    body.x = at(body, 0.0, h).initial()
    u = watching(0.0, body.outputs()["omega_BN_B"])
    z = numbers(watch.functions.initial(0, watch.x, u, watch.p, watch.c, []))
    start = np.concatenate([body.x, z])
    states = solve_ivp(rates, (0, time[-1]), start, "DOP853", time, rtol=1e-10, atol=1e-13).y.T
    errors = []
    for t, x in zip(time, states, strict=True):
        shown = watch.functions.outputs(t, x[n:], both(t, x), watch.p, watch.c, [])
        errors.append(split(observer.outputs_declared, numbers(shown))["eta"] - body.states()["eta"])
    return np.array(errors)


def test_without_gains_an_error_at_the_start_decays_with_the_modes_own_damping():
    time, first = np.linspace(0, 20, 201), 1
    error = estimate(OBSERVER, np.eye(4)[first] * 1e-3, time)
    damping, omega = VEHICLE["zeta"][first], VEHICLE["Omega"][first]
    rate, omega_d = damping * omega, omega * np.sqrt(1 - damping**2)
    expected = -1e-3 * np.exp(-rate * time) * (np.cos(omega_d * time) + rate / omega_d * np.sin(omega_d * time))
    assert_allclose(error[:, first], expected, atol=1e-8)


def test_placed_poles():
    """(A - L C) of the error, with A, C from the mass matrix of the vehicle."""
    L = np.vstack(list(gains().values()))
    K, C = np.diag(VEHICLE["Omega"] ** 2), np.diag(2 * VEHICLE["zeta"] * VEHICLE["Omega"])
    F, J = VEHICLE["delta"].T, VEHICLE["J"]
    acceleration = np.linalg.inv(np.block([[J, F], [F.T, np.eye(4)]]))[:3, 3:] @ -np.hstack([K, C])
    A = np.block([[np.zeros((4, 4)), np.eye(4)], [-K, -C]])
    assert_allclose(np.sort_complex(np.linalg.eigvals(A - L @ acceleration)), np.sort_complex(POLES), rtol=1e-6)


def test_with_gains_an_error_at_the_start_is_gone_soon():
    time = np.linspace(0, 20, 101)
    eta_0 = RNG.normal(0, 1e-3, 4)
    without, error = (estimate(part, eta_0, time) for part in (OBSERVER, ModalObserver(**gains())))
    assert np.abs(error[0] + eta_0).max() < 1e-12
    assert np.abs(error[-1]).max() < 2e-3 * np.abs(error).max()
    assert np.abs(without[-1]).max() > 0.5 * np.abs(eta_0).max()


def test_gains_bring_in_the_error_of_the_inertia():
    time = np.linspace(0, 20, 101)
    error = estimate(ModalObserver(**gains()), np.zeros(4), time, J=1.2 * VEHICLE["J"])
    assert np.abs(error).max() > 1e-3
    assert np.abs(estimate(OBSERVER, np.zeros(4), time, J=1.2 * VEHICLE["J"])).max() < 1e-9


def test_with_gains_it_knows_the_gyroscopic_torque_of_what_the_actuators_store():
    """From a matched start it stays exact if it is told h_B, and does not if it is not."""
    time, part = np.linspace(0, 20, 101), ModalObserver(**gains())
    told, untold = (
        estimate(part, np.zeros(4), time, h=lambda _: [5.0, -3.0, 4.0], told_h=h) for h in (None, lambda _: np.zeros(3))
    )
    assert np.abs(told).max() < 1e-9
    assert np.abs(untold).max() > 1e-3


def test_with_gains_it_knows_the_torque_of_the_actuators_from_what_they_store():
    """-h_B' of some newton metres: told h_B, and nothing of a torque, the estimate stays exact."""
    time, part = np.linspace(0, 20, 101), ModalObserver(**gains())

    def h(t):
        return [3 * np.sin(t), -2 * np.cos(1.7 * t), 4 * np.sin(0.6 * t)]

    assert np.abs(estimate(part, np.zeros(4), time, torque=(0, 0, 0), h=h)).max() < 1e-9
    assert np.abs(estimate(part, np.zeros(4), time, torque=(0, 0, 0), h=h, told_h=lambda t: h(0))).max() > 1e-3


@pytest.mark.parametrize("modes", [0, 1, 6])
def test_any_number_of_modes(modes):
    point = Point(ModalObserver(modes=modes))
    assert point.violated() == []
    assert point.outputs()["eta"].shape == (modes,)


def test_gains_of_the_wrong_sign_are_refused():
    """The sum of the poles of A - L C grows from sum(POLES) to as much above that of A as it was below."""
    wrong = {name: -value for name, value in gains().items()}
    damping = np.sum(2 * VEHICLE["zeta"] * VEHICLE["Omega"])
    (message,) = Point(OBSERVER, **wrong).violated()
    words, number = message.split("tr(A - L C), is ")
    assert words.startswith("L_eta, L_psi let the error of the estimate grow")
    assert_allclose(float(number.split(" 1/s")[0]), -2 * damping - np.sum(POLES).real, rtol=1e-5)
    assert Point(OBSERVER, **gains()).violated() == []
    assert Point(OBSERVER, zeta=0.0).violated() == []


UNFIT = {
    "unstable": ([-0.3, 0.4, *POLES[2:]], "with the poles 0.4+0j 1/s the error of the estimate does not decay"),
    "on the axis": ([0, *POLES[2:], -1], "with the poles 0+0j 1/s the error of the estimate does not decay"),
    "not a number": ([np.nan, *POLES[2:], -1], "with the poles nan+0j 1/s the error of the estimate does not decay"),
    "too few": (POLES[:6], "6 poles were given for 4 modes: give two a mode, 8."),
    "no conjugate": ([-0.5 + 0.7j, -0.5, *POLES[2:]], "the poles -0.5+0.7j 1/s lack their conjugates"),
}


@pytest.mark.parametrize("case", UNFIT)
def test_poles_that_no_observer_can_have_are_refused(case):
    poles, words = UNFIT[case]
    with pytest.raises(ComponentError) as raised:
        place_gains(**VEHICLE, poles=poles)
    assert str(raised.value).startswith(f"ModalObserver: {words}")


def test_real_poles_are_placed_too():
    """Where no well conditioned gains are found the poles are placed all the same, without a warning."""
    poles = -np.linspace(0.3, 0.5, 8)
    point = Point(ModalObserver(**dict(zip(("L_eta", "L_psi"), place_gains(**VEHICLE, poles=poles), strict=True))))
    assert point.violated() == []


def test_refusals():
    cases = {
        "J is not symmetric": {"J": [[70, 3, 4], [0, 60, 5], [4, 5, 90]]},
        "J - delta^T delta is not positive definite": {"J": np.diag([40.0, 60, 90])},
        "Omega[1] = -1 rad/s: it must not be negative.": {"Omega": [-1, 1, 1, 1]},
    }
    for words, values in cases.items():
        messages = Point(OBSERVER, **values).violated()
        assert any(words in message for message in messages), messages
