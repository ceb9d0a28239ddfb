"""Faults in flight: in every master and both loops, against DOP853 leg by leg and recurrences of the test's own."""

from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.integrate import solve_ivp

from cosim import At, Connection, ErrorControlled, Experiment, Explicit, Fault, Iterated, System, simulate
from cosim.masters.noise import key_of, normal, philox

from .. import both
from ..oscillator import Damper, Mass, SampledDamper

SYSTEM = System(
    name="oscillator",
    components={"mass": Mass, "damper": Damper},
    connections=[Connection("mass.v", "damper.v", "after_step"), Connection("damper.f", "mass.f")],
    parameters={"mass.solver.step": 1e-3},  # RK4's own error is then 1e-12
)
V = "mass.v -> damper.v"
K, C = 4.0, 0.5  # start values of the units


def flown(master, faults, step=0.1, system=SYSTEM, stop=2.0, **more):
    """Fly in both loops; the tables must be equal bit by bit."""
    results = [
        simulate(
            system,
            Experiment(
                stop_time=stop,
                communication_step_size=step,
                master=replace(master, kernel=loop),
                faults=faults,
                **more,
            ),
        )
        for loop in both.LOOPS
    ]
    assert [r.info["loop"]["name"] for r in results] == ["kernel", "python"]
    both.assert_same(*results)
    return results[0]


def truth(legs, stop=2.0):
    """x, v at the end: f = -c (scale v + bias), or -c times what is stuck; legs (begin, scale, bias, stuck)."""
    z = np.array([1.0, 0.0])
    for i, (begin, scale, bias, stuck) in enumerate(legs):
        end = legs[i + 1][0] if i + 1 < len(legs) else stop

        def rates(t, y, scale=scale, bias=bias, stuck=stuck):
            seen = scale * y[1] + bias if stuck is None else stuck
            return [y[1], -K * y[0] - C * seen]

        z = solve_ivp(rates, (begin, end), z, "DOP853", rtol=1e-13, atol=1e-15).y[:, -1]
    return z


GOOD = (1, 0, None)
SMOOTH = {
    "scale": (
        [Fault("scale", V, -1.5, start=0.77, until=1.4)],
        [(0, *GOOD), (0.77, -1.5, 0, None), (1.4, *GOOD)],
    ),
    "bias": (
        [Fault("bias", V, 0.7, start=0.77, until=Fraction(4, 3))],
        [(0, *GOOD), (0.77, 1, 0.7, None), (4 / 3, *GOOD)],
    ),
    "stuck": ([Fault("stuck", V, 0.7, start=0.77, until=1.4)], [(0, *GOOD), (0.77, 0, 0, 0.7), (1.4, *GOOD)]),
    "scale, then bias too": (
        [Fault("bias", V, 0.7, start=1.0), Fault("scale", "damper.v", 2.0, start=0.5)],
        [(0, *GOOD), (0.5, 2, 0, None), (1.0, 2, 0.7, None)],
    ),
}


@pytest.mark.parametrize("name", SMOOTH)
@pytest.mark.parametrize(
    "master, order",
    [(Explicit(inputs="smooth", extrapolation=1), 2), (Iterated("ramp"), 2), (Iterated(tolerance=1e-12), 4)],
)
def test_the_order_of_the_exchange_stays_across_a_fault(name, master, order):
    """A slope or a prediction from before, used after it, or a slope that is not scaled, would cost an order."""
    faults, legs = SMOOTH[name]
    steps = (0.1, 0.05) if order == 4 else (0.05, 0.025)
    flights = [flown(master, faults, step) for step in steps]
    errors = [np.linalg.norm([f["mass.x"][-1], f["mass.v"][-1]] - truth(legs)) for f in flights]
    assert np.log2(errors[0] / errors[1]) > order - 0.3, errors
    assert errors[1] < {2: 2e-3, 4: 1e-6}[order]  # 0.5^2 h^2 and h^4 at h = 0.05 are 6e-4 and 6e-6


