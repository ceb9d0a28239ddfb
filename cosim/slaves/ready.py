"""Calls of FMI 2.0 that are made ready once, for a loop in Python that makes the same calls in every step.

Arguments and arrays are those of ctypes already, and the breadcrumb is that of the thread that makes them ready. They
hold for one instance, until it is freed.
"""

import ctypes
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

import numpy as np

from cosim.arrays import FloatArray
from cosim.slaves import breadcrumb
from cosim.slaves.binary import DISCARD
from cosim.slaves.slave import CInterface, References, Slave

Ready = Callable[[], None]
"""A call that only has to be made; raises `CallFailed`."""

_FUNCTION = ctypes.CFUNCTYPE(ctypes.c_int)  # no argtypes: what is passed is of ctypes, and need not be converted
_DO_STEP = ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_void_p, ctypes.c_double, ctypes.c_double, ctypes.c_int)


def _discard(*_: Any) -> int:
    return DISCARD


class ReadyCalls:
    """The calls of one instance.

    `returned(function, status)` takes each status that is not fmi2OK, `stepped(status, t, h)` that of a step.

    Arrays are of doubles, contiguous, a value for each value reference; the calls read and write them where they are.
    """

    def __init__(
        self,
        name: str,
        interface: CInterface,
        returned: Callable[[str, int], None],
        stepped: Callable[[int, float, float], None],
    ) -> None:
        self._interface, self._returned, self._stepped = interface, returned, stepped
        self._crumb, self._instance = breadcrumb.here(), breadcrumb.address(name.encode())

    def get_real(self, references: References, into: FloatArray) -> Ready:
        """Return fmi2GetReal."""
        return self._call("fmi2GetReal", references, into)

    def set_real(self, references: References, values: FloatArray) -> Ready:
        """Return fmi2SetReal."""
        return self._call("fmi2SetReal", references, values)

    def set_input_derivatives(self, references: References, orders: References, values: FloatArray) -> Ready:
        """Return fmi2SetRealInputDerivatives."""
        return self._call("fmi2SetRealInputDerivatives", references, values, orders)

    def get_output_derivatives(self, references: References, orders: References, into: FloatArray) -> Ready:
        """Return fmi2GetRealOutputDerivatives."""
        return self._call("fmi2GetRealOutputDerivatives", references, into, orders)

    def do_step(self) -> Callable[[float, float], None]:
        """Return fmi2DoStep, called with t and h in s."""
        step: Callable[..., int] = _DO_STEP(self._interface.functions["fmi2DoStep"])
        component = ctypes.c_void_p(self._interface.component)
        crumb, instance, name = self._crumb, self._instance, breadcrumb.address(b"fmi2DoStep")
        stepped = self._stepped

        def do_step(t: float, h: float) -> None:
            nonlocal step
            crumb.instance, crumb.function = instance, name
            try:
                status = step(component, t, h, 1)
            finally:
                crumb.function = None
            if status:
                stepped(status, t, h)
                if status == DISCARD:  # and it counts: there is no other
                    step = _discard

        return do_step

    def _call(self, function: str, references: References, values: FloatArray, orders: Sequence[int] = ()) -> Ready:
        n = len(references)
        if values.shape != (n,) or values.dtype != np.float64 or not values.flags.c_contiguous:
            raise ValueError(f"{function}: {n} values in a contiguous array of doubles, not {values.shape}")
        arguments: list[Any] = [ctypes.c_void_p(self._interface.component), (ctypes.c_uint * n)(*references)]
        arguments += [ctypes.c_size_t(n), *([(ctypes.c_int * n)(*orders)] if orders else [])]
        arguments.append(np.ctypeslib.as_ctypes(values))
        call = partial(_FUNCTION(self._interface.functions[function]), *arguments)
        crumb, instance, name = self._crumb, self._instance, breadcrumb.address(function.encode())
        returned = self._returned

        def made() -> None:
            crumb.instance, crumb.function = instance, name
            try:
                status = call()
            finally:
                crumb.function = None
            if status:
                returned(function, status)

        return made


def ready_calls(slave: Slave) -> ReadyCalls | None:
    """Return the ready calls of a slave that offers them, by a method `ready`."""
    offer: Callable[[], ReadyCalls | None] | None = getattr(slave, "ready", None)
    return None if offer is None else offer()
