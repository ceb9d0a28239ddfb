"""An FMI 3.0 instance for the kernel: which function, which array, which element a scalar is; masters/kernel/fmi3.h.

The kernel's whole numbers are those of FMI 2.0, 32 bits: an FMU that exchanges UInt32, Int64 or UInt64, or arrays of
Strings, flies in the Python loop. Values that arrays were set to are one memory for both, so that a set of some
elements sends the others as they are, whoever set them.
"""

import ctypes
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from cosim.slaves.elements import Elements
from fmus.description.arrays import range_of
from fmus.description.description import ModelDescription, ScalarVariable

TYPES = ("Float64", "Float32", "Int8", "UInt8", "Int16", "UInt16", "Int32", "Int64", "Boolean", "String")
"""As fmi3.h numbers them; Int64 is there for Enumerations."""

GET = ctypes.c_void_p * len(TYPES)
OTHERS = ("get_derivatives", "do_step", "get_state", "set_state", "free_state")
FUNCTIONS = ("fmi3GetOutputDerivatives", "fmi3DoStep", "fmi3GetFMUState", "fmi3SetFMUState", "fmi3FreeFMUState")


class Scalar3Structure(ctypes.Structure):
    """A scalar, and the array that it is of."""

    _fields_ = [
        *((name, ctypes.c_longlong) for name in ("type", "index", "size")),
        ("known", ctypes.c_void_p),
        ("array", ctypes.c_uint),
    ]


class Fmi3Structure(ctypes.Structure):
    """An instance, its functions, what its last step said of itself."""

    _fields_ = [
        *((name, ctypes.c_void_p) for name in ("instance", "scalar", "work")),
        ("get", GET),
        ("set", GET),
        *((name, ctypes.c_void_p) for name in OTHERS),
        ("function", ctypes.c_char_p),
        ("last", ctypes.c_double),
        *((name, ctypes.c_longlong) for name in ("terminated", "early", "refused", "refused_value")),
    ]


def obstacle(description: ModelDescription) -> str:
    """Return what of an FMU the kernel cannot carry, "" where it can all."""
    return next((problem for v in description.variables.values() if (problem := _problem(v))), "")


def _problem(variable: ScalarVariable) -> str:
    element = variable.element
    if element is None or variable.causality in ("parameter", "structuralParameter", "independent"):
        return ""
    if element.type in ("UInt32", "Int64", "UInt64"):
        return f"{variable.name} is {element.type}"
    if element.type == "String" and element.size > 1:
        return f"{variable.name} is of an array of Strings"
    least, largest = range_of("Int32")
    if any(not least <= value <= largest for value in (variable.items or {}).values()):
        return f"{variable.name} has items beyond 32 bits"
    return ""


class ForKernel:
    """The structures of one instance; their memory stays where it is."""

    def __init__(self, description: ModelDescription, elements: Elements, addresses: Mapping[str, int]) -> None:
        scalars = [_scalar(v, elements.known) for v in description.variables.values()]
        self._scalars = (Scalar3Structure * max(1, len(scalars)))(*scalars)
        self._work = np.zeros(max([1, *(s.size for s in scalars)]))
        self.told = Fmi3Structure(
            scalar=ctypes.addressof(self._scalars),
            work=self._work.ctypes.data,
            get=GET(*(addresses.get(f"fmi3Get{kind}", 0) for kind in TYPES)),
            set=GET(*(addresses.get(f"fmi3Set{kind}", 0) for kind in TYPES)),
            **{name: addresses[function] for name, function in zip(OTHERS, FUNCTIONS, strict=True)},
            refused=-1,
        )

    def of(self, instance: int) -> int:
        """Return the address of the structure, which has just begun with an instance."""
        told = self.told
        told.instance, told.function, told.refused = instance, None, -1
        told.terminated = told.early = 0
        return ctypes.addressof(told)


def _scalar(variable: ScalarVariable, known: Callable[[int], int]) -> Scalar3Structure:
    element = variable.element
    assert element is not None, "a scalar of FMI 3.0 has its element"
    kind = "Int64" if element.type == "Enumeration" else element.type
    place: Any = 0 if kind == "String" else known(variable.value_reference)
    number = TYPES.index(kind) if kind in TYPES else 0  # of what is not exchanged it does not matter
    return Scalar3Structure(
        type=number, index=element.index, size=element.size, known=place, array=element.value_reference
    )
