"""A system and an experiment as a .ssp that other tools take: the profile that all of them read.

One flat system; connectors of FMUs only; a connection an element; values of parameters, initial states and inputs in
the variables' own units, in one named parameter set a component; the times of the DefaultExperiment; the FMUs in
resources/. Where the units of both ends differ, the connection has the factor, and forbids that one is applied twice.
Signals are FMUs beside those that they feed (signals.py). What SSP has no place for stands in our own annotation
(own.py).
"""

import json
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from cosim.ssp import signals
from cosim.ssp.archive import epoch, file_name, names_of, write_archive
from cosim.ssp.errors import SspError
from cosim.ssp.own import NAMESPACE, TYPE, encode
from cosim.ssp.package import STRUCTURE
from cosim.ssp.xml import SSC, SSD, SSV, Element, check
from cosim.system import Experiment, System
from cosim.system.wiring import Link, Port, Wiring
from cosim.time import exact_seconds
from fmus.description.description import ModelDescription, Scalar, ScalarVariable
from fmus.description.units import EXPONENTS, IDENTITY, Unit, conversion

VERSIONS = ("1.0", "2.0")
PARAMETER_SET = "initialValues"
"""The name of the parameter set of each component: some tools ask for it."""

CONNECTORS = ("input", "output")


def write(
    path: Path,
    system: System,
    experiment: Experiment,
    wiring: Wiring,
    fmus: Mapping[str, Path],
    *,
    version: str = "1.0",
    starts: Mapping[Port, Scalar] | None = None,
    tool: str = "adcs-cosim",
    extra: Mapping[str, bytes] | None = None,
    tables: Mapping[str, Path] | None = None,
) -> Path:
    """Write a wired system, the same bytes for the same system; raises `SspError`.

    `fmus`: instance -> its file. `starts`: values that connected inputs have at the start, for tools that do not carry
    outputs over before the first step. `extra`: further files of the archive, by name. `tables`: by the names of the
    wiring's feeds, FMUs whose outputs are these signals.
    """
    if missing := [feed.component for name, feed in wiring.feeds.items() if name not in (tables or {})]:
        needed = ", ".join(f"{name!r}: ..." for name in wiring.feeds)
        problem = f"signals feed {', '.join(missing)}: they need FMUs in it, tables={{{needed}}}"
        raise SspError(str(path), [problem])
    told, samples = signals.written(system, wiring, tables or {})
    wiring, tabled = signals.with_tables(wiring, tables or {})
    fmus = {**fmus, **tabled}
    if version not in VERSIONS:
        raise SspError(str(path), [f"there is no SSP {version} to write. Versions: {', '.join(VERSIONS)}"])
    sources = names_of(fmus)
    values = {**wiring.settings, **(starts or {}), **wiring.held}
    own = {name: {p.variable: v for p, v in values.items() if p.component == name} for name in wiring.components}
    sets = {name: f"resources/{file_name(name)}.ssv" for name, found in own.items() if found}
    texts: dict[str, bytes] = dict(samples)
    try:
        root = _structure(system, experiment, wiring, sources, sets, version, tool)
        _annotate(root, system, experiment, told)
        texts[STRUCTURE] = _bytes(root, path)
        for name, file in sets.items():
            texts[file] = _bytes(_parameter_set(own[name], wiring.descriptions[name], version, tool), path)
    except ValueError as error:  # of lxml: a text with characters that XML has not
        raise SspError(str(path), [f"it cannot be written: {error}"]) from error
    return write_archive(path, texts | dict(extra or {}), {sources[name]: fmus[name] for name in sources})


def _bytes(root: Element, path: Path) -> bytes:
    """Return a file as bytes, which keep to the schema; raises `SspError`."""
    from lxml import etree

    check(root, root.tag, str(path))
    return etree.tostring(root, xml_declaration=True, encoding="UTF-8", pretty_print=True)


