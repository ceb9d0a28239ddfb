"""Native FMUs: directional and output derivatives, interpolation of inputs."""

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose

from .parts import every
from .slaves import Slave, names_of

PARTS = every()
all_parts = pytest.mark.parametrize("name", PARTS)


def unknowns(slave: Slave, section: str) -> dict[int, set[int]]:
    """Value reference -> those that it depends on, of one section of ModelStructure."""
    listed = getattr(slave.description, section)
    return {u.variable.valueReference: {d.valueReference for d in u.dependencies} for u in listed}


@pytest.mark.parametrize("name", sorted(set(PARTS) - {"Integrator", "Modes_0"}))  # these calculate nothing then
def test_directional_derivatives_in_initialization_mode(open_slave, name):
    slave = open_slave(name).begin(start=0.4)
    wanted = unknowns(slave, "initialUnknowns")
    assert wanted
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


def test_output_derivatives_follow_whatever_changes_them(open_slave):
    """Asked again after an input, its slope, a step, a saved state, against a twin that has never been asked before."""
    part = PARTS["Swing"]
    shown = names_of(part, "Swing", "y")
    asked = open_slave("Swing").start()
    done = []

    def change(*call):
        getattr(asked, call[0])(*call[1:])
        done.append(call)
        fresh = open_slave("Swing").start()
        for name, *arguments in done:
            getattr(fresh, name)(*arguments)
        orders = [1] * len(shown)
        found, expected = (u.getRealOutputDerivatives(u.vr(*shown), orders) for u in (asked, fresh))
        assert list(found) == list(expected)
        assert asked.getReal(asked.vr(*shown)) == fresh.getReal(fresh.vr(*shown))
        return list(found)

    torque = asked.vr("torque[1]")
    seen = [change("doStep", 0.0, 0.1)]
    state = asked.getFMUState()
    seen.append(change("setReal", torque, [0.7]))
    seen.append(change("setRealInputDerivatives", torque, [1], [0.3]))
    seen.append(change("setRealInputDerivatives", torque, [1], [0.4]))
    seen.append(change("doStep", 0.1, 0.1))
    assert len({tuple(slopes) for slopes in seen}) == len(seen)
    asked.setFMUState(state)
    assert list(asked.getRealOutputDerivatives(asked.vr(*shown), [1] * len(shown))) == seen[0]


def test_input_interpolation_is_exact_for_an_integrator(open_slave):
    for orders in (1, 2, 3):
        slave = open_slave("Integrator").start()
        u, u1 = np.array([0.3, -0.2]), np.array([0.5, 0.4])
        u2, u3 = np.array([-0.7, 0.9]) * (orders > 1), np.array([2.1, -1.3]) * (orders > 2)
        x = np.zeros(2)
        vr = slave.vr("u[1]", "u[2]")
        for k, h in enumerate((0.1, 0.3, 0.05)):
            slave.setReal(vr, u)
            for order, derivative in ((1, u1), (2, u2), (3, u3))[:orders]:
                slave.setRealInputDerivatives(vr, [order, order], derivative)
            slave.doStep((0, 0.1, 0.4)[k], h)
            x = x + u * h + u1 * h**2 / 2 + u2 * h**3 / 6 + u3 * h**4 / 24
            u = u + u1 * h + u2 * h**2 / 2 + u3 * h**3 / 6
            assert_allclose(slave.get("x[1]", "x[2]"), x, rtol=1e-13)
            # inputs stay where the extrapolation ends, to some roundings of terms of size 1 that may cancel
            assert_allclose(slave.getReal(vr), u, rtol=1e-14, atol=1e-15)
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
