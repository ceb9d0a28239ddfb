"""Parameter sets (.ssv) and mappings (.ssm), in files of their own or inline, as the values that a binding gives."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from cosim.ssp.errors import SspError
from cosim.ssp.model import TYPES, Assignment, Transformation
from cosim.ssp.package import Package
from cosim.ssp.xml import SSC, SSD, SSM, SSV, Element, check, parse
from fmus.description.description import Scalar
from fmus.description.units import EXPONENTS, BaseUnit, Conversion, Unit

SET, MAPPING = "application/x-ssp-parameter-set", "application/x-ssp-parameter-mapping"


@dataclass(frozen=True)
class Place:
    """Where a binding stands: the package, the name of the .ssd in it, and of the component's FMU, "" at a system."""

    package: Package
    structure: str
    fmu: str = ""

    @property
    def label(self) -> str:
        """The file, as messages name it."""
        return f"{self.package.label}#{self.structure}"


def bound(element: Element, place: Place) -> tuple[Assignment, ...]:
    """Return what the ParameterBindings of an element give, later ones after earlier ones; raises `SspError`."""
    return tuple(
        assignment
        for binding in element.iterfind(f"{{{SSD}}}ParameterBindings/{{{SSD}}}ParameterBinding")
        for assignment in _binding(binding, place)
    )


def _binding(binding: Element, place: Place) -> Iterator[Assignment]:
    kind = binding.get("type", SET)
    if kind != SET:
        raise SspError(place.label, [f"a ParameterBinding is of type {kind!r}, read are sets of type {SET!r}"])
    inline = binding.find(f"{{{SSD}}}ParameterValues")
    values, file = _content(binding, inline, f"{{{SSV}}}ParameterSet", "parameter set", place)
    prefix = binding.get("prefix", "")
    given = [_parameter(p, read_units(values), prefix, file) for p in values.iter(f"{{{SSV}}}Parameter")]
    names = [assignment.name for assignment in given]
    twice = sorted({name for name in names if names.count(name) > 1}) if len(set(names)) < len(names) else []
    if twice:
        raise SspError(file, [f"it gives the parameter {twice[0]!r} twice"])
    mapping = binding.find(f"{{{SSD}}}ParameterMapping")
    if mapping is None:
        yield from given
    else:
        yield from _mapped(mapping, given, place)


def _content(element: Element, inline: Element | None, root: str, what: str, place: Place) -> tuple[Element, str]:
    """Return the root of a set or mapping that an element refers to or holds, and the file that it stands in."""
    source = element.get("source")
    within = list(inline) if inline is not None else []
    if (source is None) == (not within):
        problem = "gives none: neither a source nor one inline" if source is None else "gives two: a source and inline"
        raise SspError(place.label, [f"a binding needs one {what}, but it {problem}"])
    if source is None:
        if len(within) > 1:
            raise SspError(place.label, [f"a binding holds {len(within)} elements inline, needed is one {what}"])
        check(within[0], root, place.label)
        return within[0], place.label
    if element.get("sourceBase") == "component":
        if not place.fmu:
            raise SspError(place.label, [f"the {what} {source!r} is to lie in a component, but a system has no file"])
        name = place.package.resolve(source)
        text, file = place.package.text_within(place.fmu, name), f"{place.package.label}#{place.fmu}#{name}"
    else:
        name = place.package.resolve(source, place.structure)
        text, file = place.package.text(name), f"{place.package.label}#{name}"
    return parse(text, root, file), file


