"""The waves of a long run written out in C: a line a call, every count a constant, as one would write them by hand.

It does what `steps_in_waves` does (waves.h), to which it leaves what does not go well. A compiler has to make it, so it
is for runs that save more than that takes, and for those whose library is there already.
"""

import ctypes
import hashlib
import tempfile
from collections.abc import Sequence
from pathlib import Path

from cosim.masters.kernel import library
from cosim.masters.kernel.structures import GET, SET, STEP, WireStructure
from cosim.masters.kernel.waves import SLOT, Straight
from fmus.errors import BuildError
from fmus.toolchain import compile_library

SAVED = 1.6e-9
"""Seconds of CPU that a call of few FMUs takes less; this and the rest as tests/benchmarks/unrolled.py measures."""

MOST = 200
"""Calls of a step: more save little, for they do not stay in the processor's cache, and take seconds to compile."""

COMPILER, COMPILED = 0.06, 1.5e-3
"""Seconds of CPU that a compiler takes, and for each call of a step."""

LONG = 100_000
"""Steps of a run that asks for it at all: they save 160 us a call, and to write the source takes up to 11 of them."""

FEW = 16
"""As in values.h."""

HEAD = """#include <stddef.h>
#include <string.h>
#include "structures.h"
#include "values.h"
#define CALL(phase, index, number, call) \\
    r->calling = number; \\
    status = call; \\
    if (RARELY(status != OK)) { \\
        outcome |= r->careful(r, w, here, h, phase, index, status); \\
        break; \\
    }
#define AT(call) call.instance, call.references

EXPORT int steps(Run *r, integer end, double *t)
{
    const double denominator = (double)r->denominator;
    double *const point = r->point, *const newest = r->newest;
    integer at = r->start + r->done * r->step;
    double here = *t;
    while (r->done < end && !*r->stop_asked) {
        const double next = (double)(at += r->step) / denominator, h = next - here;
        int outcome = FINE, status;
"""
TAIL = """        r->done++;
        *t = here = next;
        if (RARELY(outcome)) return 0;
    }
    return 0;
}
"""


def function(waves: Sequence[Sequence[Straight]], steps: int, point: int, newest: int, owned: int) -> int:
    """Return the address of the function for a run of so many steps, 0 where there is none.

    `point` and `newest`: the addresses of its slots, of which `owned` are outputs.
    """
    calls = sum(bool(each.wires) + bool(each.its.step) + bool(each.its.outputs) for wave in waves for each in wave)
    if steps < LONG or not 0 < calls <= MOST:
        return 0
    text = source(waves, point, newest, owned)
    name = f"waves-{hashlib.sha256(f'{library.key()}{text}'.encode()).hexdigest()[:16]}"
    if SAVED * calls * steps < COMPILER + COMPILED * calls and not library.is_kept(name):
        return 0
    try:
        found = library.kept(name, lambda path: _compile(text, path), _declared)
    except (BuildError, OSError):  # a run does without it
        return 0
    return ctypes.cast(found.steps, ctypes.c_void_p).value or 0


def source(waves: Sequence[Sequence[Straight]], point: int, newest: int, owned: int) -> str:
    """Return the C source of waves."""
    slots = _Slots(point, newest)
    text = "".join(_wave(number, wave, slots) for number, wave in enumerate(waves))
    shown = [f"((volatile double *)point)[{i}] = newest[{i}];" for i in range(owned)]
    return HEAD + text + _lines(shown if owned < FEW else ["show_all(r);"]) + TAIL


class _Slots:
    """Slots by their addresses."""

    def __init__(self, point: int, newest: int) -> None:
        self._newest = newest
        self._vectors = sorted([(point, "point"), (newest, "newest")])

    def newest(self, address: int) -> int:
        """Return which slot of the newest values has an address."""
        return (address - self._newest) // SLOT

    def value(self, address: int) -> str:
        """Return the value at an address in C; the vectors stand apart."""
        begin, name = max(vector for vector in self._vectors if vector[0] <= address)
        return f"{name}[{(address - begin) // SLOT}]"


def _wave(number: int, wave: Sequence[Straight], slots: _Slots) -> str:
    wires = [wire for each in wave for wire in each.wires]
    lines = [f"in[{i}] = {_given(i, wire, slots)};" for i, wire in enumerate(wires)]
    first = 0
    for index, each in enumerate(each for each in wave if each.wires):
        call = f"w->set[{index}].function.set(AT(w->set[{index}]), {len(each.wires)}, in + {first})"
        lines.append(f"CALL(SETTING, {index}, {each.calling(SET)}, {call})")
        first += len(each.wires)
    for index, each in enumerate(each for each in wave if each.its.step):
        call = f"w->step[{index}].function.step(w->step[{index}].instance, here, h, 1)"
        lines.append(f"CALL(STEPPING, {index}, {each.calling(STEP)}, {call})")
    for index, each in enumerate(each for each in wave if each.its.outputs):
        values = f"{each.its.outputs}, newest + {slots.newest(each.reads.start)}"
        call = f"w->get[{index}].function.get(AT(w->get[{index}]), {values})"
        lines.append(f"CALL(GETTING, {index}, {each.calling(GET)}, {call})")
    finite = [slots.newest(address) for each in wave for address in each.finite.tolist()]
    carried = " | ".join(f"NOT_FINITE(BITS(newest[{slot}]), EXPONENT)" for slot in finite)
    wrong = f"({carried}) >> 63" if len(finite) < FEW else "any_not_finite(w)"
    if finite:
        lines.append(f"if (RARELY({wrong})) outcome |= r->careful(r, w, here, h, PHASES, 0, OK); /* nothing is left */")
    begin = [f"const Wave *const w = r->wave + {number};", "double *const in = w->input;", "(void)in;"]
    inner = _lines([*begin, *lines], 12)
    return f"        do {{\n{inner}        }} while (0);\n        if (RARELY(outcome & FAILED)) return 1;\n"


def _given(index: int, wire: WireStructure, slots: _Slots) -> str:
    value = slots.value(wire.source)
    if wire.factor == 1 and wire.addend == 0:
        return f"{value} + 0.0"
    return f"w->wire[{index}].factor * {value} + w->wire[{index}].addend"


def _lines(lines: Sequence[str], indent: int = 8) -> str:
    return "".join(f"{' ' * indent}{line}\n" for line in lines)


def _compile(source: str, path: Path) -> None:
    with tempfile.TemporaryDirectory() as place:
        Path(place, "waves.c").write_text(source)
        compile_library(Path(place), "waves.c", path, include=(Path(__file__).parent,), optimisation="-O1")


def _declared(found: ctypes.CDLL) -> ctypes.CDLL:
    found.steps.restype = ctypes.c_int  # AttributeError: it is another library
    return found
