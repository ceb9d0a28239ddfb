"""modelDescription.xml -> `ModelDescription`: through fmpy, and by lxml what fmpy does not read, our VendorAnnotations.

Of FMI 1.0, 2.0 and 3.0; an FMU for co-simulation and for model exchange is read as one for co-simulation.

The writer is write.py. fmpy and lxml are imported when something is read: importing the readers is to cost nothing.
"""

import io
import re
import zipfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from fmus.description import earliest
from fmus.description.annotations import Annotations, read_annotations
from fmus.description.archive import read_file
from fmus.description.arrays import Arrays
from fmus.description.description import DefaultExperiment, ModelDescription, Scalar, ScalarVariable, Type
from fmus.description.errors import FmuError
from fmus.description.names import canonical
from fmus.description.units import EXPONENTS, BaseUnit, Conversion, Unit

_FILE_NAME = re.compile(r"[^/\\:\x00-\x1f]+")
"""A modelIdentifier, which names a file: no folder, no drive. FMI wants an identifier of C, some tools write others."""

_SAFELY: Any = {
    **{"resolve_entities": False, "no_network": True, "load_dtd": False},
    **{"remove_comments": True, "remove_pis": True},  # children of an element are elements
}

_ANNOTATIONS = re.compile(rb"<Annotations>.*?</Annotations>", re.DOTALL)


def read_description(path: Path) -> ModelDescription:
    """Read modelDescription.xml of an FMU.

    Raises `FmuError` for what is no FMU, is damaged, or is of a kind that cannot be flown.
    """
    return parse_description(read_file(path, "modelDescription.xml"), path)


def parse_description(xml: bytes, path: Path) -> ModelDescription:
    """Read the text of a modelDescription.xml; `path` is for messages. Raises `FmuError`."""
    from lxml import etree

    try:
        root = etree.fromstring(xml, etree.XMLParser(**_SAFELY))
    except (etree.XMLSyntaxError, ValueError, LookupError) as error:
        raise FmuError(path, f"its modelDescription.xml is damaged: {error}") from error
    if root.getroottree().docinfo.internalDTD is not None:
        problem = "it declares a document type (DOCTYPE): FMI has none, and entities are not read"
        raise FmuError(path, f"its modelDescription.xml is damaged: {problem}")
    version = root.get("fmiVersion") or "none"
    if not re.fullmatch(r"1\.0|2\.0|3\.[0-9]+", version):
        raise FmuError(path, f"it is of FMI version {version}, needed is 1.0, 2.0 or 3.0")
    if version != "1.0" and root.find("CoSimulation") is None and root.find("ModelExchange") is None:
        raise FmuError(path, "it is for scheduled execution only, needed is co-simulation or model exchange")
    try:
        read = _from_fmpy(_read_by_fmpy(xml), read_annotations(root), root)
        _refuse_references(read)
    except Exception as error:  # fmpy raises whatever a damaged file leads to
        raise FmuError(path, f"its modelDescription.xml is damaged: {_first_line(error)}") from error
    return read


def _read_by_fmpy(xml: bytes) -> Any:
    """Read with validation; what breaks the schema is an error, what breaks only a finer rule is let pass.

    So is what breaks the schema of FMI 3.0 within <Annotations>, which are for the tool that wrote them.
    """
    from fmpy.model_description import ValidationError, read_model_description

    try:
        return read_model_description(_archived(xml), validate=True)
    except ValidationError as error:
        if any("ERROR" in problem for problem in error.problems):
            plain = _without_annotations(xml)
            if plain == xml:
                raise
            return _read_by_fmpy(plain)
        return read_model_description(_archived(xml), validate=False)


def _archived(xml: bytes) -> io.BytesIO:
    """Return the archive that fmpy reads."""
    archive = io.BytesIO()
    with zipfile.ZipFile(archive, "w") as writer:
        writer.writestr("modelDescription.xml", xml)
    return archive


def _without_annotations(xml: bytes) -> bytes:
    """Return a text without <Annotations>; lines keep their numbers, the text itself where there are none."""
    return _ANNOTATIONS.sub(lambda found: b"\n" * found[0].count(b"\n"), xml)


def _first_line(error: Exception) -> str:
    problems: Sequence[str] = getattr(error, "problems", ())
    return "; ".join(problems[:3]) or str(error) or type(error).__name__


def _from_fmpy(description: Any, annotations: Annotations, root: Any) -> ModelDescription:
    """Return what fmpy's `ModelDescription` and our annotations say; `root`: the element, for what fmpy leaves out."""
    own = description.coSimulation or description.modelExchange
    identifier = own.modelIdentifier or ""
    if not _FILE_NAME.fullmatch(identifier) or identifier in (".", ".."):
        raise ValueError(f"the modelIdentifier {identifier!r} cannot be the name of a library")
    return ModelDescription(
        model_name=description.modelName,
        guid=description.guid,
        **_interface(description, root),
        units={u.name: _unit(u) for u in description.unitDefinitions},
        default_experiment=_default_experiment(description.defaultExperiment),
        model_exchange=description.coSimulation is None,
        **_capabilities(description, root, annotations),
        only_once_per_process=own.canBeInstantiatedOnlyOncePerProcess,
        needs_execution_tool=own.needsExecutionTool,
        refresh=annotations.refresh,
        sampled=annotations.sampled,
        step_means={canonical(n): canonical(of) for n, of in annotations.step_means.items()},
        role=annotations.role,
        rates_act=frozenset(canonical(n) for n in annotations.rates_act),
        shared=frozenset(canonical(n) for n in annotations.shared),
        model_identifier=own.modelIdentifier,
        source_files=_source_files(description),
        log_categories=tuple(c.name for c in description.logCategories),
        generation_tool=description.generationTool or "",
        generation_date=description.generationDateAndTime or "",
        description=description.description or "",
        fmi_version=description.fmiVersion,
        author=description.author or "",
        version=description.version or "",
        license=description.license or "",
        copyright=description.copyright or "",
    )


