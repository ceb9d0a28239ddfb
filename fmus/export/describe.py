"""A component -> `ModelDescription`: the same variables, units and dependencies for every back end.

FMI 2.0 has no arrays: `J[1,1]`, row by row, 1-based. Travels inside python FMUs, to see whether an edited source still
is what modelDescription.xml says; so it needs neither lxml nor fmpy.
"""

import sys
from collections.abc import Iterator, Mapping, Sequence
from itertools import chain
from typing import Any, Literal

import numpy as np

from components.framework import Component, PythonComponent, Variable
from components.framework.units import UNITS, rate_unit
from fmus.description.annotations import TOOL
from fmus.description.description import DefaultExperiment, ModelDescription, ScalarVariable
from fmus.description.names import identifier
from fmus.description.units import EXPONENTS, BaseUnit, Conversion, Unit
from fmus.export.regions import Regions, regions_of, step_taken

LOG_CATEGORIES = ("logAll", "logStatusWarning", "logStatusDiscard", "logStatusError", "logStatusFatal")
PROPOSED = DefaultExperiment(start=0.0, stop=10.0, step_size=1e-3)
"""What a component is flown with that belongs to no system."""
Rows = Sequence[dict[str, list[int]]]  # for each scalar: region -> the indices in it that it depends on


def describe(
    component: Component,
    model_name: str,
    *,
    derivatives: bool,
    experiment: DefaultExperiment = PROPOSED,
    **capabilities: Any,
) -> ModelDescription:
    """Return what the FMU of a component says, with an empty GUID.

    derivatives: whether it provides directional ones, which makes states and their rates visible to a master.
    experiment: what it is to be flown with. capabilities: further fields of ModelDescription, of the back end.
    """
    regions = regions_of(component, derivatives)
    variables = {v.name: v for v in _variables(component, regions)}
    names = list(variables)
    return ModelDescription(
        model_name=model_name,
        guid="",
        variables=variables,
        dependencies=_outputs(component, regions, names),
        derivatives=_derivatives(component, regions, names),
        initial_unknowns=_initial_unknowns(component, regions, names),
        units={name: _unit(name) for name in sorted({v.unit for v in variables.values() if v.unit})},
        default_experiment=experiment,
        can_get_and_set_state=True,
        can_serialize_state=True,
        provides_directional_derivative=derivatives,
        refresh=True,
        sampled=component.sampled,
        step_means=_step_means(component),
        role=component.role,
        shared=frozenset(name for p in component.parameters if p.shared for name in p.elements()),
        rates_act=frozenset(name for u in component.inputs if u.rate_acts for name in u.elements()),
        model_identifier=identifier(model_name),
        log_categories=LOG_CATEGORIES,
        generation_tool=TOOL,
        description=docstring_of(type(component)).partition("\n")[0],
        **capabilities,
    )


def summary(description: ModelDescription) -> dict[str, list[list[Any]]]:
    """Return variables and dependencies as plain lists: what an edited source must still agree with."""
    variables = description.variables.values()
    unknowns = chain(description.dependencies.items(), description.initial_unknowns.items())
    return {
        "variables": [[v.name, v.causality, v.variability, v.initial, v.unit, v.start] for v in variables],
        "dependencies": [[name, list(dependencies or ())] for name, dependencies in unknowns],
    }


def _step_means(component: Component) -> dict[str, str]:
    """Return each scalar that is a mean over a step -> the scalar whose rate is meant, "" where that is no output."""
    shown = {v.name: v.elements() for v in (*component.outputs_declared, *component.states)}
    means = [o for o in component.outputs_declared if o.step_mean]
    return {
        name: of
        for mean in means
        for name, of in zip(mean.elements(), shown.get(mean.mean_of) or [""] * mean.size, strict=True)
    }


def docstring_of(cls: type) -> str:
    """Return what a component's class, or else its module, says about it."""
    return (cls.__doc__ or sys.modules[cls.__module__].__doc__ or "").strip()


def _unit(name: str) -> Unit:
    """Return a unit with its integer SI exponents; one with half exponents has a name only."""
    unit = UNITS[name]
    exponents = [unit.exponents.get(base, 0) for base in EXPONENTS]
    whole = all(e == int(e) for e in exponents)
    base = BaseUnit(tuple(int(e) for e in exponents)) if whole else None
    return Unit(name, base, {shown: Conversion(factor) for shown, factor in unit.display.items()})


# ---- variables -------------------------------------------------------------------------------------------------