@pytest.mark.parametrize("name", SMOOTH)
def test_error_controlled_lands_on_faults(name):
    faults, legs = SMOOTH[name]
    result = flown(ErrorControlled(1e-9), faults)
    assert_allclose([result["mass.x"][-1], result["mass.v"][-1]], truth(legs), atol=1e-7)
    assert {float(f.begins) for f in faults} <= set(result.time)


@pytest.mark.parametrize("master", [Explicit(), Explicit(inputs="smooth", extrapolation=1), Iterated()])
def test_what_the_target_was_given_is_recorded(master):
    """Held kinds by what they must show of the source's own record, from the right at both ends."""
    stuck = flown(master, [Fault("stuck", V, 0.3, start=0.5, until=1.0)])
    during = (stuck.time >= 0.5) & (stuck.time < 1.0)
    assert (stuck["damper.v"][during] == 0.3).all()
    assert_array_equal(stuck["damper.v"][~during], stuck["mass.v"][~during])
    lost = flown(master, [Fault("dropout", V, start=0.5, until=1.0)])
    during = (lost.time >= 0.5) & (lost.time < 1.0)
    assert (lost["damper.v"][during] == lost["mass.v"][lost.time == 0.5]).all()
    assert_array_equal(lost["damper.v"][~during], lost["mass.v"][~during])
    coarse = flown(master, [Fault("quantisation", V, 0.25, start=0.5)])
    late = coarse.time >= 0.5
    assert_array_equal(coarse["damper.v"][late], 0.25 * np.round(coarse["mass.v"][late] / 0.25))
    assert (coarse["damper.v"][late] != coarse["mass.v"][late]).any()


@pytest.mark.parametrize("n", [1, 3])
def test_a_delay_counts_steps(n):
    """v(k) = y(max(k0, k - n)) while it is there."""
    result = flown(Explicit(), [Fault("delay", V, n, start=0.5, until=1.5)])
    k0, k1 = 5, 15
    y, given = result["mass.v"], result["damper.v"]
    wanted = [y[max(k0, k - n)] if k0 <= k < k1 else y[k] for k in range(len(y))]
    assert_array_equal(given, wanted)


def test_delay_after_a_dropout_and_what_is_on_its_way():
    """The line goes on while nothing is received; then what was sent n steps ago comes."""
    faults = [Fault("delay", V, 2, start=0.3), Fault("dropout", V, start=0.8, until=1.2)]
    result = flown(Explicit(), faults)
    y, given = result["mass.v"], result["damper.v"]
    wanted = [y[k] if k < 3 else y[max(3, k - 2)] for k in range(len(y))]
    wanted[8:12] = [wanted[8]] * 4  # the row of 0.8 shows what came last, and that stays
    assert_array_equal(given, wanted)


@pytest.mark.parametrize("master", [Explicit(inputs="ramp"), Explicit(inputs="smooth"), Iterated("ramp"), Iterated()])
def test_what_moves_in_steps_is_held(master):
    """mass.x'' = f - k x under a quantised f: of inputs on a line or curve the value at the start of each step, held.

    Between two points the motion is that of a mass under a constant force.
    """
    links = [Connection("mass.v", "damper.v"), Connection("damper.f", "mass.f", "after_step")]
    system = replace(SYSTEM, connections=links)
    result = flown(master, [Fault("quantisation", "mass.f", 0.2, start=0.0)], system=system)
    x, v, f = result["mass.x"], result["mass.v"], result["mass.f"]
    assert_allclose(f / 0.2, np.round(f / 0.2), atol=1e-12)
    held = f[:-1]
    w, h = np.sqrt(K), 0.1
    want = held / K + (x[:-1] - held / K) * np.cos(w * h) + v[:-1] / w * np.sin(w * h)
    assert_allclose(x[1:], want, atol=1e-12)  # RK4 at 1 ms: (2 h)^4 / 120 / step = 1e-13


