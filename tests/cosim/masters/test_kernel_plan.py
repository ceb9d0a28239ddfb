"""The plan of the kernel: inputs that a point's evaluation has set are set again only where they have changed since."""

from dataclasses import replace

import numpy as np
import pytest

from cosim import At, Connection, Experiment, Explicit, Library, System, simulate
from cosim.cli.instances import read_descriptions
from cosim.masters.kernel import packed
from cosim.masters.layout import Layout, Reading
from cosim.masters.turns import Turns
from cosim.masters.watch import LINE, Block
from cosim.system.expand import wire
from cosim.time import Schedule

from .. import both
from ..oscillator import Damper, Mass
from ..passing import Doubler, Level, Passer

AROUND = System(
    name="around",
    components={"mass": Mass, "passer": Passer, "doubler": Doubler},
    connections=[
        Connection("mass.v", "passer.now", "at_point"),
        Connection("passer.y", "doubler.u", "at_point"),
        Connection("doubler.y", "passer.later", "at_point"),
    ],
    held={"mass.f": 0.0},
)
NEWER = replace(
    AROUND,
    name="newer",
    connections=[
        Connection("mass.v", "passer.now", "at_point"),
        Connection("mass.v", "doubler.u", "after_step"),
        Connection("doubler.y", "passer.later", "after_step"),
    ],
)
CHANGED_LATER = System(
    name="changed_later",
    components={"mass": Mass, "passer": Passer, "level": Level},
    connections=[
        Connection("mass.v", "passer.now", "at_point"),
        Connection("level.y", "passer.later", "at_point"),
    ],
    held={"mass.f": 0.0},
)
OSCILLATOR = System(
    name="oscillator",
    components={"mass": Mass, "damper": Damper},
    connections=[Connection("mass.v", "damper.v", "at_point"), Connection("damper.f", "mass.f", "at_point")],
)


def kept(system):
    """Whose inputs stand at the start of a step as the point's evaluation has left them."""
    wiring = wire(system, read_descriptions(system, Library("native")))
    turns = Turns.of(wiring, Layout.of(wiring), Schedule.of(0.0, 1.0, 0.1, 1))
    readings = [reading for reading in turns.refresh if isinstance(reading, Reading)]
    places = [turns.turn_of(reading) for reading in readings]
    return {turns.all[place].component.name for place in packed.set_already(turns, readings, places)}


def test_inputs_that_stand_already():
    """passer.later comes from the doubler, which is evaluated after passer.y; mass.a and damper.f follow theirs."""
    assert kept(AROUND) == {"doubler"}
    assert kept(OSCILLATOR) == {"damper", "mass"}
    assert kept(NEWER) == set()  # passer.later is what the doubler has after its step


def flown(system, *events, stop=1.0, preset="jacobi"):
    """Fly in both loops; the tables must be equal bit by bit."""
    setup = Experiment(stop_time=stop, communication_step_size=0.1, events=events)
    kernel, python = (simulate(system, replace(setup, master=Explicit(preset, kernel=loop))) for loop in both.LOOPS)
    both.assert_same(kernel, python)
    return kernel


def test_an_input_that_comes_from_what_is_evaluated_later_is_set_again():
    result = flown(AROUND, stop=2.0)
    v, later = result["mass.v"], result["passer.later"]
    assert np.abs(v[1:]).min() > 0 and np.array_equal(later, 2 * v)
    z = [0.0]
    for u in later[:-1]:  # held over each step: z' = u - z, exactly
        z.append(u + (z[-1] - u) * np.exp(-0.1))
    assert result["passer.z"] == pytest.approx(np.array(z), abs=4e-6)  # RK4: 0.1**5 / 120 |u - z| a step, fading


def test_an_input_that_is_what_its_source_has_after_its_step_is_set_again():
    result = flown(NEWER, stop=2.0, preset="declared")
    assert np.array_equal(result["passer.later"], result["doubler.y"])
    assert result["passer.z"][-1] != flown(NEWER, stop=2.0)["passer.z"][-1]


@pytest.mark.parametrize("event", [At(0.5, {"damper.c": 2.0}), At(0.53, {"mass.k": 9.0})])
def test_what_an_event_changes_is_set(event):
    """The kernel flies to the event and on from it: what it has set before need not stand."""
    assert flown(OSCILLATOR, event)["mass.x"][-1] != flown(OSCILLATOR)["mass.x"][-1]


def test_what_an_event_changes_after_the_reading_of_its_target_is_set():
    """At the event passer.y is read while level.y is still the old one; in a step no output is read after it."""
    assert kept(CHANGED_LATER) == {"passer"}
    result = flown(CHANGED_LATER, At(0.5, {"level.level": 4.0}))
    t = result.time  # z' = level - z, exactly
    before = 1 - np.exp(-t)
    z = np.where(t < 0.5, before, 4 + (1 - np.exp(-0.5) - 4) * np.exp(0.5 - t))
    assert result["passer.z"] == pytest.approx(z, abs=3e-6)  # RK4: 0.1**5 / 120 |level - z| a step, of ten


@pytest.mark.parametrize("capacity", [1, 2, 7, 8, 9, 16, 4096])
def test_the_values_of_a_row_share_no_place_of_the_cache(capacity):
    """Places go by the line's number; columns that are an odd number of lines apart take all of them in turn."""
    block = Block(capacity, 3)
    assert block.stride >= capacity and block.stride % LINE == 0 and block.stride // LINE % 2 == 1
    assert block.data.shape == (capacity, 4) and block.data.strides == (8, 8 * block.stride)
    block.append(0.5, np.array([1.0, 2.0, 3.0]))
    assert block.columns[:, 0].tolist() == [0.5, 1.0, 2.0, 3.0]
