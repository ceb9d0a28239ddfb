"""Arrays of FMI 3.0 in a package of SSP 2.0: a connector, a connection, a parameter for a whole array.

FMUs of FMI 2.0 have no arrays: theirs are connectors element by element, in both versions. SSP 1.0 has no arrays at
all. A connection of single elements would need SSP 2.0's startIndices and endIndices, of which the standard's schema
does not say where they count from: it is refused.
"""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass

from cosim.system.wiring import Link, Wiring
from fmus.description.description import ModelDescription, Scalar, ScalarVariable
from fmus.description.names import split_element


@dataclass(frozen=True, eq=False)
class Whole:
    """What is one variable in an FMU's file: a scalar, or an array of `elements`, row by row; `first` of them."""

    name: str
    shape: tuple[int, ...]
    elements: tuple[str, ...]
    first: ScalarVariable


@dataclass(frozen=True)
class Wire:
    """A connection from one whole variable to another; `link`: of their first elements."""

    source: str
    target: str
    link: Link


def wholes(fmu: ModelDescription, names: Iterable[str]) -> dict[str, Whole]:
    """Return scalar -> the whole variable that it is of, for these scalars."""
    found: dict[str, Whole] = {}
    for name in names:
        if name in found:
            continue
        base, _ = split_element(name)
        group = fmu.groups.get(base)
        if group is not None and group.shape and name in group.elements and _is_one(fmu, group.elements):
            whole = Whole(base, group.shape, group.elements, fmu.variables[group.elements[0]])
            found |= dict.fromkeys(group.elements, whole)
        else:
            found[name] = Whole(name, (), (name,), fmu.variables[name])
    return found


def _is_one(fmu: ModelDescription, elements: Iterable[str]) -> bool:
    """Whether scalars are the elements of one array of the file."""
    places = [fmu.variables[e].element for e in elements]
    return len({None if p is None else p.value_reference for p in places}) == 1 and places[0] is not None


def wires(wiring: Wiring, mistakes: list[str]) -> Iterator[Wire]:
    """Yield the connections; those that are not of whole arrays go into `mistakes`, one line each."""
    groups: dict[tuple[str, str, str, str], list[Link]] = {}
    for link in wiring.links:
        ends = [_whole(wiring, p.component, p.variable) for p in (link.source, link.target)]
        groups.setdefault((link.source.component, ends[0].name, link.target.component, ends[1].name), []).append(link)
    for (a, source, b, target), links in groups.items():
        pairs = [(link.source.variable, link.target.variable) for link in links]
        ends = [_whole(wiring, link.component, link.variable) for link in (links[0].source, links[0].target)]
        every = list(zip(ends[0].elements, ends[1].elements, strict=False))
        same = len(ends[0].elements) == len(ends[1].elements) and len({link.conversion for link in links}) == 1
        if same and sorted(pairs) == sorted(every):
            yield Wire(source, target, next(link for link in links if link.source.variable == every[0][0]))
        else:
            both = f"{a}.{pairs[0][0]} -> {b}.{pairs[0][1]}"
            mistakes.append(f"{both} connects an element of an array of FMI 3.0: SSP carries such arrays whole alone")


def _whole(wiring: Wiring, component: str, variable: str) -> Whole:
    return wholes(wiring.descriptions[component], [variable])[variable]


def unwritable(wiring: Wiring, version: str) -> list[str]:
    """Return what a version has no place for: arrays of FMI 3.0 in SSP 1.0."""
    found: list[str] = []
    for name, fmu in wiring.descriptions.items():
        arrays = {w.name for w in wholes(fmu, fmu.variables).values() if w.shape}
        if arrays and version.startswith("1"):
            some = ", ".join(sorted(arrays)[:3]) + (", ..." if len(arrays) > 3 else "")
            found.append(f"{name} is an FMU of FMI 3.0 with arrays ({some}), which SSP 1.0 has not: write SSP 2.0")
    return found


def filled(values: Mapping[str, Scalar], fmu: ModelDescription) -> dict[Whole, list[Scalar]]:
    """Return whole variable -> the values of all its elements, start values where none is given."""
    found: dict[Whole, list[Scalar]] = {}
    for whole in dict.fromkeys(wholes(fmu, values).values()):
        starts = [fmu.variables[e].start for e in whole.elements]
        zero: Scalar = "" if whole.first.type == "String" else 0
        some = [
            values.get(e, zero if start is None else start) for e, start in zip(whole.elements, starts, strict=True)
        ]
        found[whole] = some
    return found
