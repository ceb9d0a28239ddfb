"""Filters put between an input and what is connected to it."""

from dataclasses import replace

import pytest
from numpy.testing import assert_array_equal

from cosim import simulate
from cosim.errors import WiringError
from cosim.system import Connection, System
from cosim.system.filters import with_filters

from ...problems.notched import notched

LOOP = System(
    name="loop",
    components={"law": "Law", "plant": "Plant"},
    connections=[Connection("plant.q", "law.q", "after_step"), Connection("law.tau", "plant.tau")],
)


def test_they_stand_in_their_order_and_the_target_keeps_its_timing():
    system = with_filters(LOOP, "plant.tau", notch="Notch", delay="Delay:samples=2")
    assert system.components == {"law": "Law", "plant": "Plant", "notch": "Notch", "delay": "Delay:samples=2"}
    assert system.connections == (
        LOOP.connections[0],
        Connection("law.tau", "notch.u", "ramp"),
        Connection("notch.y", "delay.u", "ramp"),
        Connection("delay.y", "plant.tau"),
    )


def test_a_timing_that_is_said_is_that_of_each():
    system = with_filters(LOOP, "law.q", late="Delay")
    assert system.connections[:2] == (
        Connection("plant.q", "late.u", "after_step"),
        Connection("late.y", "law.q", "after_step"),
    )


def test_none_change_nothing():
    assert with_filters(LOOP, "law.q") == LOOP


def test_where_nothing_is_connected_there_is_nothing_to_filter():
    with pytest.raises(WiringError) as error:
        with_filters(LOOP, "plant.tau_dist", notch="Notch")
    assert str(error.value) == (
        "plant.tau_dist has no connection that filters could be put into. Connected are: law.q, plant.tau."
    )


def test_a_name_that_is_taken_is_refused():
    with pytest.raises(WiringError) as error:
        with_filters(LOOP, "plant.tau", law="Notch")
    assert str(error.value) == (
        "there is a component law already, and a filter before plant.tau is to have that name. Choose another name."
    )


def test_it_flies_as_if_wired_by_hand():
    """A ramp into a sampled component is its value at the sample."""
    by_hand, experiment = notched()
    short = replace(experiment, stop_time=2.0)
    components = {n: r for n, r in by_hand.components.items() if n not in ("notch", "delay")}
    kept = [c for c in by_hand.connections if c.target.startswith("controller.")]
    bare = replace(
        by_hand, components=components, connections=[*kept, Connection("controller.tau_command_B", "plant.tau_B")]
    )
    made = with_filters(bare, "plant.tau_B", notch="Notch:width=3,unit=N.m", delay="Delay:width=3,unit=N.m")
    one, other = simulate(by_hand, short), simulate(made, short)
    assert one["delay.y"].any()
    for name in ("plant.q_BN", "notch.y", "delay.y"):
        assert_array_equal(one[name], other[name])
