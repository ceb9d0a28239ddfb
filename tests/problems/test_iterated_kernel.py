"""The iterated master in the kernel is that in Python, bit for bit; and the Jacobian that both begin with."""

from dataclasses import replace

import casadi as ca
import numpy as np
import pytest
from numpy.testing import assert_allclose

from components.framework import Component, Input, Output, Parameter
from cosim.masters.implicit import differences, sensitivity
from cosim.masters.implicit.iterating import Iterating, Saved
from cosim.masters.initialization.initialize import Initialization
from cosim.masters.iterated import Iterated
from cosim.masters.slots import Slots
from cosim.masters.steps import Step
from cosim.slaves.fmi2 import FmuSlave
from cosim.slaves.ready import Span
from cosim.system.expand import wire
from cosim.time import Schedule
from fmus.export.build import build

from ..cosim import both
from .pointing import Axis, Law
from .two_mass import Mass, MassAndSpring

MASSES = [("two.x_2", "one.x_2"), ("one.f", "two.f")]
POINTING = [("axis.theta", "law.theta"), ("axis.w", "law.w"), ("law.u", "axis.u")]


class Relay(Component):
    """A law of one torque against the rate, either way, that goes from one to the other within little."""

    torque = Parameter(unit="N.m", start=5.0, doc="torque")
    gain = Parameter(unit="1", start=1e4, doc="how steeply it goes over")
    theta = Input(unit="rad", doc="angle")
    w = Input(unit="rad/s", doc="rate")
    u = Output(unit="N.m", doc="torque")

    def outputs(self, t, x, u, p):
        return {"u": -p.torque * ca.tanh(p.gain * (u.theta + 2 * u.w - 0.05))}


class Counted(Iterating):
    """The loop in Python, which counts how often it is called."""

    calls = 0

    def advance(self, point, until):
        Counted.calls += 1
        return super().advance(point, until)


@pytest.fixture(scope="module")
def fmus(tmp_path_factory):
    folder = tmp_path_factory.mktemp("iterated")
    parts = {"one": MassAndSpring(), "two": Mass(), "axis": Axis(), "law": Law(), "relay": Relay()}
    return {name: build(part, folder / f"{name}.fmu") for name, part in parts.items()}


def masses(fmus):
    return both.of({"one": fmus["one"], "two": fmus["two"]}, MASSES)


@pytest.mark.parametrize("inputs", ["smooth", "ramp"])
@pytest.mark.parametrize("step", [1e-2, 7e-2])
def test_the_same_bits(fmus, inputs, step):
    for system in (masses(fmus), both.of({"law": fmus["law"], "axis": fmus["axis"]}, POINTING)):
        setup = both.experiment(stop=1.0, step=step)
        result = both.fly(system, replace(setup, master=Iterated(inputs)))
        assert result.info["loop"]["evaluations"] > len(result) - 1


def test_the_same_bits_where_the_kernel_leaves_steps_to_python(fmus, monkeypatch):
    """The loop's gain on the switching line is 2 h / J 5 N.m 1e4 = 50: Newton's method with an old Jacobian fails."""
    monkeypatch.setattr("cosim.masters.kernel.iterated.Iterating", Counted)
    system = both.of({"law": fmus["relay"], "axis": fmus["axis"]}, POINTING)
    setup = replace(both.experiment(stop=4.0, step=0.05), master=Iterated())
    result = both.fly(system, setup)
    assert (np.abs(np.diff(result["law.u"])) > 0.1).any()
    assert 1 < Counted.calls < len(result) - 1


def test_the_jacobian_from_directional_derivatives_is_that_of_the_steps(fmus):
    """Both units are linear: what is left out is A^3 h^3 / 4! and on, A 33.5 rad/s; differences err by 1e-6."""
    slaves = {name: FmuSlave(name, fmus[name]) for name in ("one", "two")}
    master, h = Iterated(), 2e-3
    timed = master.timed(wire(masses(fmus), {name: slave.description for name, slave in slaves.items()}))
    course = master.course(timed, Schedule.of(0.0, h, h, 1), ["*"])
    point = Initialization.of(timed, course.layout).start(slaves, 0.0)
    (loop,) = course.plan.loops
    slots, stepped = Slots(course.layout), False
    slots.put(replace(point, newest=point.values.copy()))
    span, turns = Span(), course.plan.turns.all
    steps = [Step(turn, slaves[turn.component.name], slots, span, fresh=True) for turn in turns]
    with Saved(list(slaves.values())) as saved:

        def evaluate(x):
            nonlocal stepped
            if stepped:
                saved.restore()
            stepped = True
            slots.newest[loop.slots] = x
            for place in loop.turns:
                steps[place].take(0, 0.0, h)
            return slots.newest[loop.slots]

        x = point.values[loop.slots]
        result = evaluate(x)
        derived = sensitivity.jacobian(loop.members, loop.slots, course.layout.size, slaves, h)
        found = differences.jacobian(loop, x, result, h, evaluate)
    assert len(loop.slots) == 2 and loop.members
    scale = np.abs(found).max(axis=1, keepdims=True)
    assert_allclose(derived / scale, found / scale, atol=(33.5 * h) ** 3 / 24 + 1e-6)
    for slave in slaves.values():
        slave.free()
