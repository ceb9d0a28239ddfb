"""What goes between any output and any input: `Notch:width=3,unit=N.m` has three elements in N m.

    y follows u, element by element; each file here says how                                      (1)

Symbols: u what comes in, y what goes out, columns of `width` elements in `unit`, any of framework/units.py.
Source: none needed.
Invariants: at the start each shows what it would if its input had always been what it is then: nothing jumps.
Limits: one unit for all elements. The elements of a quaternion, changed one by one, are no unit quaternion any more.
"""

from ..framework import Component, ComponentError, Input, Output, Variable


class Filter(Component):
    """Declares u and y; a subclass says what is between them."""

    role = "filter"
    width: int = 1  # structural: how many elements
    unit: str = "1"  # structural: of u and y

    u = Input(unit="unit", shape=("width",), doc="what comes in")
    y = Output(unit="unit", shape=("width",), doc="what goes out")

    def declare(self) -> dict[str, Variable]:
        if not self.width:
            raise ComponentError(self.name, "width = 0: a filter has one element at least.")
        return {}