def _parameter(parameter: Element, units: Mapping[str, Unit], prefix: str, file: str) -> Assignment:
    name = parameter.get("name", "")
    kinds = [child for child in parameter if _tag(child) in (*TYPES, "Binary")]
    value, kind = kinds[0], _tag(kinds[0])
    if kind == "Binary":
        raise SspError(file, [f"the parameter {name!r} is Binary, which FMI 2.0 has not"])
    dimensions = [d for d in parameter if _tag(d) == "Dimension"]
    if any(d.get("sizeConnector") for d in dimensions):
        raise SspError(file, [f"the size of the parameter {name!r} is that of a connector, which is not read"])
    items = [_scalar(TYPES[kind], text) for text in _texts(value, TYPES[kind])]
    sizes = [d.get("size") for d in dimensions]
    if sizes and None not in sizes and len(items) != math.prod(int(n or 0) for n in sizes):
        both = f"{len(items)} values, its dimensions say {' x '.join(map(str, sizes))}"
        raise SspError(file, [f"the parameter {name!r} has {both}"])
    given = items if dimensions else items[0] if len(items) == 1 else None
    if given is None:
        raise SspError(file, [f"the parameter {name!r} has {len(items)} values but no Dimension"])
    unit = value.get("unit")
    if unit is not None and unit not in units:
        units = {**units, unit: Unit(unit)}
    return Assignment(prefix + name, given, TYPES[kind], unit, units)


def _texts(value: Element, kind: str) -> Sequence[str]:
    """Return the texts of a value's elements: SSP 2.0 has lists, of texts as child elements."""
    children = [child.get("value", "") for child in value if _tag(child) == "Value"]
    if kind in ("String", "Enumeration"):
        return children or [value.get("value", "")]
    return value.get("value", "").split()


def _scalar(kind: str, text: str) -> Scalar:
    if kind == "Boolean":
        return text in ("true", "1")
    if kind == "Integer":
        return int(text)
    return float(text) if kind == "Real" else text


def _mapped(element: Element, given: Sequence[Assignment], place: Place) -> Iterator[Assignment]:
    """Yield what a mapping makes of a set: only what it names, under its new name."""
    kind = element.get("type", MAPPING)
    if kind != MAPPING:
        raise SspError(place.label, [f"a ParameterMapping is of type {kind!r}, read are those of type {MAPPING!r}"])
    mapping, file = _content(element, element, f"{{{SSM}}}ParameterMapping", "parameter mapping", place)
    named = {assignment.name: assignment for assignment in given}
    targets: set[str] = set()
    for entry in mapping.iterfind(f"{{{SSM}}}MappingEntry"):
        source, target = entry.get("source", ""), entry.get("target", "")
        if target in targets:
            raise SspError(file, [f"it maps two parameters to {target!r}"])
        targets.add(target)
        if source not in named:
            raise SspError(file, [f"it maps {source!r}, which the parameter set has not: {_listed(named)}"])
        old = named[source]
        suppress = entry.get("suppressUnitConversion") in ("true", "1")
        yield Assignment(target, old.value, old.type, old.unit, old.units, transformation_of(entry), suppress)


def transformation_of(element: Element) -> Transformation | None:
    """Return the transformation that a connection or an entry of a mapping has."""
    for child in element:
        kind = _tag(child)
        if kind == "LinearTransformation":
            return Transformation(kind, float(child.get("factor", "1")), float(child.get("offset", "0")))
        if kind.endswith("MappingTransformation"):
            entries = [(entry.get("source", ""), entry.get("target", "")) for entry in child]
            return Transformation(kind, table=dict(entries))
    return None


def read_units(root: Element) -> dict[str, Unit]:
    """Return the units that a file defines."""
    found: dict[str, Unit] = {}
    for unit in root.iter(f"{{{SSC}}}Unit"):
        base = unit.find(f"{{{SSC}}}BaseUnit")
        if base is None:
            continue
        exponents = tuple(int(base.get(e, "0")) for e in EXPONENTS)
        to_si = Conversion(float(base.get("factor", "1")), float(base.get("offset", "0")))
        name = unit.get("name", "")
        found[name] = Unit(name, BaseUnit(exponents, to_si))
    return found


def _tag(element: Element) -> str:
    """Return the name of an element without its namespace."""
    return element.tag.rpartition("}")[2]


def _listed(names: Mapping[str, object]) -> str:
    return "it has " + (", ".join(list(names)[:10]) + (", ..." if len(names) > 10 else "") or "none")
