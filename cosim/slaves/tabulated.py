"""Signals as an instance that a master steps: in Python here, in C in masters/kernel/signals.h, operation by operation.

What a step from t to t + h tells is said in cosim/system/feeds.py: the value and slope at its end, and the polynomial v
over it. Nothing of it depends on the steps before.
"""

import ctypes
from bisect import bisect_right
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from cosim.arrays import FloatArray
from cosim.slaves.pending import Patience
from cosim.slaves.slave import CInterface, References, Refusal, Warned
from cosim.system.feeds import SLOTS, Pieces
from cosim.system.wiring import Feed
from fmus.description.description import ModelDescription

Four = tuple[float, float, float, float]


class ChannelStructure(ctypes.Structure):
    """One signal: its pieces, and what the last step has told of it."""

    _fields_ = [
        *((name, ctypes.c_longlong) for name in ("pieces", "degree", "piece")),
        *((name, ctypes.c_void_p) for name in ("knots", "coefficients")),
        *((name, ctypes.c_double) for name in ("value", "v0", "v1", "v2", "v3", "slope")),
    ]


class FeedStructure(ctypes.Structure):
    """The signals of one component."""

    _fields_ = [("channels", ctypes.c_longlong), ("channel", ctypes.c_void_p)]


class _Channel:
    """A signal in Python: knots t_i, shape (n,), coefficients, shape (n - 1, 4), and its structure."""

    def __init__(self, knots: FloatArray, coefficients: FloatArray, structure: Any, degree: int) -> None:
        self.arrays = knots, coefficients
        self.knots, self.coefficients = knots.tolist(), coefficients.tolist()
        self.told, self.degree = structure, degree
        structure.pieces, structure.degree, structure.piece = len(coefficients), degree, 0
        structure.knots, structure.coefficients = knots.ctypes.data, coefficients.ctypes.data

    def find(self, t: float) -> int:
        """Return the piece in which a time lies, the last or the first beyond the ends."""
        return min(max(bisect_right(self.knots, t) - 1, 0), len(self.coefficients) - 1)

    def at(self, i: int, t: float) -> Four:
        """Return u, u', u'', u''' of piece i at t."""
        c0, c1, c2, c3 = self.coefficients[i]
        s = t - self.knots[i]
        return (
            c0 + s * (c1 + s * (c2 + s * c3)),
            c1 + s * (2 * c2 + s * (3 * c3)),
            2 * c2 + s * (6 * c3),
            6 * c3,
        )

    def begin(self, t: float) -> None:
        """Tell what there is at t, where no step has been taken."""
        told = self.told
        told.v0, told.v1, told.v2, told.v3 = self.at(self.find(t), t)
        told.value, told.slope = told.v0, told.v1

    def step(self, t: float, h: float) -> None:
        """Tell of the step from t to t + h."""
        told, end = self.told, t + h
        i = self.find(t)
        start, last = self.at(i, t), self.find(end)
        told.value, told.slope = self.at(last, end)[:2]
        whole = i == len(self.coefficients) - 1 or end <= self.knots[i + 1]
        if whole and self._fits(i):
            told.v0, told.v1, told.v2, told.v3 = start
        else:
            told.v0, told.v1, told.v2, told.v3 = self._alike(i, t, end, h, start[0])

    def _fits(self, i: int) -> bool:
        """Whether piece i is of the degree that the target takes."""
        _, c1, c2, c3 = self.coefficients[i]
        return self.degree == 3 or (c2 == 0 and c3 == 0 and (self.degree == 1 or c1 == 0))

    def _moments(self, i: int, t: float, end: float) -> tuple[float, float]:
        """Return I_0 and I_1 of (1), from piece i on."""
        first = second = 0.0
        begin = t
        while True:
            inner = i < len(self.coefficients) - 1 and self.knots[i + 1] < end
            to = self.knots[i + 1] if inner else end
            w, (d0, d1, d2, d3) = to - begin, self.at(i, begin)
            part = w * (d0 + w * (d1 / 2 + w * (d2 / 6 + w * (d3 / 24))))
            own = w * w * (d0 / 2 + w * (d1 / 3 + w * (d2 / 8 + w * (d3 / 30))))
            first = first + part
            second = second + ((begin - t) * part + own)
            if not inner:
                return first, second
            begin, i = to, i + 1

    def _alike(self, i: int, t: float, end: float, h: float, a: float) -> Four:
        """Return v, v', v'', v''' at t of the polynomial with the moments of u, and of a cubic with its ends."""
        first, second = self._moments(i, t, end)
        mean = first / h
        if self.degree == 0:
            return mean, 0.0, 0.0, 0.0
        if self.degree == 1:
            slope = 12 * (second - 0.5 * h * first) / (h * h * h)
            return mean - 0.5 * h * slope, slope, 0.0, 0.0
        # v = a + (b - a) x + x (1 - x) (c + d (2 x - 1)), x = s / h: c by I_0, d by I_1
        b = self.told.value
        c = 6 * (mean - 0.5 * (a + b))
        d = 30 * ((2 * (second / h) - first) / h) - 5 * (b - a)
        return a, (b - a + c - d) / h, 2 * (3 * d - c) / (h * h), -12 * d / (h * h * h)


