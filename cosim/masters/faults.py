"""Faults in a run: what passes a connection on which faults act, and components that are frozen.

A source has at the end of each of its steps, and at t0, a value y, which is factor y + addend in the target's own unit.
What the target is given is

    v = Q(scale (factor y + addend) + bias + sigma z(t)),   Q(x) = quantum round(x / quantum)             (1)
    u = v, n steps of the source late; or what was held                                                   (2)

with z a standard normal number of t (noise.py). Before a delay has been there for n steps u is what it was when the
delay began. Where v moves in steps (noise, quantisation, delay, what is held) u has no slope, else that of (1).

All of it is in slots, which are the source component's as its outputs are: u, its derivatives, the settings in force
(they change at events only), the values that are on their way. So a step that is repeated or taken back, and a point
that is saved, need no more, and everything that follows an output (timings, rates, slopes) follows u. A step writes
what `newest` has from what there was where it `begun`, as often as one likes. The kernel's twin is faults.h.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from cosim.arrays import FloatArray
from cosim.masters.noise import key_of, normal
from cosim.system.wiring import Port, Wiring

SETTINGS = ("scale", "bias", "sigma", "seed", "quantum", "steps", "hold")
"""Of a passage, each in a slot; `steps`: n of (2), `hold`: whether u stays as it is."""

SCALE, BIAS, SIGMA, SEED, QUANTUM, STEPS, HOLD, HELD, SENT, COUNT, SIZE = range(11)
"""Slots from `Passage.settings` on. HELD: whether u moves in steps; SENT: v; COUNT: where in the line v goes."""

FROZEN, LAG, FREEZING = range(3)
"""Slots of a component that may freeze: whether it is frozen, by how much its clock is late, s; how many they are."""


@dataclass(frozen=True)
class Passage:
    """A scalar connection on which faults act; slots from `first` on are its own.

    `source`: the slot of y; `slopes`: those of its derivatives, of orders 1 to m. `key`: the noise's number of the
    target. `longest`: the largest n of (2) in the run.
    """

    first: int
    source: int
    slopes: tuple[int, ...]
    factor: float
    addend: float
    key: int
    longest: int

    @cached_property
    def settings(self) -> int:
        """The first slot of the settings."""
        return self.first + 1 + len(self.slopes)

    @property
    def held(self) -> int:
        """The slot that is not 0 where u moves in steps."""
        return self.settings + HELD

    @cached_property
    def line(self) -> int:
        """The first slot of what is on its way."""
        return self.settings + SIZE

    @cached_property
    def slots(self) -> slice:
        """All slots."""
        return slice(self.first, self.line + self.longest)

    def derivative(self, n: int) -> int:
        """Return the slot of u's n-th derivative, -1 where there is none."""
        return self.first + n if n <= len(self.slopes) else -1

    def reset(self, values: FloatArray) -> None:
        """Be without a fault."""
        values[self.slots] = 0.0
        values[self.settings + SCALE] = 1.0

    def change(self, values: FloatArray, settings: Mapping[str, float], stuck: float | None) -> None:
        """Put other settings in force at a point; `stuck`: the value at which u is held from now on."""
        first = self.settings
        for name, value in settings.items():
            values[first + SETTINGS.index(name)] = value
        if settings.get("steps"):
            values[self.line : self.slots.stop] = values[self.first]
            values[first + COUNT] = 0.0
        if stuck is not None:
            values[self.first] = stuck
        values[first + HELD] = float(values[[first + SIGMA, first + QUANTUM, first + STEPS, first + HOLD]].any())

    def take(self, begun: FloatArray, newest: FloatArray, t: float) -> None:
        """Pass on what the source has at t, the end of its step, which `begun` where these slots are of."""
        first, n = self.settings, int(newest[self.settings + STEPS])
        v = self._made(newest, t)
        u = v
        if n:  # (2)
            count = int(begun[first + COUNT])
            newest[self.line + count] = begun[first + SENT]
            count = (count + 1) % n
            u, newest[first + COUNT] = newest[self.line + count], count
        newest[first + SENT] = v
        newest[self.first] = begun[self.first] if newest[first + HOLD] else u
        self._slope(newest)

    def show(self, values: FloatArray, t: float) -> None:
        """Pass on what the source has at a point at t, where no step is taken."""
        first = self.settings
        v = self._made(values, t)
        values[first + SENT] = v
        if not values[first + HOLD]:
            values[self.first] = values[self.line + int(values[first + COUNT])] if values[first + STEPS] else v
        self._slope(values)

    def gain(self, values: FloatArray) -> float:
        """Return by how much u moves with y, quantisation left out."""
        stays = values[self.settings + STEPS] or values[self.settings + HOLD]
        return 0.0 if stays else float(values[self.settings + SCALE]) * self.factor

    def _made(self, values: FloatArray, t: float) -> float:
        """Return v."""
        scale, bias, sigma, seed, quantum = values[self.settings : self.settings + STEPS].tolist()
        v = scale * (self.factor * float(values[self.source]) + self.addend) + bias  # (1)
        if sigma:
            v = v + sigma * normal(int(seed), self.key, t)
        return quantum * float(np.rint(v / quantum)) if quantum else v

    def _slope(self, values: FloatArray) -> None:
        scale, held = float(values[self.settings + SCALE]), values[self.held]
        for n, slope in enumerate(self.slopes):
            values[self.first + 1 + n] = 0.0 if held else scale * (self.factor * float(values[slope]))


def freeze(values: FloatArray, first: int, frozen: bool, lag: float) -> None:
    """Freeze a component, whose slots for it begin at `first`, or let it go on, its clock late by `lag` s."""
    values[first + FROZEN], values[first + LAG] = float(frozen), lag


def passages(
    wiring: Wiring,
    component: str,
    slots: Mapping[Port, int],
    derivative_slots: Mapping[tuple[Port, int], int],
    first: int,
) -> dict[Port, Passage]:
    """Return the connections from a component on which faults act, by their targets; their slots begin at `first`."""
    found: dict[Port, Passage] = {}
    for link in wiring.links:
        if link.source.component != component or link.target not in wiring.faulty:
            continue
        keys = [(link.source, n) for n in range(1, link.slopes + 1)]
        found[link.target] = Passage(
            first,
            slots[link.source],
            tuple(derivative_slots[key] for key in keys if key in derivative_slots),
            link.conversion.factor,
            link.conversion.offset,
            key_of(str(link.target)),
            wiring.faulty[link.target].longest,
        )
        first = found[link.target].slots.stop
    return found
