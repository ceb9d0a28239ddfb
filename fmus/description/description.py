"""What an FMU offers, as its modelDescription.xml says: variables, arrays, units, dependencies, capabilities."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Literal

from fmus.description import html
from fmus.description.errors import UnknownName
from fmus.description.names import Group, canonical, group, split_element
from fmus.description.units import Unit

Type = Literal["Real", "Integer", "Boolean", "String", "Enumeration"]
Scalar = float | int | bool | str
"""A value of one variable; int for Integer and Enumeration."""


@dataclass(frozen=True)
class Element:
    """What a scalar is in an FMU of FMI 3.0: element `index`, row by row from 0, of a variable of `size` elements."""

    type: str
    value_reference: int
    index: int = 0
    size: int = 1


@dataclass(frozen=True)
class ScalarVariable:
    """One ScalarVariable; `initial` and `variability` with FMI's defaults filled in, `start` in `unit`.

    minimum, maximum: as the variable or its declared type says. items: literal -> value of an Enumeration.
    derivative: name of the variable that this one is the time derivative of. element: what it is in FMI 3.0, where
    `value_reference` is its place among all scalars.
    """

    name: str
    value_reference: int
    type: Type = "Real"
    causality: str = "local"
    variability: str = "continuous"
    initial: str | None = None
    unit: str | None = None
    display_unit: str | None = None
    start: Scalar | None = None
    nominal: float = 1.0
    minimum: float | None = None
    maximum: float | None = None
    items: Mapping[str, int] | None = None
    derivative: str | None = None
    description: str = ""
    element: Element | None = None

    @property
    def is_parameter(self) -> bool:
        """Whether a user may set it before initialization: a parameter, or an initial state."""
        if self.causality in ("parameter", "structuralParameter"):
            return True
        return self.initial == "exact" and self.variability != "constant" and self.causality in ("output", "local")


@dataclass(frozen=True)
class DefaultExperiment:
    """What an FMU proposes to be flown with, times in s; None: not said."""

    start: float | None = None
    stop: float | None = None
    tolerance: float | None = None
    step_size: float | None = None


@dataclass(frozen=True)
class ModelDescription:
    """All that is said of an FMU, as data: read.py reads it, write.py writes it.

    max_input_derivative_order: what our annotations say of fmi2SetRealInputDerivatives, 0: nothing.
    dependencies (outputs), derivatives (rates of states), initial_unknowns: variable -> names it depends on, None: not
    said. refresh, sampled, step_means, rates_act, role, shared: see annotations.py. sizes: structural parameter of FMI
    3.0 -> the arrays that take a dimension from it. unserved: variables of types that are not exchanged, with the type.
    model_exchange: whether the FMU gives only derivatives, of `states` with `event_indicators`, and is integrated here.
    generation_date: as FMI writes it, "2026-11-26T10:00:00Z".
    """

    model_name: str
    guid: str
    variables: Mapping[str, ScalarVariable]
    dependencies: Mapping[str, tuple[str, ...] | None] = field(default_factory=dict)
    derivatives: Mapping[str, tuple[str, ...] | None] = field(default_factory=dict)
    initial_unknowns: Mapping[str, tuple[str, ...] | None] = field(default_factory=dict)
    units: Mapping[str, Unit] = field(default_factory=dict)
    default_experiment: DefaultExperiment = DefaultExperiment()
    can_handle_variable_step: bool = True
    can_interpolate_inputs: bool = False
    max_input_derivative_order: int = 0
    max_output_derivative_order: int = 0
    can_get_and_set_state: bool = False
    can_serialize_state: bool = False
    provides_directional_derivative: bool = False
    only_once_per_process: bool = False
    needs_execution_tool: bool = False
    refresh: bool = False
    sampled: bool = False
    step_means: Mapping[str, str] = field(default_factory=dict)
    role: str = ""
    shared: frozenset[str] = frozenset()
    rates_act: frozenset[str] = frozenset()
    model_identifier: str = ""
    source_files: tuple[str, ...] = ()
    log_categories: tuple[str, ...] = ()
    generation_tool: str = ""
    generation_date: str = ""
    description: str = ""
    fmi_version: str = "2.0"
    model_exchange: bool = False
    states: int = 0
    event_indicators: int = 0
    sizes: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    unserved: Mapping[str, str] = field(default_factory=dict)
    author: str = ""
    version: str = ""
    license: str = ""
    copyright: str = ""

    def __repr__(self) -> str:
        """Name, GUID, how many variables of each causality."""
        counts = {c: len(self.base_names(c)) for c in ("input", "output", "parameter")}
        return f"<FMU {self.model_name} {self.guid}: {', '.join(html.count(n, c) for c, n in counts.items())}>"

    def _repr_html_(self) -> str:
        """Return a table of the variables, for a notebook."""
        head = "variable", "causality", "variability", "unit", "description"
        made = f"made by {self.generation_tool}, GUID {self.guid}" if self.generation_tool else f"GUID {self.guid}"
        return html.title(f"FMU {self.model_name}", self.description, made) + html.table(head, self.overview())

    def overview(self) -> list[tuple[str, str, str, str, str]]:
        """Return name with size, causality, variability, unit and description of each array, rates of states left out.

        A start value is no part of it: most are arrays.
        """
        rows: list[tuple[str, str, str, str, str]] = []
        for base, g in self.groups.items():
            first = self.variables[g.elements[0]]
            if not base.startswith("der("):
                size = f"[{','.join(map(str, g.shape))}]" if g.shape else ""
                rows.append((f"{base}{size}", first.causality, first.variability, first.unit or "", first.description))
        return rows

    @property
    def interpolation_order(self) -> int:
        """Up to which order it takes derivatives of its inputs; FMI 2.0 says only whether it takes any."""
        return max(1, self.max_input_derivative_order) if self.can_interpolate_inputs else 0

    @cached_property
    def groups(self) -> Mapping[str, Group]:
        """Base name -> array or scalar, for all variables."""
        return group(self.variables)

    @cached_property
    def inputs(self) -> tuple[ScalarVariable, ...]:
        """All inputs, in the order of modelDescription.xml."""
        return tuple(v for v in self.variables.values() if v.causality == "input")

    @cached_property
    def outputs(self) -> tuple[ScalarVariable, ...]:
        """All outputs, likewise."""
        return tuple(v for v in self.variables.values() if v.causality == "output")

    @cached_property
    def real_outputs(self) -> tuple[ScalarVariable, ...]:
        """The outputs that are Real."""
        return tuple(v for v in self.outputs if v.type == "Real")

    def find(self, name: str, kind: str, where: str) -> Group:
        """Return the array, or the one element, that `name` means.

        Raises `UnknownName` with the base names of this FMU; `kind` and `where` are words for its message.
        """
        name = canonical(name)
        found = self.groups.get(name)
        if found is not None:
            return found
        if name in self.variables:
            return Group((), (name,))
        whole = self.groups.get(split_element(name)[0])
        if whole is not None and whole.shape:
            ends = whole.elements[0], whole.elements[-1]
            raise UnknownName("element", name, where, [f"{ends[0]} to {ends[1]}"])
        raise UnknownName(kind, name, where, list(self.groups))

    def base_names(self, causality: str) -> list[str]:
        """Return the base names of all variables of a causality."""
        return [base for base, g in self.groups.items() if self.variables[g.elements[0]].causality == causality]

    def feedthrough(self, output: str) -> tuple[str, ...]:
        """Return the inputs, of any type, on which an output depends directly; all of them if the FMU does not say."""
        return () if output in self.step_means else self._inputs_among(self.dependencies.get(output))

    def declares(self, output: str) -> bool:
        """Whether the FMU says on which inputs an output depends directly."""
        return output in self.step_means or self.dependencies.get(output) is not None

    def initial_feedthrough(self, output: str) -> tuple[str, ...]:
        """Return the inputs, of any type, on which an output depends in initialization mode."""
        if output in self.initial_unknowns:
            return self._inputs_among(self.initial_unknowns[output])
        return () if self.variables[output].initial == "exact" else self._inputs_among(None)

    def _inputs_among(self, names: tuple[str, ...] | None) -> tuple[str, ...]:
        if names is None:
            return tuple(v.name for v in self.inputs)
        return tuple(n for n in names if self.variables[n].causality == "input")