def _variables(part: Component, regions: Regions) -> Iterator[ScalarVariable]:
    """Yield every scalar variable, in the order of value references."""
    moving = "discrete" if part.sampled else "continuous"
    kinds: list[tuple[Variable, str, str, Literal["exact", "calculated"]]] = [
        *((p, "parameter", "tunable" if p.tunable else "fixed", "exact") for p in part.parameters),
        *(
            (c, "calculatedParameter", "tunable" if c.tunable else "fixed", "calculated")
            for c in part.calculated_parameters
        ),
        *((u, "input", moving, "exact") for u in part.inputs),
        *(
            (x, "output" if x.output else "local", moving, "calculated" if x.calculated else "exact")
            for x in part.states
        ),
        *((y, "output", moving, "exact" if y.exact else "calculated") for y in part.outputs_declared),
    ]
    at = 0
    for v, causality, variability, initial in kinds:
        starts = np.ravel(v.start).tolist() if initial == "exact" else [None] * v.size
        for name, start in zip(v.elements(), starts, strict=True):
            yield ScalarVariable(
                name,
                at,
                causality=causality,
                variability=variability,
                initial=initial,
                unit=v.unit,
                display_unit=v.display_unit,
                start=start,
                nominal=float(v.nominal or 1.0),
                minimum=None if v.min is None else float(v.min),
                maximum=None if v.max is None else float(v.max),
                description=v.doc,
            )
            at += 1
    for v in step_taken(part):
        yield ScalarVariable(v.name, at, variability="discrete", initial="calculated", unit=v.unit, description=v.doc)
        at += 1
    for x in part.states if regions.size["d"] else ():
        unit = rate_unit(x.unit)
        for name in x.elements():
            yield ScalarVariable(
                f"der({name})", at, variability=moving, initial="calculated", unit=unit, derivative=name
            )
            at += 1


# ---- structure -------------------------------------------------------------------------------------------------


def _states(part: Component, regions: Regions) -> list[tuple[int, bool, bool]]:
    """Return (value reference, is it an output, is it calculated) of every scalar state."""
    declared = [s for s in part.states for _ in range(s.size)]
    return [(regions.offset["x"] + i, s.output, s.calculated) for i, s in enumerate(declared)]


def _named(row: dict[str, list[int]], known: str, regions: Regions, names: list[str]) -> tuple[str, ...]:
    """Return the names of what a scalar depends on, of the known regions, in the order of value references."""
    return tuple(names[i] for i in sorted(regions.offset[r] + i for r in known for i in row.get(r, ())))


def _declared_rows(part: PythonComponent) -> Rows:
    """Return dependencies of a Python-only component's outputs: the inputs that it declares, element by element."""
    feedthrough = part.direct_feedthrough
    at: dict[str, range] = {}
    for v in part.inputs:
        start = sum(map(len, at.values()))
        at[v.name] = range(start, start + v.size)
    return [
        {"u": [i for n in feedthrough[v.name] for i in at[n]]} for v in part.outputs_declared for _ in range(v.size)
    ]


def _outputs(part: Component, regions: Regions, names: list[str]) -> dict[str, tuple[str, ...] | None]:
    """Return outputs with what they depend on: inputs, and states where directional derivatives are provided."""
    known = "xu" if regions.size["d"] else "u"
    rows: Rows = _declared_rows(part) if isinstance(part, PythonComponent) else part.functions.output_dependencies
    shown = [names[vr] for vr, output, _ in _states(part, regions) if output]
    own = {names[regions.offset["y"] + i]: _named(row, known, regions, names) for i, row in enumerate(rows)}
    return {name: (name,) if regions.size["d"] else () for name in shown} | own


def _derivatives(part: Component, regions: Regions, names: list[str]) -> dict[str, tuple[str, ...] | None]:
    """Return state derivatives with what they depend on."""
    if not regions.size["d"]:
        return {}
    rows: Rows = part.functions.rate_dependencies
    return {names[regions.offset["d"] + i]: _named(row, "xu", regions, names) for i, row in enumerate(rows)}


def _initial_unknowns(part: Component, regions: Regions, names: list[str]) -> dict[str, tuple[str, ...] | None]:
    """Return unknowns of initialization mode, with what they depend on of what can be set."""
    rows: Mapping[str, Rows]
    if isinstance(part, PythonComponent):
        every = {"x": list(range(regions.size["x"])), "p": list(range(regions.size["p"]))}
        rows = {"y": [row | every for row in _declared_rows(part)]}
    else:
        rows = part.functions.initial_dependencies
    rates = regions.size["d"] > 0
    shown = {vr for vr, output, calculated in _states(part, regions) if calculated and (output or rates)}
    known = {vr for vr in range(regions.offset["x"], regions.offset["y"]) if vr not in shown}
    known |= set(range(regions.offset["e"], regions.offset["e"] + regions.size["e"]))
    found: dict[str, tuple[str, ...] | None] = {}
    for region in ("c", "x", "y", *(["dx"] if rates else [])):
        start = regions.offset["d" if region == "dx" else region]
        for vr, row in enumerate(rows.get(region, ()), start):
            if vr not in known:
                found[names[vr]] = _named(row, "xupe", regions, names)
    return found
