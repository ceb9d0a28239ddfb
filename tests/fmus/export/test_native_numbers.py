"""Native FMUs: FMI 2.0's rules, numbers against scipy and the Python twin."""

import math
from fractions import Fraction
from itertools import pairwise

import fmpy
import numpy as np
import pytest
from fmpy.validation import validate_fmu
from numpy.testing import assert_allclose
from scipy.integrate import solve_ivp

from components.framework.component import start_vector
from fmus.export.python.runtime import Runtime

from .fmi_rules import fmi_rule_breaches
from .parts import every
from .slaves import names_of

PARTS = every()
all_parts = pytest.mark.parametrize("name", PARTS)


@all_parts
def test_fmpy_and_our_own_rules_find_nothing(fmus, name):
    assert validate_fmu(str(fmus(name))) == []
    assert fmi_rule_breaches(fmus(name)) == []


@all_parts
def test_runs_alone(fmus, name):
    result = fmpy.simulate_fmu(str(fmus(name)), stop_time=0.05, output_interval=0.01)
    assert len(result) == 6
    assert all(np.isfinite(result[column]).all() for column in result.dtype.names)


def test_versions(open_slave):
    slave = open_slave("Gain")
    assert slave.getVersion() == "2.0"
    assert slave.getTypesPlatform() == "default"


def test_accuracy_of_a_nonlinear_plant(open_slave):
    """Against scipy, on the equations written out here."""
    J, k, drive, u = np.array([[2.0, 0.3], [0.3, 1.5]]), 1.7, 0.9, np.array([0.1, -0.2])

    def rates(t, x):
        swing = [k * math.sin(x[2]), 0.5 * k * math.cos(2 * x[2]) * x[0]]
        return [*np.linalg.solve(J, u - swing), drive + x[1] * math.sin(t)]

    expected = solve_ivp(rates, (0, 3), [0.3, -0.1, 0.2], "DOP853", rtol=1e-12, atol=1e-14).y[:, -1]
    for steps in (3, 300):
        slave = open_slave("Swing").start()
        for k_step in range(steps):
            slave.doStep(k_step * 3 / steps, 3 / steps)
        found = slave.get("omega[1]", "omega[2]", "phase", "energy", "applied[2]")
        assert_allclose(found[:3], expected, rtol=1e-11)
        assert_allclose(found[3], 0.5 * expected[:2] @ J @ expected[:2], rtol=1e-10)
        assert_allclose(found[4], u[1] * math.cos(expected[2]) + 0.85 * expected[1], rtol=1e-10)


def test_internal_steps_divide_the_step(open_slave):
    """2.5 largest steps are 3 equal ones, 3.0000000001 are 3."""
    f = PARTS["Swing"].functions
    p, u, x = (start_vector(g) for g in (PARTS["Swing"].parameters, PARTS["Swing"].inputs, PARTS["Swing"].states))
    for step, n in ((2.5e-3, 3), (3e-3 * (1 + 1e-13), 3), (4e-4, 1)):
        slave = open_slave("Swing").start()
        slave.doStep(0.0, step)
        after = x
        for i in range(n):
            after = f.advance(0.0, after, u, [0, 0], [0, 0], [0, 0], p, f.calculate(p), i * (step / n), step / n)
        assert slave.get("omega[1]", "omega[2]", "phase") == after.full().ravel().tolist()


@pytest.mark.parametrize("start", [0, 10**6, 10**8])
def test_a_step_that_rounding_has_made_longer_has_no_more_internal_steps(open_slave, start):
    """A master's step is t_k+1 - t_k, at 1e6 s by some 1e-10 s off 1 ms; the twins count alike."""
    part = PARTS["Swing"]
    p, u = (start_vector(g) for g in (part.parameters, part.inputs))
    c = part.functions.calculate(p)
    slave, twin = open_slave("Swing").start(start=start), Runtime(part)
    twin.setup(float(start))
    twin.enter_initialization()
    twin.exit_initialization()
    names, lengths = ("omega[1]", "omega[2]", "phase"), set()
    for k in range(200):
        for n in (1, 2):
            t = start + (3 * k + n - 1) / 1000
            step = start + (3 * k + 2 * n - 1) / 1000 - t
            x = slave.get(*names)
            for i in range(n):
                x = part.functions.advance(t, x, u, [0, 0], [0, 0], [0, 0], p, c, i * (step / n), step / n)
            slave.doStep(t, step)
            twin.do_step(t, step)
            lengths.add(n * 1e-3 < step)
            assert slave.get(*names) == x.full().ravel().tolist() == twin.get(slave.vr(*names))
    assert lengths == {True, False}


