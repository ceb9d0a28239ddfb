"""Native FMUs: rules of FMI 2.0, numbers against scipy, differences and the Python twin, state, samples, messages."""

import ctypes
import math
import shutil
import subprocess
import threading
import zipfile
from pathlib import Path

import fmpy
import numpy as np
import pytest
from fmpy.build import build_platform_binary
from fmpy.fmi1 import FMICallException
from fmpy.validation import validate_fmu
from numpy.testing import assert_allclose, assert_array_equal
from scipy.integrate import solve_ivp

from components.framework import Component, Condition, Output, Parameter, State
from components.framework.component import start_vector
from fmus.errors import BuildError
from fmus.interface import Interface
from fmus.native_fmu import build_native, native_sources
from fmus.runtime import Runtime
from fmus.toolchain import FLAGS, find_compiler, host_platform

from .fmi_rules import fmi_rule_breaches
from .parts import Gain, Integrator, Modes, Plain, Sum, Swing, Wheel, every
from .slaves import Slave, names_of, unpack

PARTS = every()
all_parts = pytest.mark.parametrize("name", PARTS)


@pytest.fixture(scope="session")
def fmus(tmp_path_factory):
    """A function: name of a part -> its FMU, built once and unpacked beside itself."""
    folder = tmp_path_factory.mktemp("native")
    built: dict[str, Path] = {}

    def fmu(name: str) -> Path:
        if name not in built:
            built[name] = build_native(PARTS[name], folder / f"{name}.fmu")
            unpack(built[name])
        return built[name]

    return fmu


@pytest.fixture
def open_slave(fmus):
    """A function: name of a part -> an instance, freed at the end of the test."""
    opened: list[Slave] = []

    def slave(name: str, instance: str = "unit") -> Slave:
        opened.append(Slave(fmus(name).with_suffix(""), instance))
        return opened[-1]

    yield slave
    for one in opened:
        one.freeInstance()


def refused(call, *arguments, **named) -> None:
    with pytest.raises(FMICallException) as caught:
        call(*arguments, **named)
    assert caught.value.status == 3


# ---- rules of FMI ---------------------------------------------------------------------------------------------------


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


# ---- numbers --------------------------------------------------------------------------------------------------------


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
            after = f.advance(0.0, after, u, [0, 0], [0, 0], p, f.calculate(p), i * (step / n), step / n)
        assert slave.get("omega[1]", "omega[2]", "phase") == after.full().ravel().tolist()


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


# ---- derivatives ----------------------------------------------------------------------------------------------------


def unknowns(slave: Slave, section: str) -> dict[int, set[int]]:
    """Value reference -> those that it depends on, of one section of ModelStructure."""
    listed = getattr(slave.description, section)
    return {u.variable.valueReference: {d.valueReference for d in u.dependencies} for u in listed}