@pytest.mark.parametrize("inputs", ["held", "ramp", "smooth"])
def test_inputs_of_several_rates(inputs):
    """A fast unit on a slow source and a slow one on a fast source, both with faults; both loops, bit by bit."""
    for steps in ({"mass": 4}, {"damper": 4}):
        system = replace(SYSTEM, steps=steps)
        for kind, value in (("scale", 0.5), ("stuck", 0.3), ("noise", 0.1), ("delay", 2), ("quantisation", 0.1)):
            faults = [Fault(kind, V, value, start=0.4, until=1.2), Fault("bias", "mass.f", 0.1, start=0.8)]
            result = flown(Explicit(inputs=inputs), faults, step=0.05, system=system)
            during = (result.time >= 0.4) & (result.time < 1.2)
            assert (result["damper.v"][during] != result["mass.v"][during]).any()
            assert_array_equal(result["damper.v"][~during], result["mass.v"][~during])


class TestNoise:
    def test_it_is_that_of_seed_target_and_time_alone(self):
        """The same numbers at the times that two step sizes share; added to the source, sigma times a normal number."""
        fault = Fault("noise", V, 0.1, start=0.5, until=1.5, seed=7)
        fine, coarse = flown(Explicit(), [fault], 0.025), flown(Explicit(), [fault], 0.05)
        drawn = [(r["damper.v"] - r["mass.v"])[r.time * 20 % 1 == 0] for r in (fine, coarse)]
        assert_allclose(drawn[0], drawn[1], atol=1e-15)  # a sum of numbers near 1, rounded
        assert np.count_nonzero(drawn[1]) == 20
        other = flown(Explicit(), [replace(fault, seed=8)], 0.05)
        assert not np.isclose((other["damper.v"] - other["mass.v"])[10:30], drawn[1][10:30]).any()

    def test_the_words_are_those_of_numpy(self):
        """numpy's Philox 4x64-10 counts up before it draws."""
        for key in ((0, 0), (7, key_of("damper.v")), (2**64 - 1, 2**63 + 5)):
            theirs = np.random.Philox(counter=[41, 2, 3, 4], key=list(key)).random_raw(4)
            assert philox((42, 2, 3, 4), key) == tuple(map(int, theirs))

    def test_they_are_normal_and_independent(self):
        """Of 20 000: moments within 4 standard errors, Kolmogorov-Smirnov, neighbours in time and seed uncorrelated."""
        from scipy.stats import kstest

        z = np.array([normal(3, key_of("a.u"), 1e-3 * k) for k in range(20_000)])
        n = len(z)
        assert abs(z.mean()) < 4 / np.sqrt(n) and abs(z.var() - 1) < 4 * np.sqrt(2 / n)
        assert abs((z**4).mean() - 3) < 4 * np.sqrt(96 / n)
        assert kstest(z, "norm").pvalue > 1e-3
        other = np.array([normal(4, key_of("a.u"), 1e-3 * k) for k in range(n)])
        for a, b in ((z[1:], z[:-1]), (z, other)):
            assert abs(np.corrcoef(a, b)[0, 1]) < 4 / np.sqrt(n)


