"""Interface -> modelDescription.xml: the one writer, for every back end.

pythonfmu writes no units, dependencies or initial unknowns and a random GUID, so its XML is replaced by this one.
"""

import sys
from dataclasses import dataclass
from typing import Any

from lxml import etree

from components.framework.units import BASE_UNITS, UNITS
from fmus.export.interface import Interface, Scalar, Unknown

TOOL = "adcs-cosim"
Element = Any  # lxml gives its element class no public name
LOG_CATEGORIES = ("logAll", "logStatusWarning", "logStatusDiscard", "logStatusError", "logStatusFatal")


@dataclass(frozen=True)
class Capabilities:
    """Capability flags of the CoSimulation element, and its source files."""

    needs_execution_tool: bool = False
    interpolates_inputs: bool = False
    output_derivative_order: int = 0
    directional_derivatives: bool = False
    source_files: tuple[str, ...] = ()


def write(interface: Interface, capabilities: Capabilities, guid: str) -> bytes:
    """Return modelDescription.xml. guid: a hash of interface, equations, runtime and back end."""
    cls = type(interface.component)
    doc = (cls.__doc__ or sys.modules[cls.__module__].__doc__ or "").strip().partition("\n")[0]
    root = etree.Element(
        "fmiModelDescription",
        fmiVersion="2.0",
        modelName=interface.model_name,
        guid=guid,
        description=doc,
        generationTool=TOOL,
        variableNamingConvention="structured",
    )
    _co_simulation(root, interface.model_name, capabilities)
    _units(root, interface)
    categories = etree.SubElement(root, "LogCategories")
    for name in LOG_CATEGORIES:
        etree.SubElement(categories, "Category", name=name)
    etree.SubElement(root, "DefaultExperiment", startTime="0.0", stopTime="10.0", stepSize="0.001")
    _annotations(root, interface)
    variables = etree.SubElement(root, "ModelVariables")
    for scalar in interface.variables:
        _variable(variables, scalar)
    _structure(root, interface)
    return etree.tostring(root, xml_declaration=True, encoding="UTF-8", pretty_print=True)


def _flag(value: bool) -> str:
    return "true" if value else "false"


def _co_simulation(root: Element, identifier: str, capabilities: Capabilities) -> None:
    element = etree.SubElement(
        root,
        "CoSimulation",
        modelIdentifier=identifier,
        needsExecutionTool=_flag(capabilities.needs_execution_tool),
        canHandleVariableCommunicationStepSize="true",
        canInterpolateInputs=_flag(capabilities.interpolates_inputs),
        maxOutputDerivativeOrder=str(capabilities.output_derivative_order),
        canRunAsynchronuously="false",
        canBeInstantiatedOnlyOncePerProcess="false",
        canNotUseMemoryManagementFunctions="true",
        canGetAndSetFMUstate="true",
        canSerializeFMUstate="true",
        providesDirectionalDerivative=_flag(capabilities.directional_derivatives),
    )
    if capabilities.source_files:
        sources = etree.SubElement(element, "SourceFiles")
        for name in capabilities.source_files:
            etree.SubElement(sources, "File", name=name)


def _units(root: Element, interface: Interface) -> None:
    """Write the units that are used, with integer SI exponents; a unit with half exponents has a name only."""
    definitions = etree.SubElement(root, "UnitDefinitions")
    for name in sorted({s.unit for s in interface.variables if s.unit}):
        unit = UNITS[name]
        element = etree.SubElement(definitions, "Unit", name=name)
        if all(e == int(e) for e in unit.exponents.values()):
            exponents = {base: str(int(unit.exponents[base])) for base in BASE_UNITS if base in unit.exponents}
            etree.SubElement(element, "BaseUnit", exponents)
        for display, factor in unit.display.items():
            etree.SubElement(element, "DisplayUnit", name=display, factor=repr(factor))


def _annotations(root: Element, interface: Interface) -> None:
    """Mark what our master may use: outputs can be re-evaluated without a step; which outputs are step means."""
    tool = etree.SubElement(etree.SubElement(root, "VendorAnnotations"), "Tool", name=TOOL)
    slave = etree.SubElement(tool, "Slave", refresh="true", sampled=_flag(interface.component.sampled))
    for name in interface.step_means:
        etree.SubElement(slave, "StepMean", variable=name)


def _variable(parent: Element, scalar: Scalar) -> None:
    element = etree.SubElement(
        parent,
        "ScalarVariable",
        name=scalar.name,
        valueReference=str(scalar.value_reference),
        causality=scalar.causality,
        variability=scalar.variability,
    )
    if scalar.initial:
        element.set("initial", scalar.initial)
    real = etree.SubElement(element, "Real")
    if scalar.unit:
        real.set("unit", scalar.unit)
    if scalar.derivative is not None:
        real.set("derivative", str(scalar.derivative + 1))
        return
    declared = scalar.declared
    element.set("description", declared.doc)
    if declared.display_unit:
        real.set("displayUnit", declared.display_unit)
    for attribute in ("min", "max", "nominal"):
        value = getattr(declared, attribute)
        if value is not None:
            real.set(attribute, repr(float(value)))
    if scalar.start is not None:
        real.set("start", repr(scalar.start))


def _structure(root: Element, interface: Interface) -> None:
    structure = etree.SubElement(root, "ModelStructure")
    sections: tuple[tuple[str, tuple[Unknown, ...]], ...] = (
        ("Outputs", interface.outputs),
        ("Derivatives", interface.derivative_unknowns),
        ("InitialUnknowns", interface.initial_unknowns),
    )
    for tag, unknowns in sections:
        if not unknowns:
            continue
        section = etree.SubElement(structure, tag)
        for unknown in unknowns:
            dependencies = " ".join(str(vr + 1) for vr in unknown.dependencies)
            etree.SubElement(section, "Unknown", index=str(unknown.value_reference + 1), dependencies=dependencies)
