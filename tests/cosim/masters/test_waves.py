"""Waves of the kernel: what takes nothing from one another goes together, and fails as if it went one by one."""

import ctypes
from itertools import product

import numpy as np
import pytest

from cosim.errors import StepFailed
from cosim.masters.kernel.structures import PassStructure, WireStructure
from cosim.masters.kernel.waves import SLOT, together

from .. import both
from ..c_fmu import build, integer, real

SETS, STEPS, GETS, NOT_A_NUMBER = range(4)
RING = [("a.y", "b.u", "at_point"), ("b.y", "c.u", "at_point"), ("c.y", "a.u", "at_point")]
WORDS = {SETS: "fmi2SetReal", STEPS: "fmi2Error", GETS: "fmi2GetReal", NOT_A_NUMBER: "y became nan"}


@pytest.fixture(scope="module")
def fragile(tmp_path_factory):
    """y follows u; after five steps `where` says what fails, unless it is below 0."""
    variables = [real("u", "input"), real("y", start=0.0), integer("where", "parameter", start=-1)]
    due = "m->whole[0] >= 5"
    return build(
        tmp_path_factory.mktemp("fragile"),
        "Fragile",
        variables,
        step=f"if (where == {STEPS} && {due}) return fmi2Error; y += h * (u + 1);"
        f" if (where == {NOT_A_NUMBER} && {due}) y = NAN; m->whole[0]++;",
        on_set=f"if (where == {SETS} && {due}) return fmi2Error;",
        on_get=f"if (where == {GETS} && m->whole[0] >= 6) return fmi2Error;",
    )


def ring(fragile, **where):
    return both.of(dict.fromkeys("abc", fragile), RING, parameters={f"{name}.where": n for name, n in where.items()})


@pytest.mark.parametrize("third", [SETS, GETS])
@pytest.mark.parametrize(("first", "second"), [*product([-1, SETS, STEPS, GETS, NOT_A_NUMBER], range(4))])
def test_the_failure_that_is_told_is_that_of_the_first_in_turn(fragile, first, second, third):
    """All fail in the sixth step, whatever is called first where calls are made together."""
    system = ring(fragile, a=first, b=second, c=third)
    error = both.failure(StepFailed, system, stop=2.0, preset="plain")
    assert error.component == ("a" if first >= 0 else "b")
    assert WORDS[first if first >= 0 else second] in str(error)
    assert len(error.result) == 6


@pytest.mark.parametrize("every", [1, 31])
@pytest.mark.parametrize("count", [2, 7, 15, 16, 17, 40])
def test_few_and_many(fragile, count, every):
    """So many that values are taken one by one, and so many that they are not: y' = u + 1 held over each step.

    The last step is half as long as the others.
    """
    names = [f"n{i}" for i in range(count)]
    wires = [(f"{a}.y", f"{b}.u", "at_point") for a, b in zip(names, names[1:] + names[:1], strict=True)]
    result = both.fly(both.of(dict.fromkeys(names, fragile), wires), stop=3.05, every=every, preset="plain")
    y = np.zeros(count)
    for row in range(32):
        if row % every == 0:
            shown = [result[f"{name}.y"][row // every] for name in names]
            assert shown == pytest.approx(y.tolist(), rel=1e-13)
        y += (0.1 if row < 30 else 0.05) * (np.roll(y, 1) + 1)


@pytest.mark.parametrize("count", [3, 30])
def test_the_last_of_few_and_of_many_is_not_finite(fragile, count):
    names = [f"n{i}" for i in range(count)]
    wires = [(f"{a}.y", f"{b}.u", "at_point") for a, b in zip(names, names[1:] + names[:1], strict=True)]
    system = both.of(dict.fromkeys(names, fragile), wires, parameters={f"{names[-1]}.where": NOT_A_NUMBER})
    error = both.failure(StepFailed, system, stop=2.0, preset="plain")
    assert error.component == names[-1] and "y became nan" in str(error) and len(error.result) == 6


def test_what_follows_within_the_step_is_another_wave():
    slots = np.zeros(4)
    kept = []

    def straight(component, takes, reads, *, step=True, known=False):
        wires = (WireStructure * len(takes))(*(WireStructure(slots.ctypes.data + SLOT * slot, 1, 0) for slot in takes))
        kept.append(wires)
        return PassStructure(
            component=component,
            step=int(step),
            inputs=len(takes),
            wire=ctypes.addressof(wires),
            output=slots.ctypes.data + SLOT * reads,
            outputs=1,
            kept=known,
        )

    passes = [
        straight(0, [3], 0),
        straight(1, [2], 1),  # what follows it
        straight(2, [1], 2),  # takes what component 1 reads
        straight(3, [], 3),
        straight(1, [0], 1, step=False),  # readings
        straight(1, [0], 2, step=False),  # of the same component
        straight(0, [2], 0, step=False, known=True),  # sets nothing
    ]
    found = [[each.place for each in wave] for wave in together(passes)]
    assert found == [[0, 1], [2, 3], [4], [5, 6]]
