"""modelDescription.xml -> `ModelDescription`: through fmpy, and by lxml what fmpy does not read, our VendorAnnotations."""

import io
import zipfile
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import lxml.etree as etree
from fmpy.model_description import ValidationError, read_model_description

from fmus.description.description import ModelDescription, Scalar, ScalarVariable, Type
from fmus.description.errors import FmuError
from fmus.description.names import canonical
from fmus.description.units import EXPONENTS, BaseUnit, Conversion, Unit


def read_description(path: Path) -> ModelDescription:
    """Read modelDescription.xml of an FMU.

    Raises `FmuError` for what is no FMU, is damaged, or is not FMI 2.0 co-simulation.
    """
    try:
        with zipfile.ZipFile(path) as archive:
            return parse_description(archive.read("modelDescription.xml"), path)
    except FileNotFoundError as error:
        raise FmuError(path, "there is no such file") from error
    except (zipfile.BadZipFile, OSError) as error:
        raise FmuError(path, f"it is not an FMU, for it is no readable zip archive ({error})") from error
    except KeyError as error:
        raise FmuError(path, "it is not an FMU, for there is no modelDescription.xml inside") from error


def parse_description(xml: bytes, path: Path) -> ModelDescription:
    """Read the text of a modelDescription.xml; `path` is for messages. Raises `FmuError`."""
    try:
        root = etree.fromstring(xml)
    except etree.XMLSyntaxError as error:
        raise FmuError(path, f"its modelDescription.xml is damaged: {error}") from error
    version = root.get("fmiVersion")
    if version != "2.0":
        raise FmuError(path, f"it is of FMI version {version}, needed is 2.0")
    if root.find("CoSimulation") is None:
        raise FmuError(path, "it is for model exchange only, needed is co-simulation")
    annotation = root.find("VendorAnnotations/Tool[@name='adcs-cosim']/Slave")
    refresh, sampled = (annotation is not None and annotation.get(k) == "true" for k in ("refresh", "sampled"))
    step_means = [] if annotation is None else [e.get("variable", "") for e in annotation.findall("StepMean")]
    try:
        return from_model_description(_description(xml), refresh=refresh, step_means=step_means, sampled=sampled)
    except Exception as error:  # fmpy raises whatever a damaged file leads to
        raise FmuError(path, f"its modelDescription.xml is damaged: {_first_line(error)}") from error


def _description(xml: bytes) -> Any:
    """Read with validation; what breaks the schema is an error, what breaks only a finer rule is let pass."""
    archive = io.BytesIO()  # fmpy reads archives
    with zipfile.ZipFile(archive, "w") as writer:
        writer.writestr("modelDescription.xml", xml)
    try:
        return read_model_description(archive, validate=True)
    except ValidationError as error:
        if any("ERROR" in problem for problem in error.problems):
            raise
        return read_model_description(archive, validate=False)


def _first_line(error: Exception) -> str:
    problems: Sequence[str] = getattr(error, "problems", ())
    return "; ".join(problems[:3]) or str(error) or type(error).__name__


def from_model_description(
    description: Any, *, refresh: bool, step_means: Iterable[str], sampled: bool = False
) -> ModelDescription:
    """Build the interface from fmpy's `ModelDescription` of an FMI 2.0 co-simulation FMU.

    `refresh`, `step_means` and `sampled` come from VendorAnnotations, which fmpy does not read.
    """
    slave = description.coSimulation
    return ModelDescription(
        model_name=description.modelName,
        guid=description.guid,
        variables={canonical(v.name): _variable(v) for v in description.modelVariables},
        dependencies={canonical(u.variable.name): _dependencies(u) for u in description.outputs},
        initial_unknowns={canonical(u.variable.name): _dependencies(u) for u in description.initialUnknowns},
        units={u.name: _unit(u) for u in description.unitDefinitions},
        can_handle_variable_step=slave.canHandleVariableCommunicationStepSize,
        can_interpolate_inputs=slave.canInterpolateInputs,
        max_output_derivative_order=int(slave.maxOutputDerivativeOrder or 0),
        can_get_and_set_state=slave.canGetAndSetFMUstate,
        can_serialize_state=slave.canSerializeFMUstate,
        provides_directional_derivative=slave.providesDirectionalDerivative,
        only_once_per_process=slave.canBeInstantiatedOnlyOncePerProcess,
        refresh=refresh,
        sampled=sampled,
        step_means=frozenset(canonical(n) for n in step_means),
        model_identifier=slave.modelIdentifier,
        generation_tool=description.generationTool or "",
        description=description.description or "",
    )


def _variable(v: Any) -> ScalarVariable:
    declared = v.declaredType
    unit = v.unit or (declared.unit if declared is not None else None)
    nominal = abs(float(v.nominal)) if v.nominal else 1.0
    return ScalarVariable(
        name=canonical(v.name),
        value_reference=v.valueReference,
        type=v.type,
        causality=v.causality,
        variability=v.variability,
        initial=v.initial,
        unit=unit,
        display_unit=v.displayUnit or (declared.displayUnit if declared is not None else None),
        start=_start(v.type, v.start),
        nominal=nominal or 1.0,
        description=v.description or "",
    )


def _start(kind: Type, text: str | None) -> Scalar | None:
    if text is None or kind == "String":
        return text
    if kind == "Boolean":
        return text in ("true", "1")
    return float(text) if kind == "Real" else int(text)


def _dependencies(unknown: Any) -> tuple[str, ...] | None:
    if unknown.dependencies is None:
        return None
    return tuple(canonical(v.name) for v in unknown.dependencies)


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