class Tabulated:
    """The instance that the signals of a `feed` are; `pieces` are the knots and coefficients of each channel.

    `functions`: FMI function -> its address in the kernel, asked for when a caller in C wants them.
    """

    def __init__(
        self,
        feed: Feed,
        description: ModelDescription,
        pieces: Pieces,
        functions: Callable[[], Mapping[str, int]],
    ) -> None:
        self.name, self.description, self._functions = feed.name, description, functions
        self.patience, self.messages, self.warned = Patience(), (), Warned()
        self._structures = (ChannelStructure * len(pieces))()
        parts = zip(pieces, self._structures, feed.channels, strict=True)
        self._channels = [_Channel(*piece, structure, channel.degree) for piece, structure, channel in parts]
        self._feed = FeedStructure(len(pieces), ctypes.addressof(self._structures))

    def setup_experiment(self, t: float, tolerance: float | None = None, stop: float | None = None) -> None:
        """Stand at the start."""
        for channel in self._channels:
            channel.begin(t)

    def do_step(self, t: float, h: float) -> None:
        """Tell of the step from t to t + h."""
        for channel in self._channels:
            channel.step(t, h)

    def get_real(self, references: References) -> FloatArray:
        """Return values, and derivatives of v."""
        names = ("value", "v0", "v1", "v2", "v3")
        told = self._structures
        return np.array([getattr(told[r // SLOTS], names[r % SLOTS]) for r in references], dtype=np.float64)

    def get_output_derivatives(self, references: References, orders: References) -> FloatArray:
        """Return slopes of values."""
        return np.array([self._structures[r // SLOTS].slope for r in references], dtype=np.float64)

    def get_state(self) -> bytes:
        """Return what the last step has told."""
        return bytes(self._structures)

    def set_state(self, state: bytes) -> None:
        """Go back to that."""
        ctypes.memmove(self._structures, state, len(state))

    def serialize_state(self, state: bytes) -> bytes:
        """Return what was told without where the pieces lie in memory."""
        told = (ChannelStructure * len(self._channels)).from_buffer_copy(state)
        return np.array([[getattr(c, n) for n in _TOLD] for c in told], dtype=np.float64).tobytes()

    def deserialize_state(self, data: bytes) -> bytes:
        """Return a state of this instance that tells what was told."""
        state = (ChannelStructure * len(self._channels)).from_buffer_copy(self._structures)
        for channel, told in zip(state, np.frombuffer(data).reshape(-1, len(_TOLD)).tolist(), strict=True):
            for name, value in zip(_TOLD, told, strict=True):
                setattr(channel, name, value)
        return bytes(state)

    def c_interface(self) -> CInterface:
        """Return it for the kernel, whose functions read the same structures."""
        return CInterface(ctypes.addressof(self._feed), self._functions())

    def failed(self, status: int) -> Refusal:
        """Return nothing: no call fails."""
        return Refusal()

    def reset(self) -> bool:
        """Be as new."""
        return True

    def _nothing(self, *_: Any, **__: Any) -> None:
        """Do nothing: there is nothing to set, and nothing to free."""

    instantiate = enter_initialization_mode = exit_initialization_mode = _nothing
    set_real = set_integer = set_boolean = set_string = set_input_derivatives = _nothing
    free_state = terminate = free = _nothing

    def get_integer(self, references: References) -> Sequence[int]:
        """Return nothing: all outputs are Real."""
        return []

    def get_boolean(self, references: References) -> Sequence[bool]:
        """Return nothing, likewise."""
        return []

    def get_string(self, references: References) -> Sequence[bytes]:
        """Return nothing, likewise."""
        return []

    def directional_derivative(self, unknowns: References, knowns: References, seed: FloatArray) -> FloatArray:
        """Return zeros: it follows no input."""
        return np.zeros(len(unknowns))


_TOLD = ("value", "v0", "v1", "v2", "v3", "slope")
