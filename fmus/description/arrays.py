"""Variables of FMI 3.0 as scalars: an array A of 2 x 3 is A[1,1] to A[2,3], written as FMI 2.0's arrays are here.

Dimensions that follow a structural parameter are those of its start value. Float32 and Float64 are Real, all integers
Integer; what each is in the FMU stands in `ScalarVariable.element`. Binary and Clock variables are listed by name, no
value of theirs is exchanged. fmpy has parsed the file; what it leaves out is read from the element.
"""

import math
from collections.abc import Mapping, Sequence
from typing import Any, cast

from fmus.description.description import Element, Scalar, ScalarVariable, Type
from fmus.description.names import canonical, element, indices

REALS = ("Float32", "Float64")
INTEGERS = {f"{sign}Int{bits}": bits for sign in ("", "U") for bits in (8, 16, 32, 64)}
UNSERVED = ("Binary", "Clock")

LARGEST = 10**6
"""How many scalars all arrays of an FMU may have together."""


def range_of(kind: str) -> tuple[int, int]:
    """Return the least and the largest value of an integer type of FMI 3.0, or of FMI 2.0 for any other name."""
    if kind == "Enumeration":
        kind = "Int64"
    bits = INTEGERS.get(kind, 32)
    return (0, 2**bits - 1) if kind.startswith("U") else (-(2 ** (bits - 1)), 2 ** (bits - 1) - 1)


class Arrays:
    """The variables of a description as fmpy has it; `root` is its fmiModelDescription element."""

    def __init__(self, description: Any, root: Any) -> None:
        listed: Sequence[Any] = description.modelVariables
        self._tags = {v.get("name"): v for v in root.find("ModelVariables") if isinstance(v.tag, str)}
        self._served = [v for v in listed if v.type not in UNSERVED]
        self.unserved = {canonical(v.name): str(v.type) for v in listed if v.type in UNSERVED}
        total = sum(math.prod(v.shape) for v in self._served)
        if total > LARGEST:
            raise ValueError(f"its arrays have {total} elements, at most {LARGEST} are taken")
        self._names = {v.name: _names(v) for v in self._served}

    @property
    def sizes(self) -> dict[str, tuple[str, ...]]:
        """Structural parameter -> the arrays that take a dimension from it."""
        found: dict[str, dict[str, None]] = {}
        for v in self._served:
            for dimension in v.dimensions:
                if dimension.variable is not None:
                    found.setdefault(canonical(dimension.variable.name), {})[v.name] = None
        return {name: tuple(arrays) for name, arrays in found.items()}

    def variables(self) -> dict[str, ScalarVariable]:
        """Return all scalars by name; raises ValueError for two of one name."""
        found: dict[str, ScalarVariable] = {}
        for v in self._served:
            starts = self._starts(v)
            for i, name in enumerate(self._names[v.name]):
                if name in found:
                    raise ValueError(f"two variables have one name, {name!r}")
                found[name] = self._scalar(v, name, i, starts[i], len(found))
        return found

    def unknowns(self, section: Sequence[Any]) -> dict[str, tuple[str, ...] | None]:
        """Return scalar -> the scalars that it may depend on, None where the file says nothing; arrays whole."""
        found: dict[str, tuple[str, ...] | None] = {}
        for u in section:
            if u.dependencies is None:
                names = None
            else:
                names = tuple(n for d in u.dependencies for n in self._names.get(d.name, ()))
            alike = [v for v in self._served if v is u.variable or v.alias is u.variable]
            found |= dict.fromkeys([n for v in alike for n in self._names[v.name]], names)
        return found

    def _scalar(self, v: Any, name: str, index: int, start: Scalar | None, place: int) -> ScalarVariable:
        tag = self._tags.get(v.name if v.alias is None else v.alias.name)
        items = v.declaredType.items if v.type == "Enumeration" and v.declaredType is not None else None
        rate_of = self._names.get(v.derivative.name, ()) if v.derivative is not None else ()
        return ScalarVariable(
            name=name,
            value_reference=place,
            type=_type(v.type),
            causality=v.causality,
            variability=v.variability,
            initial=v.initial,
            unit=_declared(v, tag, "unit"),
            display_unit=_declared(v, tag, "displayUnit"),
            start=start,
            nominal=abs(float(_declared(v, tag, "nominal") or 1.0)) or 1.0,
            minimum=_number(_declared(v, tag, "min")),
            maximum=_number(_declared(v, tag, "max")),
            items=None if items is None else {item.name: int(item.value) for item in items},
            derivative=rate_of[index] if index < len(rate_of) else None,
            description=v.description or "",
            element=Element(v.type, v.valueReference, index, math.prod(v.shape)),
        )

    def _starts(self, v: Any) -> Sequence[Scalar | None]:
        """Return the start value of each element; one value is that of all; raises ValueError for another number."""
        size, tag = math.prod(v.shape), self._tags.get(v.name if v.alias is None else v.alias.name)
        if v.type == "String":
            texts = [start.get("value", "") for start in tag.findall("Start")] if tag is not None else []
        else:
            texts = (v.start or "").split()
        if not texts:
            return [None] * size
        if len(texts) not in (1, size):
            raise ValueError(f"{v.name} has {len(texts)} start values for {size} elements")
        kind = _type(v.type)
        values = [_start(kind, text) for text in texts]
        return values * size if len(values) == 1 else values


def _names(v: Any) -> tuple[str, ...]:
    if not v.dimensions:
        return (canonical(v.name),)
    return tuple(element(v.name, index) for index in indices(v.shape))


def _type(kind: str) -> Type:
    return "Real" if kind in REALS else "Integer" if kind in INTEGERS else cast(Type, kind)


def _start(kind: Type, text: str) -> Scalar:
    if kind == "Boolean":
        return text in ("true", "1")
    return text if kind == "String" else float(text) if kind == "Real" else int(text)


def _declared(v: Any, tag: Mapping[str, str] | None, attribute: str) -> str | None:
    """Return an attribute of a variable, or else of its declared type; fmpy leaves out those of unsigned integers."""
    own = getattr(v, attribute) or (None if tag is None else tag.get(attribute))
    return own or getattr(v.declaredType, attribute, None) or None


def _number(text: str | None) -> float | None:
    return None if text is None else float(text)