@all_parts
def test_directional_derivatives_in_initialization_mode(open_slave, name):
    slave = open_slave(name).begin(start=0.4)
    wanted = unknowns(slave, "initialUnknowns")
    if not wanted:
        pytest.skip("nothing is calculated in initialization mode")
    variables = {v.valueReference: v for v in slave.description.modelVariables}
    known = [r for r, v in variables.items() if v.initial == "exact" or v.causality == "input"]
    known = [r for r in known if not variables[r].name.startswith(("solver.", "sample_time"))]
    rows = list(wanted)
    at = slave.getReal(known)
    for r, value in zip(known, at, strict=True):
        exact = slave.getDirectionalDerivative(rows, [r], [1.0])
        around = []
        for h in (1e-6, -1e-6):
            slave.setReal([r], [value + h])
            around.append(np.array(slave.getReal(rows)))
        slave.setReal([r], [value])
        assert_allclose(exact, (around[0] - around[1]) / 2e-6, rtol=2e-8, atol=2e-8, err_msg=variables[r].name)
        for row, number in zip(rows, exact, strict=True):
            assert number == 0 or r in wanted[row], f"{variables[row].name} depends on {variables[r].name}"
    weights = np.linspace(-1, 2, len(known))
    together = slave.getDirectionalDerivative(rows, known, weights)
    single = [slave.getDirectionalDerivative(rows, [r], [1.0]) for r in known]
    assert_allclose(together, weights @ np.array(single).reshape(len(known), len(rows)), rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("name", ["Swing", "Wheel", "Sum", "Gain", "Modes_2"])
def test_directional_derivatives_between_steps(open_slave, name):
    """By inputs against differences of the FMU, by states against differences of the component's functions."""
    part = PARTS[name]
    slave = open_slave(name).start()
    slave.doStep(0.0, 0.1)  # a tick of Sum
    wanted = unknowns(slave, "outputs") | unknowns(slave, "derivatives")
    rows = list(wanted)
    for r in slave.vr(*names_of(part, name, "u")):
        exact = slave.getDirectionalDerivative(rows, [r], [1.0])
        (value,), around = slave.getReal([r]), []
        for h in (1e-6, -1e-6):
            slave.setReal([r], [value + h])
            around.append(np.array(slave.getReal(rows)))
        slave.setReal([r], [value])
        assert_allclose(exact, (around[0] - around[1]) / 2e-6, rtol=2e-8, atol=2e-8)
        assert all(number == 0 or r in wanted[row] for row, number in zip(rows, exact, strict=True))
    f = part.functions
    p, c, u, x, y = (slave.get(*names_of(part, name, region)) for region in "pcuxy")
    m = [v for v, o in zip(y, part.outputs_declared, strict=True) if o.step_mean] if name == "Wheel" else []
    y_names, d_names = names_of(part, name, "y"), names_of(part, name, "d")
    for i, state in enumerate(names_of(part, name, "x")):
        around = []
        for h in (1e-6, -1e-6):
            moved = [*x[:i], x[i] + h, *x[i + 1 :]]
            shown = f.update(0.1, moved, u, p, c) if part.sampled else moved
            rates = f.rates(0.1, moved, u, p, c).full().ravel() if d_names else []
            around.append(np.concatenate([f.outputs(0.1, shown, u, p, c, m).full().ravel(), rates]))
        exact = slave.getDirectionalDerivative(slave.vr(*y_names, *d_names), slave.vr(state), [1.0])
        assert_allclose(exact, (around[0] - around[1]) / 2e-6, rtol=2e-8, atol=2e-8, err_msg=state)
    outputs = [
        n for n in names_of(part, name, "x") if slave.description.modelVariables[slave.vr(n)[0]].causality == "output"
    ]
    for n in outputs:
        assert slave.getDirectionalDerivative(slave.vr(n), slave.vr(n), [2.5]) == [2.5]


def test_directional_derivatives_of_a_sampled_unit_between_samples(open_slave):
    slave = open_slave("Sum").start()
    slave.doStep(0.0, 0.05)
    assert slave.getDirectionalDerivative(slave.vr("shown"), slave.vr("u"), [1.0]) == [0.0]
    slave.doStep(0.05, 0.05)
    derivative = slave.getDirectionalDerivative(slave.vr("shown"), slave.vr("u"), [1.0])
    assert_allclose(derivative, [4 * (1 + math.sin(0.1)) + 10], rtol=1e-12)


@pytest.mark.parametrize("name", ["Swing", "Gain", "Wheel"])
def test_output_derivatives(open_slave, name):
    """The trapezoidal rule over the output derivatives gives the change of the outputs; a step mean has none."""
    slave = open_slave(name).start()
    outputs = [v.name for v in slave.description.modelVariables if v.causality == "output" and v.name != "torque"]
    inputs = names_of(PARTS[name], name, "u")
    vr, ones, h = slave.vr(*outputs), [1] * len(outputs), 1e-3
    slave.setRealInputDerivatives(slave.vr(*inputs), [1] * len(inputs), [0.3] * len(inputs))
    slave.setRealInputDerivatives(slave.vr(*inputs), [2] * len(inputs), [-0.8] * len(inputs))
    before, rates_before = slave.getReal(vr), slave.getRealOutputDerivatives(vr, ones)
    slave.doStep(0.0, h)
    after, rates_after = slave.getReal(vr), slave.getRealOutputDerivatives(vr, ones)
    mean = (np.array(rates_before) + rates_after) / 2
    assert_allclose((np.array(after) - before) / h, mean, rtol=1e-6, atol=1e-6)
    assert np.ptp([rates_before, rates_after], axis=0).max() > 0
    if name == "Wheel":
        assert slave.getRealOutputDerivatives(slave.vr("torque"), [1]) == [0.0]


def test_input_interpolation_is_exact_for_an_integrator(open_slave):
    for orders in (1, 2):
        slave = open_slave("Integrator").start()
        u, u1, u2 = np.array([0.3, -0.2]), np.array([0.5, 0.4]), np.array([-0.7, 0.9]) * (orders == 2)
        x = np.zeros(2)
        vr = slave.vr("u[1]", "u[2]")
        for k, h in enumerate((0.1, 0.3, 0.05)):
            slave.setReal(vr, u)
            slave.setRealInputDerivatives(vr, [1, 1], u1)
            if orders == 2:
                slave.setRealInputDerivatives(vr, [2, 2], u2)
            slave.doStep((0, 0.1, 0.4)[k], h)
            x = x + u * h + u1 * h**2 / 2 + u2 * h**3 / 6
            u = u + u1 * h + u2 * h**2 / 2
            assert_allclose(slave.get("x[1]", "x[2]"), x, rtol=1e-13)
            assert_allclose(slave.getReal(vr), u, rtol=1e-14)  # inputs stay where the extrapolation ends
        slave.doStep(0.45, 0.1)  # derivatives hold for one step
        assert_allclose(slave.get("x[1]", "x[2]"), x + 0.1 * u, rtol=1e-13)


def test_input_derivatives_before_initialization(open_slave):
    slave = open_slave("Gain")
    slave.setRealInputDerivatives(slave.vr("u"), [1], [2.0])
    slave.begin()
    slave.setRealInputDerivatives(slave.vr("u"), [2], [4.0])
    assert slave.get("y") == [1.5]
    slave.exitInitializationMode()
    slave.doStep(0.0, 1.0)
    assert slave.get("u", "y") == [0.5 + 2.0 + 2.0, 3 * 4.5 * 2]


# ---- state ----------------------------------------------------------------------------------------------------------


def disturb(slave: Slave, inputs: list[str], k: int) -> None:
    """Set inputs, sometimes their derivatives too, in a way that depends on k."""
    slave.set({n: 0.01 * math.sin(k + i) for i, n in enumerate(inputs)})
    if inputs and k % 2:
        slave.setRealInputDerivatives(slave.vr(*inputs), [1] * len(inputs), [0.01 * k] * len(inputs))


@all_parts
def test_saved_state_gives_the_same_bits(open_slave, name):
    slave, other = open_slave(name), open_slave(name, "other")
    inputs, h = names_of(PARTS[name], name, "u"), 1e-3 if name == "Blowup" else 0.07
    slave.start()
    disturb(slave, inputs, 1)
    slave.doStep(0.0, h)
    disturb(slave, inputs, 3)
    state = slave.getFMUstate()
    data = slave.serializeFMUstate(state)

    def onwards(one: Slave) -> list[list[float]]:
        rows = []
        for k in range(1, 6):
            one.doStep(k * h, h)
            rows.append(one.everything())
            disturb(one, inputs, k)
        return rows

    first = onwards(slave)
    slave.setFMUstate(state)
    assert slave.serializeFMUstate(slave.getFMUstate()) == data
    assert onwards(slave) == first
    other.setFMUstate(other.deSerializeFMUstate(data))  # an instance that was never initialised
    assert onwards(other) == first
    slave.freeFMUstate(state)
    assert state.value is None


def test_state_holds_the_mode(open_slave):
    slave = open_slave("Swing").begin()
    state = slave.getFMUstate()
    slave.exitInitializationMode()
    slave.doStep(0.0, 0.1)
    slave.setFMUstate(state)
    slave.set({"drive": 0.5})
    slave.exitInitializationMode()
    slave.doStep(0.0, 0.1)


def test_failed_step_can_be_taken_back(open_slave):
    slave = open_slave("Blowup").start()
    slave.doStep(0.0, 0.05)
    state, before = slave.getFMUstate(), slave.get("x[2]")
    refused(slave.doStep, 0.05, 0.5)
    slave.setFMUstate(state)
    slave.doStep(0.05, 0.01)
    assert slave.get("x[2]") > before


@all_parts
def test_reset_restores_everything(open_slave, name):
    slave, fresh = open_slave(name), open_slave(name, "fresh").start()
    inputs = names_of(PARTS[name], name, "u")
    blank = slave.serializeFMUstate(slave.getFMUstate())
    slave.start(start=3.0, stop=9.0)
    disturb(slave, inputs, 1)
    slave.doStep(3.0, 1e-3)
    slave.reset()
    assert slave.serializeFMUstate(slave.getFMUstate()) == blank
    slave.start()
    for one in (slave, fresh):
        one.doStep(0.0, 1e-3)
    assert slave.everything() == fresh.everything()


@all_parts
def test_instances_do_not_disturb_each_other(open_slave, name):
    """Two instances in two threads give what each gives alone."""
    inputs, h = names_of(PARTS[name], name, "u"), 1e-4 if name == "Blowup" else 0.03

    def run(slave: Slave, seed: int, rows: list) -> None:
        slave.start()
        for k in range(200):
            disturb(slave, inputs, k + seed)
            slave.doStep(k * h, h)
            rows.append(slave.everything())

    alone: list[list] = [[], []]
    for i in (0, 1):
        run(open_slave(name), i, alone[i])
    together: list[list] = [[], []]
    slaves = [open_slave(name, str(i)) for i in (0, 1)]
    threads = [threading.Thread(target=run, args=(slaves[i], i, together[i])) for i in (0, 1)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert together == alone


# ---- samples --------------------------------------------------------------------------------------------------------


class Rule:
    """What Sum has to do, in other words: a list of ticks, counted in units of time that are whole numbers."""

    def __init__(self, period: int, unit: float):
        self.period, self.unit, self.tick = period, unit, 0
        self.total, self.last, self.shown = 0.5, 0.25 * 2.0, math.nan

    def sample(self, time: int, u: float) -> tuple[float, float, float]:
        total = self.total + 4 * u + 0.1 * self.last
        return total, u, total * (1 + math.sin(time * self.unit)) + 10 * u

    def commit(self, time: int, u: float) -> None:
        assert time == self.tick * self.period
        self.total, self.last, self.shown = self.sample(time, u)
        self.tick += 1

    def output(self, time: int, u: float) -> float:
        """What is to be read at a communication point: the sample that is due, or what is held."""
        return self.sample(time, u)[2] if time == self.tick * self.period else self.shown


@pytest.mark.parametrize("commit_shown", [0, 1])
@pytest.mark.parametrize("ramp", [0.0, 0.7])
@pytest.mark.parametrize("step", [10, 30, 5, 4, 7, 13, 2], ids=lambda n: f"{n / 10:g}T")
def test_samples(open_slave, step, ramp, commit_shown):
    """Steps of multiples, fractions and any other ratio of the sample time, inputs held or moving."""
    unit = 0.01
    rule = Rule(period=10, unit=unit)
    slave = open_slave("Sum").begin()
    slave.set({"solver.commit_shown": commit_shown})
    slave.exitInitializationMode()
    now, u = 0, 0.25
    for k in range(40):
        shown_with = u
        if k % 2:  # what is committed does not hang on anybody reading it
            assert_allclose(slave.get("shown", "total"), [rule.output(now, u), rule.total], rtol=1e-12)
        u = math.sin(k)
        slave.set({"u": u})
        if k % 3 == 0:  # outputs follow a set where a sample is due, and only there
            shown_with = u
            assert_allclose(slave.get("shown"), [rule.output(now, u)], rtol=1e-12)
        if ramp:
            slave.setRealInputDerivatives(slave.vr("u"), [1], [ramp])
        slave.doStep(now * unit, step * unit)
        for time in range(now, now + step):
            if time == rule.tick * rule.period:
                at_point = shown_with if commit_shown else u
                rule.commit(time, at_point if time == now else u + ramp * (time - now) * unit)
        now, u = now + step, u + ramp * step * unit


def test_a_sample_just_before_or_after_its_tick(open_slave):
    """Communication points that miss the tick by less than 1 ns."""
    for miss in (-4e-10, 4e-10):
        slave = open_slave("Sum").start()
        slave.set({"u": 0.0})
        slave.doStep(0.0, 0.1 + miss)
        slave.set({"u": 3.0})
        slave.doStep(0.1 + miss, 0.05)
        assert slave.get("last") == [3.0]


def test_sample_zero_is_due_at_any_start_time(open_slave):
    slave = open_slave("Clock").start(start=100.05)
    assert slave.get("y") == [100.05]
    slave.doStep(100.05, 0.3)
    assert_allclose(slave.get("y"), [100.3], rtol=1e-15)


# ---- messages -------------------------------------------------------------------------------------------------------


def test_setting_is_refused_by_name(open_slave):
    slave = open_slave("Swing")
    for name in ("J_inverse[1,1]", "energy", "der(phase)"):
        refused(slave.set, {name: 1.0})
        assert slave.messages.pop() == f"fmi2SetReal: variable {name} cannot be set now."
    refused(slave.set, {"drive": 5.0, "omega[2]": math.nan})
    assert slave.messages.pop() == "fmi2SetReal: variable omega[2] = nan is not finite."
    slave.start()
    assert slave.get("drive") == [0.9]  # nothing of a refused call was taken
    for name in ("J[1,2]", "phase", "drive"):
        refused(slave.set, {name: 1.0})
        assert slave.messages.pop() == f"fmi2SetReal: variable {name} cannot be set now."
    refused(slave.set, {"torque[1]": math.inf})
    assert slave.messages.pop() == "fmi2SetReal: variable torque[1] = inf is not finite."
    for call in (slave.getReal, lambda vr: slave.setReal(vr, [0.0])):
        refused(call, [999])
        assert slave.messages.pop().endswith(": there is no Real variable with value reference 999.")
    wheel = open_slave("Wheel")
    refused(wheel.set, {"speed": 1.0})
    assert wheel.messages == ["fmi2SetReal: variable speed cannot be set now."]


def test_other_types_do_not_exist(open_slave):
    slave = open_slave("Gain").start()
    slave.getInteger([])
    for get, set_, name, value in (
        (slave.getInteger, slave.setInteger, "Integer", 1),
        (slave.getBoolean, slave.setBoolean, "Boolean", True),
        (slave.getString, slave.setString, "String", "a"),
    ):
        refused(get, [0])
        assert slave.messages.pop() == f"fmi2Get{name}: all variables of Gain are Real."
        refused(set_, [0], [value])
        assert slave.messages.pop() == f"fmi2Set{name}: all variables of Gain are Real."


def test_conditions(open_slave):
    slave = open_slave("Swing").begin()
    slave.set({"J[1,2]": 30.0, "drive": -2.0})
    refused(slave.exitInitializationMode)
    assert slave.messages == [
        "Swing: J is not positive definite (determinant -6 kg2.m4, J[1,1] = 2).",
        'Swing: drive = -2 1/s must be positive, "100 %" sure.',
    ]
    refused(slave.doStep, 0.0, 0.1)
    assert slave.messages[-1] == "fmi2DoStep: not allowed after an error."
    assert slave.get("drive") == [-2.0]
    slave.reset()
    slave.start()


def test_condition_that_is_no_number(open_slave):
    """0 / 0 is not > 0."""
    slave = open_slave("Swing").begin()
    slave.set({"J[1,1]": 1e300, "J[2,2]": 1e300, "J[1,2]": 1e300, "J[2,1]": 1e300})
    refused(slave.exitInitializationMode)
    assert "J is not positive definite (determinant " in slave.messages[0]


class Braces(Component):
    """A component without any variable that moves."""

    k = Parameter(unit="1", start=-1.0, doc="number")
    y = Output(unit="1", doc="the same")

    def outputs(self, t, x, u, p):
        return {"y": p.k}

    def check(self, t, x, u, p):
        return [Condition(p.k, "{{k}} = {} ??/ \\ Ω %d", (p.k,))]


def test_text_of_a_condition_is_taken_as_it_is(tmp_path):
    slave = Slave(unpack(build_native(Braces(), tmp_path / "Braces.fmu"))).begin()
    refused(slave.exitInitializationMode)
    assert slave.messages == ["Braces: {k} = -1 ??/ \\ Ω %d"]
    slave.freeInstance()


def test_step_is_refused(open_slave):
    slave = open_slave("Swing").start(stop=1.0)
    for t, step, text in (
        (0.0, 0.0, "fmi2DoStep: step 0 s is not positive."),
        (0.0, -0.1, "fmi2DoStep: step -0.1 s is not positive."),
        (0.0, math.nan, "fmi2DoStep: step nan s is not positive."),
        (0.0, math.inf, "fmi2DoStep: step inf s is not positive."),
        (1e-8, 0.1, "fmi2DoStep: asked to start at 1e-08 s, the FMU is at 0 s."),
        (math.nan, 0.1, "fmi2DoStep: asked to start at nan s, the FMU is at 0 s."),
        (0.0, 1.1, "fmi2DoStep: a step to 1.1000000000000001 s passes the stop time 1 s."),
    ):
        refused(slave.doStep, t, step)
        assert slave.messages.pop() == text
    for largest in (0.0, -1.0, 1e-12):
        slave.set({"solver.step": largest})
        refused(slave.doStep, 0.0, 0.1)
        assert slave.messages.pop() == f"fmi2DoStep: solver.step = {largest:g} s does not suit a step of 0.1 s."
    slave.set({"solver.step": 0.1})
    for k in range(10):
        slave.doStep(k * 0.1, 0.1)  # a refused step leaves the FMU as it was
    refused(slave.doStep, 1.0, 1e-3)
    sampled = open_slave("Sum").begin()
    sampled.set({"sample_time": 1e-12})
    sampled.exitInitializationMode()
    refused(sampled.doStep, 0.0, 0.1)
    assert sampled.messages == ["fmi2DoStep: sample_time = 1e-12 s does not suit a step of 0.1 s."]


def test_sample_time_is_refused(open_slave):
    for period in (0.0, -1.0):
        slave = open_slave("Sum").begin()
        slave.set({"sample_time": period})
        refused(slave.exitInitializationMode)
        assert slave.messages == [f"Sum: sample_time = {period:g} s is not positive."]


def test_a_state_that_is_not_finite(open_slave):
    slave = open_slave("Blowup").start()
    slave.doStep(0.0, 0.05)
    refused(slave.doStep, 0.05, 0.5)
    assert slave.messages == ["fmi2DoStep: state x[2] is not finite at 0.55 s."]
    assert slave.get("x[1]") == [0.0]
    assert not math.isfinite(slave.get("x[2]")[0])
    assert slave.getRealStatus(2) == 0.05  # fmi2LastSuccessfulTime
    refused(slave.doStep, 0.55, 0.1)
    assert slave.messages[-1] == "fmi2DoStep: not allowed after an error."
    refused(slave.set, {"bias": 1.0})
    assert slave.messages[-1] == "fmi2SetReal: not allowed after an error."
    slave.terminate()


def test_call_order(open_slave):
    slave = open_slave("Swing")

    def says(text, call, *arguments, **named):
        refused(call, *arguments, **named)
        assert slave.messages.pop() == text

    says("fmi2DoStep: not allowed before initialization mode.", slave.doStep, 0.0, 0.1)
    says("fmi2GetReal: not allowed before initialization mode.", slave.get, "phase")
    says("fmi2ExitInitializationMode: not allowed before initialization mode.", slave.exitInitializationMode)
    says("fmi2SetupExperiment: start time = nan is not finite.", slave.setupExperiment, startTime=math.nan)
    says(
        "fmi2SetupExperiment: stop time 1 s is not after start time 2 s.",
        lambda: slave.setupExperiment(startTime=2.0, stopTime=1.0),
    )
    slave.begin()
    says("fmi2DoStep: not allowed in initialization mode.", slave.doStep, 0.0, 0.1)
    says("fmi2SetupExperiment: not allowed in initialization mode.", slave.setupExperiment)
    says("fmi2EnterInitializationMode: not allowed in initialization mode.", slave.enterInitializationMode)
    slave.exitInitializationMode()
    says("fmi2EnterInitializationMode: not allowed after initialization.", slave.enterInitializationMode)
    says("fmi2ExitInitializationMode: not allowed after initialization.", slave.exitInitializationMode)
    says("fmi2CancelStep: fmi2DoStep returns when the step is done, there is nothing to cancel.", slave.cancelStep)
    assert slave.getBooleanStatus(3) is False  # fmi2Terminated
    for call in (
        slave.getStatus,
        slave.getIntegerStatus,
        slave.getStringStatus,
        slave.getRealStatus,
        slave.getBooleanStatus,
    ):
        with pytest.raises(FMICallException) as caught:
            call(0)
        assert caught.value.status == 2
    slave.setDebugLogging(True, ["logAll"])
    slave.terminate()
    says("fmi2DoStep: not allowed after fmi2Terminate.", slave.doStep, 0.0, 0.1)
    slave.get("energy")


def test_derivatives_are_refused_by_name(open_slave):
    slave = open_slave("Swing")

    def says(text, call, *arguments):
        refused(call, *arguments)
        assert slave.messages.pop() == text

    function = "fmi2GetDirectionalDerivative"
    slave.begin()
    says(
        f"{function}: energy is not a known in initialization mode.",
        slave.getDirectionalDerivative,
        [],
        slave.vr("energy"),
        [1.0],
    )
    says(
        f"{function}: phase is not an unknown in initialization mode.",
        slave.getDirectionalDerivative,
        slave.vr("phase"),
        [],
        [],
    )
    slave.exitInitializationMode()
    says(
        f"{function}: drive is not a known after initialization.",
        slave.getDirectionalDerivative,
        [],
        slave.vr("drive"),
        [1.0],
    )
    says(
        f"{function}: soft is not an unknown after initialization.",
        slave.getDirectionalDerivative,
        slave.vr("soft"),
        [],
        [],
    )
    says(f"{function}: (none) is not a known after initialization.", slave.getDirectionalDerivative, [], [999], [1.0])
    function = "fmi2SetRealInputDerivatives"
    text = "inputs, order 1 or 2 only."
    says(f"{function}: variable phase, order 1: {text}", slave.setRealInputDerivatives, slave.vr("phase"), [1], [0.0])
    says(
        f"{function}: variable torque[2], order 3: {text}",
        slave.setRealInputDerivatives,
        slave.vr("torque[2]"),
        [3],
        [0.0],
    )
    text = f"{function}: variable torque[2] = nan is not finite."
    says(text, slave.setRealInputDerivatives, slave.vr("torque[2]"), [1], [math.nan])
    function = "fmi2GetRealOutputDerivatives"
    says(
        f"{function}: variable phase, order 1: outputs, order 1 only.",
        slave.getRealOutputDerivatives,
        slave.vr("phase"),
        [1],
    )
    says(
        f"{function}: variable energy, order 2: outputs, order 1 only.",
        slave.getRealOutputDerivatives,
        slave.vr("energy"),
        [2],
    )
    slave = open_slave("Sum").start()
    text = f"{function}: variable shown, order 1: sampled outputs have no derivatives."
    says(text, slave.getRealOutputDerivatives, slave.vr("shown"), [1])


def test_foreign_states_are_refused(open_slave):
    swing, wheel = open_slave("Swing").start(), open_slave("Wheel").start()
    data = swing.serializeFMUstate(swing.getFMUstate())
    for bad in (b"", b"x", data[:-1], data + b"\0", b"X" + data[1:], data[:8] + b"\7" + data[9:]):
        refused(swing.deSerializeFMUstate, bad)
        assert swing.messages.pop().startswith("fmi2DeSerializeFMUstate: ")
    refused(wheel.deSerializeFMUstate, data)
    assert wheel.messages.pop().startswith(
        "fmi2DeSerializeFMUstate: the state was saved by another FMU than Wheel, GUID {"
    )
    refused(swing.fmi2SerializeFMUstate, swing.component, swing.getFMUstate(), ctypes.create_string_buffer(3), 3)
    assert swing.messages.pop().startswith("fmi2SerializeFMUstate: 3 bytes, needed are ")
    for call, name in ((swing.setFMUstate, "Set"), (swing.serializeFMUstate, "Serialize")):
        refused(call, None)
        assert swing.messages.pop() == f"fmi2{name}FMUstate: there is no state."


def test_instantiation_is_refused(fmus):
    folder = fmus("Gain").with_suffix("")
    with pytest.raises(Exception, match="Failed to instantiate"):
        Slave(folder, guid="{other}")
    with pytest.raises(Exception, match="Failed to instantiate"):
        Slave(folder, name="")


# ---- what is built --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["Swing", "Sum"])
def test_rebuild_is_byte_identical(fmus, tmp_path, name):
    again = build_native(type(PARTS[name])(), tmp_path / "elsewhere" / f"{name}.fmu")
    assert again.read_bytes() == fmus(name).read_bytes()


def test_guid_follows_interface_and_equations():
    class Doubled(Gain):
        """Another equation."""

        def outputs(self, t, x, u, p):
            return {"y": 2 * p.k * u.u * (1 + t)}

    def guid(component, name="Gain"):
        header = native_sources(Interface(component, name, derivatives=True))["model.h"].decode()
        return header.partition("MODEL_GUID ")[2]

    guids = [guid(Gain()), guid(Gain(k=4.0)), guid(Gain(), "Other"), guid(Doubled())]
    assert len(set(guids)) == 4
    assert guid(Gain()) == guids[0]


def test_content_of_an_fmu(fmus):
    with zipfile.ZipFile(fmus("Swing")) as archive:
        names = archive.namelist()
        assert all(entry.date_time == (1980, 1, 1, 0, 0, 0) for entry in archive.infolist())
        headers = [archive.read(n).decode() for n in names if n.startswith("sources/fmi2") and n.endswith(".h")]
    suffix = {"linux64": "so", "win64": "dll", "darwin64": "dylib"}[host_platform()]
    assert names[0] == "modelDescription.xml"
    assert f"binaries/{host_platform()}/Swing.{suffix}" in names
    assert len(headers) == 3
    assert all("2-Clause BSD License" in text and "Modelica Association" in text for text in headers)


@all_parts
def test_sources_compile_without_a_warning(fmus, tmp_path, name):
    folder = fmus(name).with_suffix("") / "sources"
    command = [
        *find_compiler(),
        *FLAGS,
        "-Wall",
        "-Wextra",
        "-Wpedantic",
        "-Werror",
        "fmi2.c",
        "-o",
        str(tmp_path / "out"),
        "-lm",
    ]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")


@pytest.mark.skipif(host_platform() != "linux64" or not shutil.which("nm"), reason="nm reads the libraries of Linux")
@all_parts
def test_symbols(fmus, name):
    """Only fmi2 functions are exported; nothing is needed but libc and libm."""
    library = fmus(name).with_suffix("") / "binaries" / "linux64" / f"{name}.so"
    listed = subprocess.run(["nm", "-D", str(library)], capture_output=True, text=True, check=True).stdout.split("\n")
    entries = [line.split()[-2:] for line in listed if line]
    exported = {n for kind, n in entries if kind not in "Uw"}
    assert {n[:4] for n in exported} == {"fmi2"}
    co_simulation = {n for n in dir(fmpy.fmi2.FMU2Slave) if n.startswith("fmi2")}
    assert co_simulation <= exported
    needed = {n.partition("@")[0] for kind, n in entries if kind == "U"}
    own = ctypes.CDLL(None)
    maths = ctypes.CDLL("libm.so.6")
    assert [n for n in needed if not (hasattr(own, n) or hasattr(maths, n))] == []
    assert not needed & {"realloc", "printf", "abort", "exit"}


def test_sources_rebuild_the_binary(fmus, tmp_path):
    """With fmpy and CMake where there is one, else by hand: the same numbers come out."""
    folder = tmp_path / "Swing"
    shutil.copytree(fmus("Swing").with_suffix(""), folder)
    shutil.rmtree(folder / "binaries")
    if shutil.which("cmake"):
        build_platform_binary(folder, all_warnings=True)
    else:
        library = folder / "binaries" / host_platform() / f"Swing{fmpy.sharedLibraryExtension}"
        library.parent.mkdir(parents=True)
        command = [*find_compiler(), "-shared", "-fPIC", "-O1", "sources/fmi2.c", "-o", str(library), "-lm"]
        subprocess.run(command, cwd=folder, check=True)
    rows = []
    for place in (folder, fmus("Swing").with_suffix("")):
        slave = Slave(place).start()
        slave.doStep(0.0, 0.5)
        rows.append(slave.everything())
        slave.freeInstance()
    assert_array_equal(*rows)


def test_only_existing_functions_are_generated():
    code = {n: native_sources(Interface(c, n, derivatives=True))["model.c"].decode() for n, c in PARTS.items()}
    assert " rates(" not in code["Gain"] and " advance(" not in code["Gain"]
    assert " outputs(" not in code["Autonomous"]
    assert " update(" in code["Sum"] and " update(" not in code["Swing"]
    assert code["Swing"].count("/* rates:") == 1  # advance calls the one that is exported


def test_refusals(tmp_path):
    with pytest.raises(BuildError, match=r"Plain is written in plain Python.*--backend python"):
        build_native(Plain(), tmp_path / "Plain.fmu")
    with pytest.raises(BuildError, match=r"'my-unit' is none"):
        build_native(Gain(), tmp_path / "my-unit.fmu")
    with pytest.raises(BuildError, match=r"unknown platform 'beos'. Platforms: host, all, linux64, win64, darwin64"):
        build_native(Gain(), tmp_path / "Gain.fmu", platforms=("beos",))
    assert list(tmp_path.iterdir()) == []


class Numbers(Braces):
    """A text with another number of fields than numbers."""

    def check(self, t, x, u, p):
        return [Condition(p.k, "{} and {}", (p.k,))]


class Momentless(Component):
    """A step mean without a continuous state."""

    y = Output(unit="1/s", step_mean=True, doc="rate of nothing")

    def step_means(self, t, x, p):
        return {"y": t}


def test_components_that_contradict_themselves(tmp_path):
    with pytest.raises(BuildError, match=r"has not one \{\} for each of the 1 numbers"):
        build_native(Numbers(), tmp_path / "Numbers.fmu")
    with pytest.raises(BuildError, match="there are no continuous states"):
        build_native(Momentless(), tmp_path / "Momentless.fmu")


def test_an_fmu_may_have_another_name(tmp_path):
    slave = Slave(unpack(build_native(Gain(), tmp_path / "small.fmu", model_name="Amplifier"))).start()
    assert slave.description.modelName == slave.description.coSimulation.modelIdentifier == "Amplifier"
    slave.freeInstance()


def test_zero_size_arrays_are_nowhere(fmus):
    """Modes_0 has states, parameters, inputs and outputs of size zero, and solver.step."""
    slave = Slave(fmus("Modes_0").with_suffix("")).start()
    slave.doStep(0.0, 1.0)
    assert slave.everything() == [1e-3]
    slave.freeInstance()


def test_parts_cover_what_can_be_declared():
    """A reminder for whoever adds a kind of variable: Sum, Wheel and Swing are what is tested above."""
    assert {
        type(v) for c in (Swing(), Wheel(), Sum(), Integrator(), Modes(modes=1)) for v in c._variables.values()
    } == {
        Parameter,
        Output,
        State,
        *{type(v) for v in (*Swing().calculated_parameters, *Swing().inputs)},
    }
