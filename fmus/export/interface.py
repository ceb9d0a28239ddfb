"""A component as scalar FMI variables: pure data, the same for every back end.

One flat vector holds every real variable; a value reference is an index into it:

    [ p parameters | c calculated parameters | u inputs | x states | y other outputs | d state derivatives ]

FMI 2.0 has no arrays: `J[1,1]`, row by row, 1-based. d exists where the FMU provides directional derivatives (native).
"""

from collections.abc import Iterable
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from components.framework import Component, PythonComponent, State, Variable
from components.framework.units import rate_unit

REGIONS = ("p", "c", "u", "x", "y", "d")


@dataclass(frozen=True)
class Scalar:
    """One ScalarVariable of modelDescription.xml. derivative: value reference of the state that it is the rate of."""

    name: str
    value_reference: int
    causality: str
    variability: str
    initial: str | None
    start: float | None
    declared: Variable
    unit: str | None
    derivative: int | None = None


@dataclass(frozen=True)
class Unknown:
    """An entry of ModelStructure: an unknown and what it depends on, as value references."""

    value_reference: int
    dependencies: tuple[int, ...]


@dataclass(frozen=True)
class Interface:
    """What an FMU of the component shows to the outside. derivatives: whether it has the region d."""

    component: Component
    model_name: str
    derivatives: bool
    offset: dict[str, int] = field(init=False)
    size: dict[str, int] = field(init=False)

    def __post_init__(self) -> None:
        part = self.component
        continuous = self.derivatives and not part.sampled
        groups: dict[str, Iterable[Variable]] = {
            "p": part.parameters,
            "c": part.calculated_parameters,
            "u": part.inputs,
            "x": part.states,
            "y": part.outputs_declared,
            "d": part.states if continuous else (),
        }
        size = {region: part.size(groups[region]) for region in REGIONS}
        offset = {region: sum(size[r] for r in REGIONS[:i]) for i, region in enumerate(REGIONS)}
        object.__setattr__(self, "size", size)
        object.__setattr__(self, "offset", offset)

    # ---- variables -----------------------------------------------------------------------------------------

    @cached_property
    def variables(self) -> tuple[Scalar, ...]:
        """Every scalar variable, in the order of value references."""
        part = self.component
        found: list[Scalar] = []

        def add(v: Variable, causality: str, variability: str, initial: str | None) -> None:
            starts = np.ravel(v.start) if initial == "exact" or causality == "input" else [None] * v.size
            for name, start in zip(v.elements(), starts, strict=True):
                value = None if start is None else float(start)
                found.append(Scalar(name, len(found), causality, variability, initial, value, v, v.unit))

        moving = "discrete" if part.sampled else "continuous"
        for p in part.parameters:
            add(p, "parameter", "tunable" if p.tunable else "fixed", "exact")
        for c in part.calculated_parameters:
            add(c, "calculatedParameter", "tunable" if c.tunable else "fixed", "calculated")
        for u in part.inputs:
            add(u, "input", moving, None)
        for x in part.states:
            add(x, "output" if x.output else "local", moving, "calculated" if x.calculated else "exact")
        for y in part.outputs_declared:
            add(y, "output", moving, "calculated")
        if self.size["d"]:
            start = self.offset["x"]
            for i, x in enumerate(found[start : start + self.size["x"]]):
                unit = rate_unit(x.declared.unit)
                rate = Scalar(
                    f"der({x.name})", len(found), "local", moving, "calculated", None, x.declared, unit, start + i
                )
                found.append(rate)
        return tuple(found)

    @cached_property
    def step_means(self) -> tuple[str, ...]:
        """Names of the scalars that are means over the last communication step."""
        return tuple(n for o in self.component.outputs_declared if o.step_mean for n in o.elements())

    def state_variables(self) -> list[tuple[int, State]]:
        """Return (value reference, declaration) of every scalar state."""
        declared = [s for s in self.component.states for _ in range(s.size)]
        return [(self.offset["x"] + i, s) for i, s in enumerate(declared)]

    # ---- structure -----------------------------------------------------------------------------------------

    def _references(self, row: dict[str, list[int]], regions: str) -> tuple[int, ...]:
        return tuple(sorted(self.offset[r] + i for r in regions for i in row.get(r, ())))

    def _rows(self, group: Iterable[Variable]) -> list[dict[str, list[int]]]:
        """Return dependencies of a Python-only component's outputs: the inputs that it declares, element by element."""
        feedthrough = self.component.direct_feedthrough
        at: dict[str, range] = {}
        for v in self.component.inputs:
            start = sum(map(len, at.values()))
            at[v.name] = range(start, start + v.size)
        return [{"u": [i for n in feedthrough[v.name] for i in at[n]]} for v in group for _ in range(v.size)]

    @cached_property
    def outputs(self) -> tuple[Unknown, ...]:
        """Outputs with what they depend on: inputs, and states where directional derivatives are provided."""
        part = self.component
        known = "xu" if self.derivatives and not part.sampled else "u"
        if isinstance(part, PythonComponent):
            rows = self._rows(part.outputs_declared)
        else:
            rows = part.functions.output_dependencies
        states = [
            Unknown(vr, (vr,) if known == "xu" else ()) for vr, declared in self.state_variables() if declared.output
        ]
        own = [Unknown(self.offset["y"] + i, self._references(row, known)) for i, row in enumerate(rows)]
        return (*states, *own)

    @cached_property
    def derivative_unknowns(self) -> tuple[Unknown, ...]:
        """State derivatives with what they depend on."""
        if not self.size["d"]:
            return ()
        rows = self.component.functions.rate_dependencies
        return tuple(Unknown(self.offset["d"] + i, self._references(row, "xu")) for i, row in enumerate(rows))

    @cached_property
    def initial_unknowns(self) -> tuple[Unknown, ...]:
        """Unknowns of initialization mode, with the settable states, inputs and parameters that they depend on."""
        part = self.component
        if isinstance(part, PythonComponent):
            every = {"x": list(range(self.size["x"])), "p": list(range(self.size["p"]))}
            rows = {"y": [row | every for row in self._rows(part.outputs_declared)]}
        else:
            rows = part.functions.initial_dependencies
        shown = {vr for vr, s in self.state_variables() if s.calculated and (s.output or self.size["d"])}
        unknowns: list[Unknown] = []
        for region in ("c", "x", "y", "dx"):
            start = self.offset["d" if region == "dx" else region]
            for i, row in enumerate(rows.get(region, ())):
                vr = start + i
                if (region == "x" and vr not in shown) or (region == "dx" and not self.size["d"]):
                    continue
                unknowns.append(Unknown(vr, self._references(row, "xup")))
        return tuple(unknowns)

    def summary(self) -> dict[str, list[list[Any]]]:
        """Return variables and dependencies as plain lists: what an edited source must still agree with."""
        unknowns = (*self.outputs, *self.initial_unknowns)
        return {
            "variables": [[s.name, s.causality, s.variability, s.initial, s.unit, s.start] for s in self.variables],
            "dependencies": [[self.variables[k.value_reference].name, list(k.dependencies)] for k in unknowns],
        }