def generated(tool: str) -> dict[str, str]:
    """Return the attributes that say who made a file; when, only if SOURCE_DATE_EPOCH says it."""
    said = epoch()
    when = {} if said is None else {"generationDateAndTime": time.strftime("%Y-%m-%dT%H:%M:%SZ", time.gmtime(said))}
    return {"generationTool": tool, **when}


# ---- the structure -----------------------------------------------------------------------------------------------


def _structure(
    system: System,
    experiment: Experiment,
    wiring: Wiring,
    sources: Mapping[str, str],
    sets: Mapping[str, str],
    version: str,
    tool: str,
) -> Element:
    from lxml import etree

    names = {"ssd": SSD, "ssc": SSC, "ssv": SSV}
    about = {"version": version, "name": system.name, **generated(tool)}
    root = etree.Element(f"{{{SSD}}}SystemStructureDescription", about, nsmap=names)
    top = etree.SubElement(root, f"{{{SSD}}}System", name=file_name(system.name))
    units = _common_units(wiring)
    enumerations = _enumerations(wiring)
    elements = etree.SubElement(top, f"{{{SSD}}}Elements")
    for name, fmu in wiring.descriptions.items():
        component = etree.SubElement(elements, f"{{{SSD}}}Component", name=name, source=sources[name])
        component.set("type", "application/x-fmu-sharedlibrary")
        connectors = [v for v in fmu.variables.values() if v.causality in CONNECTORS]
        if connectors:
            parent = etree.SubElement(component, f"{{{SSD}}}Connectors")
            for variable in connectors:
                _connector(parent, variable, fmu, units, enumerations)
        if name in sets:
            bindings = etree.SubElement(component, f"{{{SSD}}}ParameterBindings")
            etree.SubElement(bindings, f"{{{SSD}}}ParameterBinding", source=sets[name])
    if wiring.links:
        connections = etree.SubElement(top, f"{{{SSD}}}Connections")
        for link in wiring.links:
            _connection(connections, link, wiring)
    _define_enumerations(root, enumerations)
    _define_units(root, units, SSD)
    times = {"startTime": experiment.start_time, "stopTime": experiment.stop_time}
    seconds = {name: repr(float(exact_seconds(value, name))) for name, value in times.items()}
    etree.SubElement(root, f"{{{SSD}}}DefaultExperiment", seconds)
    return root


def _annotate(root: Element, system: System, experiment: Experiment, told: Mapping[str, Any]) -> None:
    """Add what SSP has no place for; `told`: of signals."""
    from lxml import etree

    annotations = etree.SubElement(root, f"{{{SSD}}}Annotations")
    annotation = etree.SubElement(annotations, f"{{{SSC}}}Annotation", type=TYPE)
    flight = etree.SubElement(annotation, f"{{{NAMESPACE}}}Flight", nsmap={"adcs": NAMESPACE}, version="1")
    etree.SubElement(flight, f"{{{NAMESPACE}}}System").text = encode(system, ("name", "components", "inputs"))
    etree.SubElement(flight, f"{{{NAMESPACE}}}Experiment").text = encode(experiment)
    if told:
        etree.SubElement(flight, f"{{{NAMESPACE}}}Signals").text = json.dumps(told)


def _connector(
    parent: Element,
    variable: ScalarVariable,
    fmu: ModelDescription,
    units: Mapping[str, Unit],
    enumerations: Mapping[tuple[tuple[str, int], ...], str],
) -> None:
    from lxml import etree

    element = etree.SubElement(parent, f"{{{SSD}}}Connector", name=variable.name, kind=variable.causality)
    if variable.type == "Enumeration" and not variable.items:
        return  # the type is that of the FMU's variable then
    kind = etree.SubElement(element, f"{{{SSC}}}{variable.type}")
    if variable.type == "Enumeration":
        kind.set("name", enumerations[tuple((variable.items or {}).items())])
    if variable.unit is not None and units.get(variable.unit) == fmu.units.get(variable.unit) is not None:
        kind.set("unit", variable.unit)


