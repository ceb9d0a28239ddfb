"""FMI 3.0 reads and sets whole arrays by type; a master asks for scalars: what lies between is worked out once.

    request (scalars) -> calls, one for each type: value references of the arrays, their elements in one buffer

Where a request sets some elements of an array, the others are set to what they were set to last, or their start value.
"""

import ctypes
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from cosim.slaves.slave import References
from fmus.description.arrays import range_of
from fmus.description.description import Element, ModelDescription, Scalar

DTYPES = {
    "Float32": np.float32,
    "Float64": np.float64,
    **{f"{sign}Int{bits}": np.dtype(f"{sign.lower()}int{bits}").type for sign in ("", "U") for bits in (8, 16, 32, 64)},
    "Enumeration": np.int64,
    "Boolean": np.bool_,
    "String": np.object_,
}


@dataclass(frozen=True)
class Call:
    """One fmi3GetTYPE or fmi3SetTYPE.

    `places`: which of the request's scalars it has, shape (n,); `indices`: where they are in its `size` values;
    `known`: where these values are among all that are known of the type.
    """

    type: str
    references: Any
    places: Any
    indices: Any
    known: Any
    size: int

    @property
    def function(self) -> str:
        """The end of the function's name: an Enumeration is an Int64."""
        return "Int64" if self.type == "Enumeration" else self.type


class Elements:
    """Which scalars are where, and the values that arrays were set to."""

    def __init__(self, description: ModelDescription) -> None:
        self._scalars = list(description.variables.values())
        self._offsets: dict[tuple[str, int], int] = {}
        self._starts: dict[str, list[Any]] = {}
        self._calls: dict[References, tuple[Call, ...]] = {}
        for scalar in self._scalars:
            e = _element(scalar.element)
            starts = self._starts.setdefault(e.type, [])
            if e.index == 0 and (e.type, e.value_reference) not in self._offsets:
                self._offsets[e.type, e.value_reference] = len(starts)
                starts += [_zero(e.type)] * e.size
            if scalar.start is not None:
                starts[self._offsets[e.type, e.value_reference] + e.index] = _plain(scalar.start)
        self._known = {kind: np.array(starts, dtype=DTYPES[kind]) for kind, starts in self._starts.items()}

    def forget(self) -> None:
        """Know the start values alone; where they lie in memory stays, for the kernel has them too."""
        for kind, starts in self._starts.items():
            self._known[kind][:] = starts

    def known(self, reference: int) -> int:
        """Return the address of what the array of a scalar was set to."""
        e = _element(self._scalars[reference].element)
        array = self._known[e.type]
        return int(array.ctypes.data + self._offsets[e.type, e.value_reference] * array.itemsize)

    def name(self, reference: int) -> str:
        """Return the name of a scalar."""
        return self._scalars[reference].name

    def is_structural(self, reference: int) -> bool:
        """Whether a scalar is a structural parameter, which is set in configuration mode."""
        return self._scalars[reference].causality == "structuralParameter"

    def calls(self, references: References) -> tuple[Call, ...]:
        """Return the calls that a request takes."""
        found = self._calls.get(references)
        if found is None:
            found = self._calls[references] = tuple(self._made(references))
        return found

    def _made(self, references: References) -> list[Call]:
        elements = [_element(self._scalars[r].element) for r in references]
        calls: list[Call] = []
        for kind in dict.fromkeys(e.type for e in elements):
            mine = [(place, e) for place, e in enumerate(elements) if e.type == kind]
            arrays = {e.value_reference: e.size for _, e in mine}
            begins = dict(zip(arrays, np.cumsum([0, *arrays.values()]).tolist(), strict=False))
            known = [self._offsets[kind, r] + i for r, size in arrays.items() for i in range(size)]
            calls.append(
                Call(
                    kind,
                    (ctypes.c_uint * len(arrays))(*arrays),
                    np.array([place for place, _ in mine], dtype=np.int64),
                    np.array([begins[e.value_reference] + e.index for _, e in mine], dtype=np.int64),
                    np.array(known, dtype=np.int64),
                    sum(arrays.values()),
                )
            )
        return calls

    def with_values(self, call: Call, values: Sequence[Any]) -> Any:
        """Return all values of a call's arrays, some of them set to `values`; shape (size,)."""
        known = self._known[call.type]
        known[call.known[call.indices]] = values
        return known[call.known]

    def beyond(self, call: Call, values: Iterable[Any]) -> int | None:
        """Return the place among `values`, whole numbers, of the first that the call's type cannot hold."""
        least, largest = range_of(call.type)
        return next((i for i, value in enumerate(values) if not least <= value <= largest), None)


def _element(element: Element | None) -> Element:
    assert element is not None, "a scalar of FMI 3.0 has its element"
    return element


def _plain(start: Scalar) -> Any:
    return start.encode() if isinstance(start, str) else start


def _zero(kind: str) -> Any:
    return b"" if kind == "String" else 0
