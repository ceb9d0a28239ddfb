"""Waves: the straight turns and readings of a run that take nothing from one another, call by call (waves.h)."""

import ctypes
from collections.abc import Iterator, Sequence

import numpy as np

from cosim.arrays import IntArray
from cosim.masters.kernel.kept import Kept
from cosim.masters.kernel.structures import (
    GET,
    SET,
    STEP,
    CallStructure,
    PassStructure,
    WaveStructure,
    WireStructure,
)

SLOT = ctypes.sizeof(ctypes.c_double)
EXPONENT = 0x7FF << 52
"""The bits of a double of which all are set where it is not finite."""


class Straight:
    """A straight pass by its place in the run and its addresses: of what it takes, and of what it reads."""

    def __init__(self, place: int, its: PassStructure) -> None:
        self.place, self.its = place, its
        sets = its.inputs and not its.kept
        self.wires = list((WireStructure * its.inputs).from_address(its.wire)) if sets else []
        first = its.output or 0
        self.reads = range(first, first + SLOT * its.outputs, SLOT)
        finite = (ctypes.c_longlong * its.finite).from_address(its.finite_value) if its.finite else []
        self.finite: IntArray = np.array(finite, dtype=np.int64)

    def calling(self, kind: int) -> int:
        """Return the number of one of its calls."""
        return self.its.component << 8 | kind << 4

    def call(self, kind: int, function: int, references: int = 0, value: int = 0, count: int = 0) -> CallStructure:
        """Return one of its calls."""
        return CallStructure(
            place=self.place,
            calling=self.calling(kind),
            instance=self.its.instance,
            function=function,
            references=references,
            value=value,
            count=count,
        )


def together(passes: Sequence[PassStructure]) -> Iterator[list[Straight]]:
    """Yield waves: passes one behind another, none of which has to come after one before it.

    It has to where it takes what that one reads, is of the same component, or is a reading and that one a turn.
    """
    wave: list[Straight] = []
    components: set[int] = set()
    read: set[int] = set()
    for place, its in enumerate(passes):
        found = Straight(place, its)
        another = wave and bool(wave[0].its.step) != bool(its.step)
        if another or its.component in components or not read.isdisjoint(wire.source for wire in found.wires):
            yield wave
            wave, components, read = [], set(), set()
        wave.append(found)
        components.add(its.component)
        read.update(found.reads)
    if wave:
        yield wave


def wave_structure(wave: Sequence[Straight], kept: Kept) -> WaveStructure:
    """Return a wave as the kernel has it."""
    wires = [wire for each in wave for wire in each.wires]
    given = kept.array(np.zeros(len(wires)), np.float64)
    sets, behind = [], given
    for each in wave:
        if each.wires:
            sets.append(each.call(SET, each.its.set, each.its.input_references, behind, len(each.wires)))
            behind += SLOT * len(each.wires)
    steps = [each.call(STEP, each.its.step) for each in wave if each.its.step]
    read = [each for each in wave if each.its.outputs]
    gets = [
        each.call(GET, each.its.get, each.its.output_references, each.its.output, each.its.outputs) for each in read
    ]
    begin = min((each.reads.start for each in read), default=0)
    mask = np.zeros((max((each.reads.stop for each in read), default=0) - begin) // SLOT, np.int64)
    mask[(np.concatenate([each.finite for each in wave]) - begin) // SLOT] = EXPONENT
    bare = all(wire.factor == 1 and wire.addend == 0 for wire in wires)
    return WaveStructure(
        first=wave[0].place,
        wires=len(wires),
        sets=len(sets),
        steps=len(steps),
        gets=len(gets),
        slots=len(mask),
        wire=kept.structures(WireStructure, wires),
        bare=kept.array([wire.source for wire in wires], np.int64) if bare else 0,
        input=given,
        set=kept.structures(CallStructure, sets),
        step=kept.structures(CallStructure, steps),
        get=kept.structures(CallStructure, gets),
        value=begin,
        finite=kept.array(mask, np.int64),
    )