def _connection(parent: Element, link: Link, wiring: Wiring) -> None:
    from lxml import etree

    ends = {
        "startElement": link.source.component,
        "startConnector": link.source.variable,
        "endElement": link.target.component,
        "endConnector": link.target.variable,
    }
    element = etree.SubElement(parent, f"{{{SSD}}}Connection", ends)
    units = [wiring.variable(port).unit for port in (link.source, link.target)]
    tables = [wiring.descriptions[port.component].units for port in (link.source, link.target)]
    if link.conversion != IDENTITY or conversion(units[0], units[1], *tables) != IDENTITY:
        element.set("suppressUnitConversion", "true")
        numbers = {"factor": repr(link.conversion.factor), "offset": repr(link.conversion.offset)}
        etree.SubElement(element, f"{{{SSC}}}LinearTransformation", numbers)


def _common_units(wiring: Wiring) -> dict[str, Unit]:
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


def _define_units(root: Element, units: Mapping[str, Unit], namespace: str) -> None:
    from lxml import etree

    if not units:
        return
    parent = etree.SubElement(root, f"{{{namespace}}}Units")
    for name, unit in sorted(units.items()):
        assert unit.base is not None
        exponents = {e: str(n) for e, n in zip(EXPONENTS, unit.base.exponents, strict=True) if n}
        to_si = {"factor": unit.base.to_si.factor, "offset": unit.base.to_si.offset}
        said = {n: repr(v) for n, v in to_si.items() if v != (1.0 if n == "factor" else 0.0)}
        element = etree.SubElement(parent, f"{{{SSC}}}Unit", name=name)
        etree.SubElement(element, f"{{{SSC}}}BaseUnit", {**exponents, **said})


def _enumerations(wiring: Wiring) -> dict[tuple[tuple[str, int], ...], str]:
    sets = [
        v.items for fmu in wiring.descriptions.values() for v in fmu.variables.values() if v.causality in CONNECTORS
    ]
    different = dict.fromkeys(tuple(items.items()) for items in sets if items)
    return {items: f"Enumeration{n}" for n, items in enumerate(different, 1)}


def _define_enumerations(root: Element, enumerations: Mapping[tuple[tuple[str, int], ...], str]) -> None:
    from lxml import etree

    if not enumerations:
        return
    parent = etree.SubElement(root, f"{{{SSD}}}Enumerations")
    for items, name in enumerations.items():
        element = etree.SubElement(parent, f"{{{SSC}}}Enumeration", name=name)
        for literal, value in items:
            etree.SubElement(element, f"{{{SSC}}}Item", name=literal, value=str(value))


# ---- values ------------------------------------------------------------------------------------------------------


def _parameter_set(values: Mapping[str, Scalar], fmu: ModelDescription, version: str, tool: str) -> Element:
    """Return a parameter set in the variables' own units, which are not said: some tools know no unit."""
    from lxml import etree

    about = {"version": version, "name": PARAMETER_SET, **generated(tool)}
    root = etree.Element(f"{{{SSV}}}ParameterSet", about, nsmap={"ssv": SSV, "ssc": SSC})
    parent = etree.SubElement(root, f"{{{SSV}}}Parameters")
    for name, value in values.items():
        variable = fmu.variables[name]
        parameter = etree.SubElement(parent, f"{{{SSV}}}Parameter", name=name)
        etree.SubElement(parameter, f"{{{SSV}}}{variable.type}", value=_text(variable, value))
    return root


def _text(variable: ScalarVariable, value: Scalar) -> str:
    if variable.type == "Boolean":
        return "true" if value else "false"
    if variable.type == "Enumeration":
        literals = {number: literal for literal, number in (variable.items or {}).items()}
        return literals.get(int(value), str(value))
    if variable.type == "Real":
        number = float(value)
        return repr(number) if number - number == 0 else {"nan": "NaN", "inf": "INF", "-inf": "-INF"}[repr(number)]
    return str(value) if variable.type == "String" else str(int(value))
