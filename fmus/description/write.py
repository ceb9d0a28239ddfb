"""`ModelDescription` -> modelDescription.xml: the one writer, for every back end; the reader is read.py.

What the data class does not say is said of every FMU alike: structured names, no asynchronous steps, no use of the
host's memory functions.
"""

from collections.abc import Mapping
from typing import Any

from lxml import etree

from fmus.description.annotations import Annotations, write_annotations
from fmus.description.description import ModelDescription, ScalarVariable
from fmus.description.units import EXPONENTS, Conversion, Unit

Element = Any  # lxml gives its element class no public name


def write(description: ModelDescription) -> bytes:
    """Return modelDescription.xml."""
    root = etree.Element(
        "fmiModelDescription",
        fmiVersion="2.0",
        modelName=description.model_name,
        guid=description.guid,
        description=description.description,
        generationTool=description.generation_tool,
        variableNamingConvention="structured",
    )
    for name, text in _origin(description).items():
        if text:
            root.set(name, text)
    _co_simulation(root, description)
    _units(root, description.units)
    types = _types(root, description)
    if description.log_categories:
        categories = etree.SubElement(root, "LogCategories")
        for name in description.log_categories:
            etree.SubElement(categories, "Category", name=name)
    _default_experiment(root, description)
    write_annotations(root, _marks(description))
    variables = etree.SubElement(root, "ModelVariables")
    index = {name: i for i, name in enumerate(description.variables, 1)}
    for variable in description.variables.values():
        _variable(variables, variable, index, types)
    _structure(root, description, index)
    return etree.tostring(root, xml_declaration=True, encoding="UTF-8", pretty_print=True)


def _origin(description: ModelDescription) -> dict[str, str]:
    return {
        "author": description.author,
        "version": description.version,
        "copyright": description.copyright,
        "license": description.license,
        "generationDateAndTime": description.generation_date,
    }


def _flag(value: bool) -> str:
    return "true" if value else "false"


def _co_simulation(root: Element, description: ModelDescription) -> None:
    element = etree.SubElement(
        root,
        "CoSimulation",
        modelIdentifier=description.model_identifier,
        needsExecutionTool=_flag(description.needs_execution_tool),
        canHandleVariableCommunicationStepSize=_flag(description.can_handle_variable_step),
        canInterpolateInputs=_flag(description.can_interpolate_inputs),
        maxOutputDerivativeOrder=str(description.max_output_derivative_order),
        canRunAsynchronuously="false",
        canBeInstantiatedOnlyOncePerProcess=_flag(description.only_once_per_process),
        canNotUseMemoryManagementFunctions="true",
        canGetAndSetFMUstate=_flag(description.can_get_and_set_state),
        canSerializeFMUstate=_flag(description.can_serialize_state),
        providesDirectionalDerivative=_flag(description.provides_directional_derivative),
    )
    if description.source_files:
        sources = etree.SubElement(element, "SourceFiles")
        for name in description.source_files:
            etree.SubElement(sources, "File", name=name)


def _units(root: Element, units: Mapping[str, Unit]) -> None:
    if not units:
        return
    definitions = etree.SubElement(root, "UnitDefinitions")
    for unit in units.values():
        element = etree.SubElement(definitions, "Unit", name=unit.name)
        if unit.base is not None:
            exponents = {e: str(n) for e, n in zip(EXPONENTS, unit.base.exponents, strict=True) if n}
            etree.SubElement(element, "BaseUnit", {**exponents, **_conversion(unit.base.to_si)})
        for name, shown in unit.display.items():
            etree.SubElement(element, "DisplayUnit", {"name": name, **_conversion(shown)})


def _conversion(conversion: Conversion) -> dict[str, str]:
    said = {"factor": (conversion.factor, 1.0), "offset": (conversion.offset, 0.0)}
    return {name: repr(value) for name, (value, default) in said.items() if value != default}


def _types(root: Element, description: ModelDescription) -> dict[tuple[tuple[str, int], ...], str]:
    """Write a type for each set of items of an Enumeration; return items -> its name."""
    sets = dict.fromkeys(tuple(v.items.items()) for v in description.variables.values() if v.items is not None)
    if not sets:
        return {}
    definitions = etree.SubElement(root, "TypeDefinitions")
    names = {items: f"Enumeration{i}" for i, items in enumerate(sets, 1)}
    for items, name in names.items():
        enumeration = etree.SubElement(etree.SubElement(definitions, "SimpleType", name=name), "Enumeration")
        for literal, value in items:
            etree.SubElement(enumeration, "Item", name=literal, value=str(value))
    return names


def _marks(description: ModelDescription) -> Annotations:
    """Return our annotations, variables in the order of the description."""
    means, shared, acting = description.step_means, description.shared, description.rates_act
    return Annotations(
        refresh=description.refresh,
        sampled=description.sampled,
        input_derivatives=description.max_input_derivative_order,
        role=description.role,
        step_means={name: means[name] for name in description.variables if name in means},
        rates_act=tuple(name for name in description.variables if name in acting),
        shared=tuple(name for name in description.variables if name in shared),
    )


def _default_experiment(root: Element, description: ModelDescription) -> None:
    said = description.default_experiment
    values = {
        "startTime": said.start,
        "stopTime": said.stop,
        "tolerance": said.tolerance,
        "stepSize": said.step_size,
    }
    attributes = {name: repr(value) for name, value in values.items() if value is not None}
    if attributes:
        etree.SubElement(root, "DefaultExperiment", attributes)


def _variable(
    parent: Element,
    variable: ScalarVariable,
    index: Mapping[str, int],
    types: Mapping[tuple[tuple[str, int], ...], str],
) -> None:
    element = etree.SubElement(
        parent,
        "ScalarVariable",
        name=variable.name,
        valueReference=str(variable.value_reference),
        causality=variable.causality,
        variability=variable.variability,
    )
    if variable.initial and variable.causality not in ("input", "independent"):  # FMI: these have none to say
        element.set("initial", variable.initial)
    if variable.description:
        element.set("description", variable.description)
    numbers = int if variable.type in ("Integer", "Enumeration") else float
    attributes = {
        "declaredType": None if variable.items is None else types[tuple(variable.items.items())],
        "unit": variable.unit,
        "derivative": None if variable.derivative is None else str(index[variable.derivative]),
        "displayUnit": variable.display_unit,
        "min": None if variable.minimum is None else repr(numbers(variable.minimum)),
        "max": None if variable.maximum is None else repr(numbers(variable.maximum)),
        "nominal": None if variable.nominal == 1.0 else repr(variable.nominal),
        "start": _start(variable),
    }
    etree.SubElement(element, variable.type, {name: text for name, text in attributes.items() if text is not None})


def _start(variable: ScalarVariable) -> str | None:
    start = variable.start
    if start is None or isinstance(start, str):
        return start
    return _flag(start) if isinstance(start, bool) else repr(start)


def _structure(root: Element, description: ModelDescription, index: Mapping[str, int]) -> None:
    structure = etree.SubElement(root, "ModelStructure")
    sections = {
        "Outputs": description.dependencies,
        "Derivatives": description.derivatives,
        "InitialUnknowns": description.initial_unknowns,
    }
    for tag, unknowns in sections.items():
        if not unknowns:
            continue
        section = etree.SubElement(structure, tag)
        for name, dependencies in unknowns.items():
            element = etree.SubElement(section, "Unknown", index=str(index[name]))
            if dependencies is not None:
                element.set("dependencies", " ".join(str(index[d]) for d in dependencies))