def _interface(description: Any, root: Any) -> dict[str, Any]:
    """Return variables and what depends on what."""
    if description.fmiVersion == "1.0":
        return earliest.interface(_variables(description.modelVariables), root)
    sections = {
        "dependencies": description.outputs,
        "derivatives": description.derivatives,
        "initial_unknowns": description.initialUnknowns,
    }
    if description.fmiVersion == "2.0":
        variables = _variables(description.modelVariables)
        return {"variables": variables, **{name: _unknowns(section) for name, section in sections.items()}}
    arrays = Arrays(description, root)
    unknowns = {name: arrays.unknowns(section) for name, section in sections.items()}
    return {"variables": arrays.variables(), **unknowns, "sizes": arrays.sizes, "unserved": arrays.unserved}


def _capabilities(description: Any, root: Any, annotations: Annotations) -> dict[str, Any]:
    """Return the capabilities of co-simulation; of what is integrated here, which has none, its sizes."""
    own, tag = description.coSimulation, root.find("CoSimulation")
    if own is None:
        states, indicators = description.numberOfContinuousStates, description.numberOfEventIndicators
        return {"states": states, "event_indicators": indicators}
    if tag is None:
        return earliest.capabilities(root)
    directional = {tag.get("providesDirectionalDerivative"), tag.get("providesDirectionalDerivatives")}
    return {
        "can_handle_variable_step": own.canHandleVariableCommunicationStepSize,
        "can_interpolate_inputs": own.canInterpolateInputs,
        "max_input_derivative_order": annotations.input_derivatives,
        "max_output_derivative_order": int(own.maxOutputDerivativeOrder or 0),
        "can_get_and_set_state": own.canGetAndSetFMUstate,
        "can_serialize_state": own.canSerializeFMUstate,
        "provides_directional_derivative": not directional.isdisjoint({"true", "1"}),
    }


def _refuse_references(read: ModelDescription) -> None:
    """Raise ValueError for what no FMI function takes as a value reference."""
    for v in read.variables.values():
        reference = v.value_reference if v.element is None else v.element.value_reference
        if not 0 <= reference < 2**32:
            raise ValueError(f"{v.name} has the value reference {reference}, they are 0 to {2**32 - 1}")


def _default_experiment(experiment: Any) -> DefaultExperiment:
    if experiment is None:
        return DefaultExperiment()
    texts = (experiment.startTime, experiment.stopTime, experiment.tolerance, experiment.stepSize)
    return DefaultExperiment(*(_number(text) for text in texts))


def _source_files(description: Any) -> tuple[str, ...]:
    configurations: list[Any] = description.buildConfigurations
    identifier = (description.coSimulation or description.modelExchange).modelIdentifier
    sets = [s for c in configurations if c.modelIdentifier == identifier for s in c.sourceFileSets]
    return tuple(file for s in sets for file in s.sourceFiles)


def _variables(variables: Sequence[Any]) -> dict[str, ScalarVariable]:
    names: dict[str, str] = {}
    for v in variables:
        name = canonical(v.name)
        if name in names:
            raise ValueError(f"two variables have one name, {names[name]!r} and {v.name!r}")
        names[name] = v.name
    return {canonical(v.name): _variable(v) for v in variables}


def _variable(v: Any) -> ScalarVariable:
    nominal = abs(float(_declared(v, "nominal") or 1.0))
    items = v.declaredType.items if v.type == "Enumeration" and v.declaredType is not None else None
    return ScalarVariable(
        name=canonical(v.name),
        value_reference=v.valueReference,
        type=v.type,
        causality=v.causality,
        variability=v.variability,
        initial=v.initial,
        unit=_declared(v, "unit"),
        display_unit=_declared(v, "displayUnit"),
        start=_start(v.type, v.start),
        nominal=nominal or 1.0,
        minimum=_number(_declared(v, "min")),
        maximum=_number(_declared(v, "max")),
        items=None if items is None else {item.name: int(item.value) for item in items},
        derivative=None if v.derivative is None else canonical(v.derivative.name),
        description=v.description or "",
    )


def _declared(v: Any, attribute: str) -> str | None:
    """Return an attribute of a variable, or else of its declared type."""
    return getattr(v, attribute) or getattr(v.declaredType, attribute, None) or None


def _number(text: str | None) -> float | None:
    return None if text is None else float(text)


def _start(kind: Type, text: str | None) -> Scalar | None:
    if text is None or kind == "String":
        return text
    if kind == "Boolean":
        return text in ("true", "1")
    return float(text) if kind == "Real" else int(text)


def _unknowns(section: Sequence[Any]) -> dict[str, tuple[str, ...] | None]:
    return {
        canonical(u.variable.name): None if u.dependencies is None else tuple(canonical(d.name) for d in u.dependencies)
        for u in section
    }


def _unit(unit: Any) -> Unit:
    base = None
    if unit.baseUnit is not None:
        to_si = Conversion(float(unit.baseUnit.factor), float(unit.baseUnit.offset))
        base = BaseUnit(tuple(int(getattr(unit.baseUnit, e)) for e in EXPONENTS), to_si)
    return Unit(
        unit.name,
        base,
        {d.name: Conversion(float(d.factor), float(d.offset)) for d in unit.displayUnits},
    )
