"""Where values have their places: without any order, an own slot for each connected input."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from cosim.errors import CyclicOrder
from cosim.masters.explicit import Explicit
from cosim.masters.layout import Layout
from cosim.masters.turns import Turns
from cosim.system import graph
from cosim.system.wiring import Port
from cosim.time import Schedule

from .. import both
from ..fakes import Gain, Integrator, describe
from ..flights import run
from ..typed_fmu import NAMES, typed
from ..wired import wired

CYCLE = [("a.y", "b.u", "ramp"), ("b.y", "c.u", "ramp"), ("c.y", "a.u", "ramp")]


def cyclic():
    slaves = [Integrator(name, can_interpolate_inputs=True) for name in "abc"]
    return wired(CYCLE, slaves, held={})


def test_a_cycle_of_ramps_has_a_layout_though_no_order():
    wiring = cyclic()
    with pytest.raises(CyclicOrder):
        graph.stepping_order(wiring)
    layout = Layout.of(wiring)
    assert [c.name for c in layout.components] == ["a", "b", "c"]
    assert layout.columns.names == ("a.u", "a.y", "b.u", "b.y", "c.u", "c.y")
    with pytest.raises(CyclicOrder):
        Turns.of(wiring, layout, Schedule.of(0, 1, 0.1, 1))
    with pytest.raises(CyclicOrder):
        Explicit().course(wiring, Schedule.of(0, 1, 0.1, 1), ("*",))


@pytest.mark.parametrize(("extrapolation", "told"), [(0, 0), (1, 0), (1, 1), (2, 1), (2, 2)])
def test_every_variable_has_a_slot_of_its_own(extrapolation, told):
    slaves = [Integrator(n, max_output_derivative_order=told, can_interpolate_inputs=True) for n in "abcde"]
    for slave in slaves:
        slave.description = replace(slave.description, max_input_derivative_order=2)
    links = [("a.y", "b.u"), ("b.y", "c.u"), ("c.y", "a.u"), ("a.y", "d.u", "at_point")]
    layout = Layout.of(Explicit(extrapolation=extrapolation).timed(wired(links, slaves, held={"e.u": 3.0})))
    differences = [c.outputs.differences for c in layout.components if c.outputs.differences is not None]
    taken = [*layout.slots.values(), *layout.derivative_slots.values()]
    taken += [slot for d in differences for slot in (*d.before, d.step)]
    assert sorted(taken) == list(range(layout.size))
    # outputs, inputs; the slopes of the three sources: as told, or by differences, with the last value and step
    assert layout.size == 5 + 5 + 3 * (min(extrapolation, told) if told else 3 if extrapolation else 0)
    assert layout.slots[Port("a", "u")] != layout.slots[Port("c", "y")]
    assert layout.slots[Port("b", "u")] != layout.slots[Port("d", "u")]  # both from a.y
    assert layout.constants == (3.0,) and layout.slots[Port("e", "u")] == layout.held


def test_slots_of_a_component_s_outputs_are_side_by_side_type_by_type(tmp_path):
    """Kernel and loop read each kind in one call, into consecutive slots; output derivatives follow."""
    from cosim import flights

    held = {"a.r_in": 0.0, "a.i_in": 0, "a.b_in": False, "a.e_in": 1, "a.s_in": ""}
    with flights.prepare(both.of({"a": typed(tmp_path)}, [], held=held)) as prepared:
        layout = prepared._plan(both.experiment(), None, ("*",)).course.layout
    (component,) = layout.components
    groups = component.outputs.groups
    assert [group.kind.name for group in groups] == ["REAL", "INTEGER", "BOOLEAN", "STRING"]
    assert [len(group.references) for group in groups] == [2, 4, 2, 2]  # Integer and Enumeration are read as one
    assert_array_equal(np.concatenate([g.slots for g in groups]), np.arange(10))


def test_what_an_input_shows_is_its_source_converted():
    """mN.m into N.m: factor 1e-3; the value comes from the source's slot, whatever was in the input's own."""
    gains = [Gain("a"), Gain("b"), Gain("c")]
    for gain, unit in zip(gains, ("mN.m", "N.m", "mN.m"), strict=True):
        gain.description = describe(inputs=["u"], outputs=["y"], units={"u": unit, "y": unit})
    layout = Layout.of(wired([("a.y", "b.u", "ramp"), ("b.y", "c.u", "ramp"), ("c.y", "a.u", "ramp")], gains, held={}))
    values = np.full(layout.size, np.nan)
    for name, value in (("a", 250.0), ("b", 4.0), ("c", -7.0)):
        values[layout.slots[Port(name, "y")]] = value
    layout.show_inputs(values)
    shown = {name: values[layout.slots[Port(name, "u")]] for name in "abc"}
    assert shown == {"b": 1e-3 * 250.0, "c": 4.0 * 1e3, "a": -7.0}


@pytest.mark.parametrize("timing", ["at_point", "after_step", "midpoint", "ramp"])
@pytest.mark.parametrize("steps", [{}, {"a": 3}, {"b": 2}], ids=str)
def test_recorded_inputs_are_their_sources_at_that_point(timing, steps):
    """A fault on a connection shows: the input's column is factor * source + addend in the same row."""
    slaves = [Integrator(name, x0=x0, can_interpolate_inputs=True) for name, x0 in (("a", 1.0), ("b", 2.0))]
    for slave in slaves:
        slave.description = describe(
            inputs=["u"],
            states={"y": slave.values["y"]},
            units={"u": "N.m", "y": "mN.m"},
            can_interpolate_inputs=True,
        )
    result = run(slaves, [("a.y", "b.u", timing), ("b.y", "a.u", "at_point")], stop=1.0, steps=steps)
    assert_array_equal(result["b.u"], 1e-3 * result["a.y"])
    assert_array_equal(result["a.u"], 1e-3 * result["b.y"])
    assert len(set(result["b.u"])) > 3


@pytest.mark.parametrize("timing", ["at_point", "after_step"])
def test_recorded_inputs_of_every_type_in_both_loops(timing, tmp_path):
    links = [(f"a.{state}", f"b.{direct}_in", timing) for direct, state in NAMES.items()]
    held = {"a.r_in": 1.0, "a.i_in": 1, "a.b_in": True, "a.e_in": 1, "a.s_in": "w"}
    path = typed(tmp_path)
    for steps in ({}, {"a": 2}, {"b": 2}):
        result = both.fly(both.of({"a": path, "b": path}, links, held=held, steps=steps), stop=1.0, every=1)
        for direct, state in NAMES.items():
            assert result[f"b.{direct}_in"].tolist() == result[f"a.{state}"].tolist()


def test_a_run_that_records_every_third_row_shows_the_same_inputs(tmp_path):
    links = [(f"a.{state}", f"b.{direct}_in", "at_point") for direct, state in NAMES.items()]
    held = {"a.r_in": 1.0, "a.i_in": 1, "a.b_in": True, "a.e_in": 1, "a.s_in": "w"}
    path = typed(tmp_path)
    system = both.of({"a": path, "b": path}, links, held=held)
    all_rows, third = both.fly(system, stop=1.0), both.fly(system, stop=1.0, every=3)
    for name in all_rows.names:
        assert third[name].tolist() == [*all_rows[name][::3].tolist(), *all_rows[name][10:].tolist()][: len(third)]
