"""A component: declared variables and the equations between them. Everything else is derived from these."""

from collections.abc import Iterable, Mapping
from dataclasses import replace
from functools import cached_property
from typing import Any, ClassVar, cast

import casadi as ca
import numpy as np

from .equations import Condition, Equations
from .errors import ComponentError, hint
from .functions import Functions
from .structure import checked, follows, structural, unit_of
from .units import UNITS
from .variables import CalculatedParameter, Input, Output, Parameter, State, Variable, settled


class Component:
    """Base of every component that is written as CasADi expressions.

    A subclass declares variables as class attributes, structural parameters as annotated integers and texts
    (structure.py), and `ports`, one class or several whose declarations it takes over (its own declaration of the same
    name wins). Variables whose number follows from the structure are declared by `declare`. It writes

    derivatives(t, x, u, p) -> {state: rate}        continuous states
    update(t, x, u, p) -> {state: next value}       instead, in a sampled component, which sets `sample_time` (s)
    outputs(t, x, u, p) -> {output: value}          outputs that are not states
    step_means(t, x, p) -> {output: quantity}       whose time derivative a step-mean output averages
    calculate(p) -> {calculated parameter: value}
    initial(t, x, u, p) -> {calculated state: value}      x has the settable states and the exact outputs, as set
    project(x, p) -> {state: value}                 after each internal step, e.g. normalisation
    check(t, x, u, p) -> [Condition]                at the end of initialization

    t is a scalar, and x, u, p hold every variable of their role under its name, as CasADi scalars, columns and
    matrices; p has the calculated parameters too. All are pure functions: branches are `ca.if_else`.

    A data file lies beside the module, which reads it as `Path(__file__).with_name("table.csv")` when it is imported or
    in one of these functions. What was read belongs to what is built: changed, it is built again.
    """

    ports: ClassVar[type | tuple[type, ...]] = ()
    sample_time: ClassVar[Any] = None
    solver_step: ClassVar[float] = 0.0  # largest internal step, s, 0: automatic; parameter `solver.step`
    python_only: ClassVar[bool] = False
    role: str = ""  # what it is in a loop, as in "plant"; that of its ports, unless it says so itself

    def __init__(self, **values: Any):
        """Fix the structure and replace start values: structural parameters and variables by their names."""
        self.name = type(self).__name__
        self.given = dict(values)
        self.role = type(self).role or next((r for port in _ports(type(self)) if (r := getattr(port, "role", ""))), "")
        self.structure = self._structure(values)
        declared = _merge(self.name, _declared(type(self)), self.declare())
        for taken in (n for n in declared if hasattr(Component, n) or n in vars(self)):
            text = f"a variable cannot be called {taken}: every component has something of that name. Choose another."
            raise ComponentError(self.name, text)
        has_states = any(type(v) is State for v in declared.values())
        declared = _merge(self.name, declared, self._solver(has_states))
        unknown = [n for n in values if n not in declared]
        if unknown:
            known = [*self.structure, *declared]
            raise ComponentError(
                self.name, f"no variable {unknown[0]!r}.{hint(unknown[0], known)} Variables: {', '.join(known)}."
            )
        self._variables = {n: self._resolve(v, values.get(n, v.start)) for n, v in declared.items()}
        self._require_consistency()

    def _structure(self, values: dict[str, Any]) -> dict[str, Any]:
        """Return the structural parameters, taken out of the values, and set each as an attribute."""
        found: dict[str, Any] = {}
        for name, default in structural(type(self), Component).items():
            try:
                found[name] = checked(name, default, values.pop(name, default))
            except ValueError as error:
                raise ComponentError(self.name, str(error)) from error
            setattr(self, name, found[name])
        return found

    def _resolve(self, variable: Variable, start: Any) -> Variable:
        try:
            unit = unit_of(variable.unit, self.structure)
            if unit not in UNITS:
                text = f"{variable.name}: unknown unit {unit!r}.{hint(unit, list(UNITS))}"
                raise ComponentError(self.name, text)
            return replace(variable, unit=unit, **settled(variable, self.structure, start, self))
        except (ValueError, TypeError) as error:
            raise ComponentError(self.name, f"{variable.name}: {error}.") from error

    def _require_consistency(self) -> None:
        rates = type(self).derivatives is not Component.derivatives
        if self.sample_time is not None and rates:
            raise ComponentError(self.name, "a sampled component (sample_time) writes update, not derivatives.")
        for mean in (o for o in self.outputs_declared if o.mean_of):
            of = self._variables.get(mean.mean_of)
            if of is None or of.shape != mean.shape:
                there = "there is none" if of is None else f"it has shape {of.shape}"
                text = f"{mean.name}, of shape {mean.shape}, is declared as the mean of {mean.mean_of}, but {there}."
                raise ComponentError(self.name, text)
        if self.states and not (rates or self.sampled or self.python_only):
            raise ComponentError(self.name, "has states but neither derivatives nor sample_time with update.")
        for output in self.exact_outputs:
            if not rates or output.step_mean or not any(s.calculated for s in self.states):
                text = f"{output.name} is exact, its start is set: then a continuous state must be calculated from it"
                raise ComponentError(self.name, f"{text}, State(calculated=True) and initial; a step mean cannot be.")

    def variant(self, **structure: int | str) -> "Component":
        """Return the component with another structure; start values whose shape or unit follows it are the class's."""
        told = {n: (*v.shape, v.unit) for n, v in _declared(type(self)).items()}
        kept = {n: v for n, v in self.given.items() if not follows(told.get(n, ()), structure)}
        return type(self)(**(kept | structure))

    # ---- declarations ----------------------------------------------------------------------------------------------

    def _of(self, kind: type) -> tuple[Any, ...]:
        return tuple(v for v in self._variables.values() if type(v) is kind)

    @cached_property
    def parameters(self) -> tuple[Parameter, ...]:
        """Parameters as declared, then those of the solver."""
        return self._of(Parameter)

    def _solver(self, states: bool) -> dict[str, Parameter]:
        """Return the parameters of the solver by name.

        Continuous states have `solver.step`. A sampled component has `sample_time` and `solver.commit_shown`: a master
        that sets the inputs of the step's end before the step (after_step) must not have them taken for the sample at
        its start.
        """
        if self.sampled:
            doc = "1: a sample is taken with the inputs as when its outputs were last shown, 0: as set before the step"
            return {
                "sample_time": Parameter(unit="s", start=self.sample_time, doc="time between two samples"),
                "solver.commit_shown": Parameter(unit="1", doc=doc),
            }
        if not states or self.python_only:
            return {}
        doc = "largest internal integration step; 0: from the fastest rate of the dynamics at the start"
        return {"solver.step": Parameter(unit="s", start=self.solver_step, tunable=True, doc=doc)}

    @cached_property
    def calculated_parameters(self) -> tuple[CalculatedParameter, ...]:
        """Calculated parameters; tunable where one depends on a tunable parameter."""
        declared: tuple[CalculatedParameter, ...] = self._of(CalculatedParameter)
        solver = self._solver(bool(self.states))  # nothing is calculated of these
        tunable = any(p.tunable for p in self.parameters if p.name not in solver)
        return tuple(replace(c, tunable=tunable) for c in declared)

    @cached_property
    def inputs(self) -> tuple[Input, ...]:
        """Inputs, in the order of declaration."""
        return self._of(Input)

    @cached_property
    def states(self) -> tuple[State, ...]:
        """States, in the order of declaration."""
        return self._of(State)

    @cached_property
    def outputs_declared(self) -> tuple[Output, ...]:
        """Outputs that are not states, those whose start is set first."""
        return tuple(sorted(self._of(Output), key=lambda output: not output.exact))

    @property
    def exact_outputs(self) -> tuple[Output, ...]:
        """Outputs whose start is set."""
        return tuple(o for o in self.outputs_declared if o.exact)

    @property
    def sampled(self) -> bool:
        """Whether the component has samples instead of a continuous state."""
        return self.sample_time is not None

    def size(self, group: Iterable[Variable]) -> int:
        """Return the number of scalars in a group of variables."""
        return sum(v.size for v in group)

    def declare(self) -> dict[str, Variable]:
        """Return further declarations, name -> variable, that follow from the structural parameters."""
        return {}

    # ---- equations, to be overridden -------------------------------------------------------------------------------

    def derivatives(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        """Return the time derivative of every state."""
        return {}

    def update(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        """Return the states after the sample at t."""
        return {}

    def outputs(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        """Return every output that is neither a state nor a step mean."""
        return {}

    def step_means(self, t: Any, x: Any, p: Any) -> dict[str, Any]:
        """Return, for every step-mean output, the quantity whose time derivative it averages."""
        return {}

    def calculate(self, p: Any) -> dict[str, Any]:
        """Return every calculated parameter."""
        return {}

    def initial(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        """Return the start value of every calculated state; x holds the others and the exact outputs."""
        return {}

    def project(self, x: Any, p: Any) -> dict[str, Any]:
        """Return the states that an internal step is followed by a projection of."""
        return {}

    def check(self, t: Any, x: Any, u: Any, p: Any) -> list[Condition]:
        """Return the conditions that parameters and initial values must meet."""
        return []

    # ---- derived ---------------------------------------------------------------------------------------------------

    @cached_property
    def functions(self) -> Functions:
        """The CasADi functions of the component."""
        return Functions(cast(Equations, self))  # pyright takes a cached property for its descriptor

    @cached_property
    def direct_feedthrough(self) -> dict[str, tuple[str, ...]]:
        """Output -> the inputs that it depends on directly, from the sparsity of the expressions."""
        return self.functions.direct_feedthrough()

    def linearise(self, x: np.ndarray, u: np.ndarray | None = None, t: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
        """Return the Jacobians (A, B) of the state derivatives by states and inputs, at the start parameters."""
        inputs = start_vector(self.inputs) if u is None else u
        p = start_vector(self.parameters)
        f = self.functions.rates
        arguments = f.mx_in()
        jacobian = ca.Function("J", arguments, [ca.jacobian(f(*arguments), v) for v in arguments[1:3]])
        a, b = jacobian(t, x, inputs, p, self.functions.calculate(p))
        return a.full(), b.full()


class PythonComponent(Component):
    """Base of a component in plain Python and NumPy, for the python back end only.

    Same declarations; `outputs(t, x, u, p)` and, with states, `step(t, h, x, u, p) -> {state: value at t + h}`, both
    pure: all that they remember, a random generator's state too, is in x. x, u, p hold floats and arrays. An output
    depends on every input unless `feedthrough` names those that it depends on.
    """

    python_only = True
    feedthrough: ClassVar[dict[str, tuple[str, ...]]] = {}

    def step(self, t: float, h: float, x: Any, u: Any, p: Any) -> dict[str, Any]:
        """Return every state at t + h, with the inputs held."""
        return {}

    @cached_property
    def direct_feedthrough(self) -> dict[str, tuple[str, ...]]:
        """Output -> inputs, as `feedthrough` declares, otherwise every input."""
        every = tuple(v.name for v in self.inputs)
        outputs = [v.name for v in self.outputs_declared]
        return {name: tuple(self.feedthrough.get(name, every)) for name in outputs}


def start_vector(group: Iterable[Variable]) -> np.ndarray:
    """Return the start values of a group of variables as one flat vector, matrices row by row."""
    values = [np.ravel(v.start) for v in group]
    return np.concatenate(values) if values else np.zeros(0)


def _ports(cls: type) -> tuple[type, ...]:
    """Return the classes whose declarations a component takes over."""
    return cls.ports if isinstance(cls.ports, tuple) else (cls.ports,)


def _declared(cls: type) -> dict[str, Variable]:
    """Return what ports, bases and class declare, a later declaration replacing an earlier one in its place."""
    found: dict[str, Variable] = {}
    for source in (*_ports(cls), *reversed(cls.__mro__)):
        found = _merge(cls.__name__, found, {n: v for n, v in vars(source).items() if isinstance(v, Variable)})
    return found


def _merge(component: str, found: dict[str, Variable], further: Mapping[str, Variable]) -> dict[str, Variable]:
    """Return the declarations with further ones added; one that is there already keeps its unit and shape."""
    merged = dict(found)
    for name, value in further.items():
        port = found.get(name)
        if port is not None and (port.unit, port.shape) != (value.unit, value.shape):
            raise ComponentError(
                component,
                f"{name} is declared with unit {value.unit} and shape {value.shape}, its port has unit {port.unit} "
                f"and shape {port.shape}.",
            )
        merged[name] = replace(value, name=name)
    return merged
