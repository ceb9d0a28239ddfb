"""Units and enumerations that the connectors of a package use, defined at its top."""

from collections.abc import Mapping

from cosim.ssp.xml import SSC, SSD, Element
from cosim.system.wiring import Wiring
from fmus.description.units import EXPONENTS, Unit

CONNECTORS = ("input", "output")
"""Causalities of the variables that are connectors."""


def common_units(wiring: Wiring) -> dict[str, Unit]:
    """Return the units with a dimension that all FMUs define alike; of others a connector does not speak.

    SSP knows only whole exponents: kg^(1/2).m has none, and is the unit of the FMU's variable.
    """
    found: dict[str, Unit | None] = {}
    for fmu in wiring.descriptions.values():
        used = {v.unit for v in fmu.variables.values() if v.unit is not None}
        for name in sorted(used & fmu.units.keys()):
            unit = fmu.units[name]
            base = found.setdefault(name, unit)
            if unit.base is None or base is None or base.base != unit.base:
                found[name] = None
    return {name: unit for name, unit in found.items() if unit is not None}


def define_units(root: Element, units: Mapping[str, Unit]) -> None:
    """Add the definitions of units."""
    from lxml import etree

    if not units:
        return
    parent = etree.SubElement(root, f"{{{SSD}}}Units")
    for name, unit in sorted(units.items()):
        assert unit.base is not None
        exponents = {e: str(n) for e, n in zip(EXPONENTS, unit.base.exponents, strict=True) if n}
        to_si = {"factor": unit.base.to_si.factor, "offset": unit.base.to_si.offset}
        said = {n: repr(v) for n, v in to_si.items() if v != (1.0 if n == "factor" else 0.0)}
        element = etree.SubElement(parent, f"{{{SSC}}}Unit", name=name)
        etree.SubElement(element, f"{{{SSC}}}BaseUnit", {**exponents, **said})


def enumerations_of(wiring: Wiring) -> dict[tuple[tuple[str, int], ...], str]:
    """Return items -> a name, for each set of items that a connector has."""
    sets = [
        v.items for fmu in wiring.descriptions.values() for v in fmu.variables.values() if v.causality in CONNECTORS
    ]
    different = dict.fromkeys(tuple(items.items()) for items in sets if items)
    return {items: f"Enumeration{n}" for n, items in enumerate(different, 1)}


def define_enumerations(root: Element, enumerations: Mapping[tuple[tuple[str, int], ...], str]) -> None:
    """Add the definitions of enumerations."""
    from lxml import etree

    if not enumerations:
        return
    parent = etree.SubElement(root, f"{{{SSD}}}Enumerations")
    for items, name in enumerations.items():
        element = etree.SubElement(parent, f"{{{SSC}}}Enumeration", name=name)
        for literal, value in items:
            etree.SubElement(element, f"{{{SSC}}}Item", name=literal, value=str(value))