@pytest.mark.parametrize(
    ("start", "first", "tenths"), [(10**6, 0, 1), (10**8, 0, 1), (0, 10**5, 10001)], ids=["1e6", "1e8", "0 to 1e8"]
)
def test_samples_at_large_times_are_neither_lost_nor_doubled(open_slave, start, first, tenths):
    """At 1e8 s two doubles lie 15 ns apart: more than the 1 ns within which a sample is due."""
    period = tenths / 10
    slave, twin = open_slave("Sum").begin(start=start), Runtime(PARTS["Sum"])
    twin.setup(float(start))
    twin.enter_initialization()
    slave.set({"sample_time": period})
    twin.set(slave.vr("sample_time"), [period])
    slave.exitInitializationMode()
    twin.exit_initialization()
    points = [float(start + Fraction(tenths * k, 10)) for k in (0, *range(first + 1, first + 300))]
    totals = []
    for t, end in pairwise(points):
        for one in (slave.doStep, twin.do_step):
            one(t, end - t)
        assert slave.get("total", "shown") == twin.get(slave.vr("total", "shown"))
        totals.append(slave.get("total")[0])
    assert_allclose(np.diff(totals)[1:], 4 * 0.25 + 0.1 * 0.25, rtol=1e-6)  # one sample a step


@all_parts
@pytest.mark.parametrize("commit_shown", [0.0, 1.0])
def test_twin(open_slave, name, commit_shown):
    """The Python runtime gives the same bits, whatever is set, read, stepped, saved and restored."""
    part = PARTS[name]
    rng = np.random.default_rng(7)
    slave, twin = open_slave(name), Runtime(part)
    size = len(twin.v)
    parameters, inputs = names_of(part, name, "p"), names_of(part, name, "u")
    settable = [*parameters, *inputs, *(v.name for v in slave.description.modelVariables if v.initial == "exact")]
    settable = [n for n in dict.fromkeys(settable) if not n.startswith(("solver.", "sample_time", "J"))]
    tunable = [
        v.name for v in slave.description.modelVariables if v.variability == "tunable" and v.causality == "parameter"
    ]

    def put(names):
        chosen = [n for n in names if rng.random() < 0.5]
        values = [0.05 * rng.uniform(0.5, 1.5) if "solver" in n else rng.uniform(0.001, 0.01) for n in chosen]
        slave.setReal(slave.vr(*chosen), values)
        twin.set(slave.vr(*chosen), values)

    def same():
        found, expected = slave.getReal(range(size)), twin.get(list(range(size)))
        assert np.array(found).tobytes() == np.array(expected).tobytes()

    if part.sampled:
        slave.set({"solver.commit_shown": commit_shown})
        twin.set(slave.vr("solver.commit_shown"), [commit_shown])
    put(settable)
    slave.begin(start=1.5)
    twin.setup(1.5)
    twin.enter_initialization()
    for _ in range(3):
        put(settable)
        same()
    put(inputs)
    slave.exitInitializationMode()
    twin.exit_initialization()
    same()
    now, kept = 1_500_000_000, None
    for _ in range(60):
        put([*inputs, *tunable])
        if inputs and rng.random() < 0.5:
            order = rng.integers(1, 3, len(inputs)).tolist()
            values = rng.uniform(-0.01, 0.01, len(inputs)).tolist()
            slave.setRealInputDerivatives(slave.vr(*inputs), order, values)
            twin.set_input_derivatives(slave.vr(*inputs), order, values)
        if rng.random() < 0.3:
            same()
        step = int(rng.choice([1_000_000, 25_000_000, 50_000_000, 70_000_000, 100_000_000, 300_000_000]))
        if name == "Blowup":
            step = 2_000
        if part.sampled and step % 25_000_000:
            step = 75_000_000  # so that steps end on ticks again and again
        slave.doStep(now / 1e9, step / 1e9)
        twin.do_step(now / 1e9, step / 1e9)
        now += step
        if rng.random() < 0.7:
            same()
        if rng.random() < 0.2:
            kept = (slave.getFMUstate(), twin.save(), now)
        elif kept and rng.random() < 0.2:
            slave.setFMUstate(kept[0])
            twin.restore(kept[1])
            now = kept[2]
    same()


def test_step_mean_is_the_mean_of_the_rate(open_slave):
    slave = open_slave("Wheel").begin()
    command, friction, speed, inertia = 0.2, 0.05, 0.2 / 0.4 + 0.5 * 0.1, 0.4
    offset = friction * 0.5
    torque = -(command - friction * speed) - 0.01 * math.sin(offset)
    assert_allclose(slave.get("torque"), [torque], rtol=1e-12)  # before the first step: the rate itself
    slave.exitInitializationMode()
    before = inertia * slave.get("speed")[0]
    slave.set({"command": 0.7})
    assert_allclose(slave.get("torque"), [torque], rtol=1e-12)  # frozen until the step
    for k in range(3):
        slave.doStep(0.3 * k, 0.3)
        after = inertia * slave.get("speed")[0]
        explicit = [0.01 * t * math.sin(s) for t, s in ((0.3 * k, offset), (0.3 * (k + 1), slave.get("offset")[0]))]
        assert_allclose(slave.get("torque"), [-(after - before + explicit[1] - explicit[0]) / 0.3], rtol=1e-12)
        before, offset = after, slave.get("offset")[0]


def test_tunable_parameter_between_steps(open_slave):
    slave = open_slave("Swing").start()
    slave.doStep(0.0, 0.01)
    slave.set({"stiffness": 3.0})
    assert slave.get("soft") == [1.5]
    omega, phase = slave.get("omega[2]", "phase")
    assert slave.get("applied[2]") == [-0.2 * math.cos(phase) + 1.5 * omega]
