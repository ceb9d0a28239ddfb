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


class Span:
    """The step that is being taken: in communication step `k`, from `t` to `t + h`, s.

    Ready calls read where it is for ctypes: `start`, by the component's own clock, and `size`.
    """

    def __init__(self) -> None:
        self.k, self.t, self.h = 0, 0.0, 0.0
        self.start, self.size = ctypes.c_double(), ctypes.c_double()

    def begin(self, k: int, t: float, h: float) -> None:
        """Go to another step."""
        self.k, self.t, self.h = k, t, h
        self.start.value, self.size.value = t, h


def _discard() -> int:
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
        return self._of_values("fmi2GetReal", references, into)

    def set_real(self, references: References, values: FloatArray) -> Ready:
        """Return fmi2SetReal."""
        return self._of_values("fmi2SetReal", references, values)

    def set_input_derivatives(self, references: References, orders: References, values: FloatArray) -> Ready:
        """Return fmi2SetRealInputDerivatives."""
        return self._of_values("fmi2SetRealInputDerivatives", references, values, orders)

    def get_output_derivatives(self, references: References, orders: References, into: FloatArray) -> Ready:
        """Return fmi2GetRealOutputDerivatives."""
        return self._of_values("fmi2GetRealOutputDerivatives", references, into, orders)

    def do_step(self, span: Span) -> Ready:
        """Return fmi2DoStep."""

        def stepped(status: int) -> Callable[[], int] | None:
            self._stepped(status, span.start.value, span.size.value)
            return _discard if status == DISCARD else None  # one that counts: there is no other

        return self._call("fmi2DoStep", stepped, span.start, span.size, ctypes.c_int(1))

    def _of_values(
        self, function: str, references: References, values: FloatArray, orders: Sequence[int] = ()
    ) -> Ready:
        n = len(references)
        if values.shape != (n,) or values.dtype != np.float64 or not values.flags.c_contiguous:
            raise ValueError(f"{function}: {n} values in a contiguous array of doubles, not {values.shape}")
        arguments: list[Any] = [(ctypes.c_uint * n)(*references), ctypes.c_size_t(n)]
        arguments += [(ctypes.c_int * n)(*orders)] if orders else []
        returned = partial(self._returned, function)
        return self._call(function, returned, *arguments, np.ctypeslib.as_ctypes(values))

    def _call(self, function: str, returned: Callable[[int], Callable[[], int] | None], *arguments: Any) -> Ready:
        """Return a call; `returned` takes each status that is not fmi2OK, and returns what is called from then on."""
        component = ctypes.c_void_p(self._interface.component)
        call = partial(_FUNCTION(self._interface.functions[function]), component, *arguments)
        crumb, instance, name = self._crumb, self._instance, breadcrumb.address(function.encode())

        def made() -> None:
            nonlocal call
            crumb.instance, crumb.function = instance, name
            try:
                status = call()
            finally:
                crumb.function = None
            if status:
                call = returned(status) or call

        return made


def ready_calls(slave: Slave) -> ReadyCalls | None:
    """Return the ready calls of a slave that offers them, by a method `ready`."""
    offer: Callable[[], ReadyCalls | None] | None = getattr(slave, "ready", None)
    return None if offer is None else offer()