class TestFreeze:
    @pytest.mark.parametrize("master", [Explicit(), Explicit(inputs="smooth", extrapolation=1), Iterated()])
    def test_its_state_and_clock_stand(self, master):
        """All frozen from 0.5 to 1.0 s: the flight goes on as if that time had not been.

        Slopes begin anew then: for one step a line is where a curve was, by h^2 f''/12 <= 3e-3 off over h = 0.1 s.
        """
        faults = [Fault("freeze", name, start=0.5, until=1.0) for name in ("mass", "damper")]
        result, plain = flown(master, faults), flown(master, [], stop=1.5)
        for name in ("mass.x", "mass.v", "damper.f"):
            assert len(set(result[name][5:11])) == 1
            again = np.concatenate([result[name][:5], result[name][10:]])
            assert_allclose(again, plain[name], atol=1e-12 if master == Explicit() else 3e-4)

    def test_a_frozen_source_is_a_constant(self):
        result = flown(Iterated(tolerance=1e-12), [Fault("freeze", "damper", start=0.5)], 0.05)
        f = result["damper.f"][result.time >= 0.5]
        assert (f == f[0]).all()
        z = [result[name][result.time == 0.5][0] for name in ("mass.x", "mass.v")]
        w, t = np.sqrt(K), 1.5
        want = f[0] / K + (z[0] - f[0] / K) * np.cos(w * t) + z[1] / w * np.sin(w * t)
        assert_allclose(result["mass.x"][-1], want, atol=1e-11)

    def test_a_sampled_one_takes_no_samples(self):
        """n counts samples: 5 fewer; and it takes them again at its own times."""
        system = replace(SYSTEM, components={"mass": Mass, "damper": SampledDamper})
        result = flown(Explicit(), [Fault("freeze", "damper", start=0.5, until=1.0)], 0.05, system=system)
        plain = flown(Explicit(), [], 0.05, system=system)
        assert result["damper.n"][-1] == plain["damper.n"][-1] - 5
        during = (result.time >= 0.5) & (result.time < 1.0)
        assert len(set(result["damper.f"][during])) == 1


class TestParameter:
    def test_it_has_its_value_while_the_fault_is_there(self):
        fault = Fault("parameter", "damper.c", 2.0, start=0.5, until=1.0)
        events = [At(0.5, {"damper.c": 2.0}), At(1.0, {"damper.c": 0.8})]
        system = replace(SYSTEM, parameters={**SYSTEM.parameters, "damper.c": 0.8})
        both.assert_same(flown(Iterated(), [fault], system=system), flown(Iterated(), [], system=system, events=events))

    def test_what_an_event_has_set_comes_back(self):
        fault = Fault("parameter", "damper.c", 2.0, start=0.5, until=1.0)
        result = flown(Explicit(), [fault], events=[At(0.2, {"damper.c": 0.1}), At(1.5, {"damper.c": 3.0})])
        for begin, c in ((0.2, 0.1), (0.5, 2.0), (1.0, 0.1), (1.5, 3.0)):
            at = result.time == begin
            assert_allclose(result["damper.f"][at], -c * result["mass.v"][at], rtol=1e-14)
        assert [event["time"] for event in result.info["events"]] == [0.2, 1.5]


def test_at_the_start_and_to_the_end():
    """From t0 on: as a damper of half the damping; until the stop time: as without an end."""
    halved = flown(Iterated(), [Fault("scale", V, 0.5, start=0.0, until=2.0)])
    other = flown(Iterated(), [], system=replace(SYSTEM, parameters={**SYSTEM.parameters, "damper.c": 0.25}))
    assert_allclose(halved["mass.x"], other["mass.x"], atol=1e-8)  # the loop's tolerance is 1e-9 a step
    both.assert_same(halved, flown(Iterated(), [Fault("scale", V, 0.5, start=0.0)]))


def test_without_a_fault_that_is_there_nothing_changes():
    """Before a fault the flight is that without it, bit by bit; iterated up to its tolerance."""
    for master in (Explicit(), Explicit(inputs="smooth", extrapolation=1), Explicit(inputs="ramp")):
        plain, later = flown(master, []), flown(master, [Fault("noise", V, 0.5, start=1.5)])
        for name in plain.names:
            assert_array_equal(plain[name][:15], later[name][:15])


def test_run_json_has_them():
    fault = Fault("noise", V, "0.1 m/s", start=0.5, until=Fraction(4, 3), seed=3)
    told = flown(Explicit(), [fault]).info["faults"]
    assert told == [
        {
            "kind": "noise",
            "on": V,
            "sigma": "0.1 m/s",
            "seed": 3,
            "from": 0.5,
            "until": 4 / 3,
            "words": "noise of mass.v -> damper.v, sigma 0.1 m/s, from 0.5 s to 4/3 s",
        }
    ]
    assert flown(Explicit(), []).info["faults"] == []
