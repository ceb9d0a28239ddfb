"""Arrays and structures that C code is given the addresses of."""

import ctypes
from collections.abc import Sequence
from typing import Any

import numpy as np


class Kept:
    """Keeps alive what it has given an address of."""

    def __init__(self) -> None:
        self._all: list[Any] = []

    def array(self, values: Any, kind: Any) -> int:
        """Return the address of a copy of some values."""
        array = np.array(values, dtype=kind)
        self._all.append(array)
        return array.ctypes.data

    def structures(self, kind: type[ctypes.Structure], structures: Sequence[ctypes.Structure]) -> int:
        """Return the address of copies of structures, side by side."""
        array = (kind * max(1, len(structures)))(*structures)
        self._all.append(array)
        return ctypes.addressof(array)
