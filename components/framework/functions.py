"""A component's equations as CasADi functions of flat vectors.

t scalar; x states, u inputs, p parameters, c calculated parameters, m step means, y outputs that are not states, of
which the first, e, have a start that is set: columns in the order of declaration, matrices row by row.
"""

from collections.abc import Iterable
from functools import cached_property
from typing import Any

import casadi as ca
import numpy as np

from .equations import Condition, Equations
from .errors import ComponentError
from .integrator import rk4
from .unit_vectors import normalised, unit_conditions
from .variables import Variable
from .vectors import Values, flatten, unflatten


class Functions:
    """The CasADi functions of one component, each built when it is first asked for.

    rates       (t, x, u, p, c) -> dx                       absent without continuous states
    advance     (t, x, u, u1, u2, u3, p, c, s, h) -> x_next     one internal step, see integrator.py
    project     (x, p, c) -> x                              None where a step is followed by none
    update      (t, x, u, p, c) -> x_next                   sampled components
    outputs     (t, x, u, p, c, m) -> y
    slopes      (t, x, u, p, c, m, su) -> y, dx, dy         outputs, and the rates of x and y where those of u are su
    means       (t, x, p, c) -> q                           quantities whose rate the step means average
    mean_rates  (t, x, u, p, c) -> m                        their time derivatives
    calculate   (p) -> c
    normalise   (x, p) -> lengths, x, p                     None without unit vectors, see unit_vectors.py
    initial     (t, x, u, p, c, e) -> x                     calculated states filled in
    check       (t, x, u, p, c) -> margins, shown
    forward     (t, x, u, p, c, st, sx, su, sp, sm) -> sdx, sy      directional derivative
    initial_forward  (t, x, u, p, c, e, st, sx, su, sp, se) -> sx_initial, sm     the same of initial and mean_rates
    calculate_forward  (p, sp) -> sc                                the same of calculate
    """

    def __init__(self, component: Equations):
        self._component = component
        self._t = ca.SX.sym("t")
        self._x = ca.SX.sym("x", component.size(component.states))
        self._u = ca.SX.sym("u", component.size(component.inputs))
        self._p = ca.SX.sym("p", component.size(component.parameters))
        self._c = ca.SX.sym("c", component.size(component.calculated_parameters))
        self._m = ca.SX.sym("m", sum(o.size for o in component.outputs_declared if o.step_mean))
        self._e = ca.SX.sym("e", component.size(component.exact_outputs))

    # ---- expressions -----------------------------------------------------------------------------------------------

    @cached_property
    def _named(self) -> tuple[Any, Values, Values, Values]:
        """(t, x, u, p) as the component's equations see them."""
        part = self._component
        parameters = unflatten(part.parameters, self._p) | unflatten(part.calculated_parameters, self._c)
        x, u = unflatten(part.states, self._x), unflatten(part.inputs, self._u)
        return self._t, Values(**x), Values(**u), Values(**parameters)

    def _flatten(self, where: str, group: Iterable[Variable], values: dict[str, Any]) -> ca.SX:
        return flatten(self._component.name, where, group, values)

    def _function(self, name: str, arguments: str, results: dict[str, Any]) -> ca.Function:
        names = arguments.split()
        inputs = [self._arguments[n] for n in names]
        return ca.Function(name, inputs, list(results.values()), names, list(results), {"cse": True})

    @property
    def _arguments(self) -> dict[str, ca.SX]:
        vectors = {"t": self._t, "x": self._x, "u": self._u, "p": self._p, "c": self._c, "m": self._m}
        return {**vectors, "e": self._e}

    def _states_with(self, where: str, values: dict[str, Any]) -> ca.SX:
        """Return the state vector with some states replaced."""
        _, x, _, _ = self._named
        return self._flatten(where, self._component.states, vars(x) | values)

    @cached_property
    def _means(self) -> tuple[Variable, ...]:
        return tuple(o for o in self._component.outputs_declared if o.step_mean)

    # ---- functions -------------------------------------------------------------------------------------------------

    @cached_property
    def calculate(self) -> ca.Function:
        """(p) -> c."""
        part = self._component
        values = part.calculate(Values(**unflatten(part.parameters, self._p)))
        return self._function("calculate", "p", {"c": self._flatten("calculate", part.calculated_parameters, values)})

    @cached_property
    def normalise(self) -> ca.Function | None:
        """(x, p) -> lengths of the unit vectors, and x, p with those divided by theirs that were typed."""
        part = self._component
        of_x, x = normalised(part.states, unflatten(part.states, self._x))
        of_p, p = normalised(part.parameters, unflatten(part.parameters, self._p))
        flat = {"x_unit": self._flatten("x", part.states, x), "p_unit": self._flatten("p", part.parameters, p)}
        lengths = ca.vertcat(*of_x, *of_p)
        return self._function("normalise", "x p", {"lengths": lengths, **flat}) if of_x or of_p else None

    @cached_property
    def initial(self) -> ca.Function:
        """(t, x, u, p, c, e) -> x with the calculated states filled in."""
        part = self._component
        t, x, u, p = self._named
        values = part.initial(t, Values(**vars(x), **unflatten(part.exact_outputs, self._e)), u, p)
        names = {s.name for s in part.states if s.calculated}
        if set(values) != names:
            text = f"initial returns {sorted(values)}, the calculated states are {sorted(names)}."
            raise ComponentError(part.name, text)
        return self._function("initial", "t x u p c e", {"x_initial": self._states_with("initial", values)})

    @cached_property
    def rates(self) -> ca.Function:
        """(t, x, u, p, c) -> dx."""
        part = self._component
        dx = self._flatten("derivatives", part.states, part.derivatives(*self._named))
        return self._function("rates", "t x u p c", {"dx": dx})

    @cached_property
    def project(self) -> ca.Function | None:
        """(x, p, c) -> x back on its manifold, None where an internal step is followed by no projection."""
        _, x, _, p = self._named
        values = self._component.project(x, p)
        return (
            self._function("project", "x p c", {"x_projected": self._states_with("project", values)})
            if values
            else None
        )

    @cached_property
    def advance(self) -> ca.Function:
        """One internal step, see integrator.py."""
        return rk4(self.rates, self.project)

    @cached_property
    def update(self) -> ca.Function:
        """(t, x, u, p, c) -> states after the sample."""
        part = self._component
        values = self._flatten("update", part.states, part.update(*self._named))
        return self._function("update", "t x u p c", {"x_next": values})

    @cached_property
    def outputs(self) -> ca.Function:
        """(t, x, u, p, c, m) -> y, with the step means m in their places."""
        part = self._component
        values = dict(part.outputs(*self._named))
        values |= unflatten(self._means, self._m)
        return self._function("outputs", "t x u p c m", {"y": self._flatten("outputs", part.outputs_declared, values)})

    @cached_property
    def slopes(self) -> ca.Function:
        """(t, x, u, p, c, m, su) -> y, dx, and dy = dy/dt + dy/dx dx + dy/du su, step means held."""
        point = (self._t, self._x, self._u, self._p, self._c)
        dx = self.rates(*point) if self._component.states else ca.SX(0, 1)
        su = self._seeds["su"]
        y = self.outputs(*point, self._m)
        along, tangent = ca.vertcat(self._t, self._x, self._u), ca.vertcat(ca.SX(1), dx, su)
        dy = ca.densify(ca.jtimes(y, along, tangent))
        names = ["t", "x", "u", "p", "c", "m", "su"]
        return ca.Function("slopes", [*point, self._m, su], [y, dx, dy], names, ["y", "dx", "dy"], {"cse": True})

    @cached_property
    def means(self) -> ca.Function:
        """(t, x, p, c) -> quantities whose rate the step means average."""
        t, x, _, p = self._named
        values = self._flatten("step_means", self._means, self._component.step_means(t, x, p))
        return self._function("means", "t x p c", {"q": values})

    @cached_property
    def mean_rates(self) -> ca.Function:
        """(t, x, u, p, c) -> time derivatives of means: what a step mean shows before the first step."""
        q = self.means(self._t, self._x, self._p, self._c)
        rate = ca.jtimes(q, self._x, self.rates(self._t, self._x, self._u, self._p, self._c)) + ca.jacobian(q, self._t)
        return self._function("mean_rates", "t x u p c", {"m": ca.densify(rate)})

    @cached_property
    def conditions(self) -> list[Condition]:
        """What unit vectors must be, and what check returns, as expressions."""
        _, x, _, p = self._named
        return [*unit_conditions(self._component, x, p), *self._component.check(*self._named)]

    @cached_property
    def lasting_conditions(self) -> list[bool]:
        """Which conditions are of parameters alone, so that they hold in flight too; others are of the start."""
        start = ca.vertcat(self._t, self._x, self._u)
        return [not ca.depends_on(ca.SX(c.margin), start) for c in self.conditions]

    @cached_property
    def conditions_of_inputs(self) -> list[bool]:
        """Which conditions an input can break, also through the states that are calculated from it."""
        calculated, _ = self.initial.jac_sparsity(0, 2).get_triplet()
        follow = ca.vertcat(self._u, *(self._x[i] for i in sorted(set(calculated))))
        return [ca.depends_on(ca.SX(c.margin), follow) for c in self.conditions]

    @cached_property
    def check(self) -> ca.Function:
        """(t, x, u, p, c) -> margins, one a condition, and the numbers that their texts show."""
        margins = [ca.SX(c.margin) for c in self.conditions]
        shown = [ca.SX(value) for c in self.conditions for value in c.shown]
        for condition, margin in zip(self.conditions, margins, strict=True):
            if margin.shape != (1, 1):
                raise ComponentError(self._component.name, f"check: margin of {condition.text!r} is no scalar.")
        columns = {"margins": margins, "shown": shown}
        results = {name: ca.densify(ca.vertcat(*values, ca.SX(0, 1))) for name, values in columns.items()}
        return self._function("check", "t x u p c", results)

    # ---- derivatives -----------------------------------------------------------------------------------------------

    @cached_property
    def _seeds(self) -> dict[str, ca.SX]:
        return {f"s{n}": ca.SX.sym(f"s{n}", v.shape) for n, v in self._arguments.items() if n != "c"}

    def _directional(self, name: str, expressions: dict[str, ca.SX], known: str, seeds: str) -> ca.Function:
        """Return the directional derivative of expressions of `known`, along `seeds`, c following p."""
        s = {n: symbol if n in seeds.split() else 0 * symbol for n, symbol in self._seeds.items()}
        s["sc"] = ca.jtimes(self.calculate(self._p), self._p, s["sp"])
        along = ca.vertcat(*self._arguments.values())
        tangent = ca.vertcat(*(s[f"s{n}"] for n in self._arguments))
        results = [ca.densify(ca.jtimes(e, along, tangent)) for e in expressions.values()]
        arguments = [*(self._arguments[n] for n in known.split()), *(s[n] for n in seeds.split())]
        return ca.Function(name, arguments, results, [*known.split(), *seeds.split()], list(expressions), {"cse": True})

    @cached_property
    def forward(self) -> ca.Function:
        """Directional derivative of the state derivatives and outputs (sampled: of the outputs at a sample)."""
        part = self._component
        point = (self._t, self._x, self._u, self._p, self._c)
        zero = ca.DM.zeros(self._m.shape)
        if part.sampled:
            dx = ca.SX(0, 1)
            y = self.outputs(self._t, self.update(*point), self._u, self._p, self._c, zero)
        else:
            dx = self.rates(*point) if part.states else ca.SX(0, 1)
            y = self.outputs(*point, self._m)
        return self._directional("forward", {"sdx": dx, "sy": y}, "t x u p c", "st sx su sp sm")

    @cached_property
    def initial_forward(self) -> ca.Function:
        """Directional derivative of the calculated initial states and of the step means before the first step."""
        x = self.initial(self._t, self._x, self._u, self._p, self._c, self._e)
        means = self.mean_rates(self._t, x, self._u, self._p, self._c) if self._means else ca.SX(0, 1)
        expressions = {"sx_initial": x, "sm": means}
        return self._directional("initial_forward", expressions, "t x u p c e", "st sx su sp se")

    @cached_property
    def calculate_forward(self) -> ca.Function:
        """Directional derivative of the calculated parameters."""
        sp = self._seeds["sp"]
        sc = ca.densify(ca.jtimes(self.calculate(self._p), self._p, sp))
        return ca.Function("calculate_forward", [self._p, sp], [sc], ["p", "sp"], ["sc"], {"cse": True})

    # ---- sparsity --------------------------------------------------------------------------------------------------

    @cached_property
    def output_dependencies(self) -> list[dict[str, list[int]]]:
        """For each scalar of y: {"x": indices, "u": indices} that it depends on between communication points."""
        part = self._component
        if not part.sampled:
            return _dependencies(self.outputs, "y", ("x", "u"))
        point = (self._t, self._x, self._u, self._p, self._c)
        y = self.outputs(self._t, self.update(*point), self._u, self._p, self._c, ca.DM.zeros(self._m.shape))
        return _dependencies(ca.Function("y", list(point), [y], ["t", "x", "u", "p", "c"], ["y"]), "y", ("x", "u"))

    @cached_property
    def rate_dependencies(self) -> list[dict[str, list[int]]]:
        """For each continuous state: what its derivative depends on."""
        return _dependencies(self.rates, "dx", ("x", "u"))

    @cached_property
    def initial_dependencies(self) -> dict[str, list[dict[str, list[int]]]]:
        """For each calculated parameter, state, state derivative and output: what it depends on in initialization mode.

        Keys "c", "x", "dx", "y"; composed, so that the knowns are the settable states, the inputs, the parameters and
        the exact outputs.
        """
        part = self._component
        c = self.calculate(self._p)
        x = self.initial(self._t, self._x, self._u, self._p, c, self._e)
        known = [self._t, self._x, self._u, self._p, self._e]
        m = self.mean_rates(self._t, x, self._u, self._p, c) if self._means else ca.SX(0, 1)
        shown = self.update(self._t, x, self._u, self._p, c) if part.sampled else x
        unknown = {"c": c, "x": x, "y": self.outputs(self._t, shown, self._u, self._p, c, m)}
        if part.states and not part.sampled:
            unknown["dx"] = self.rates(self._t, x, self._u, self._p, c)
        names = [f"{name}_initial" for name in unknown]
        f = ca.Function("initial_unknowns", known, list(unknown.values()), ["t", "x", "u", "p", "e"], names)
        return {name: _dependencies(f, f"{name}_initial", ("x", "u", "p", "e")) for name in unknown}

    def direct_feedthrough(self) -> dict[str, tuple[str, ...]]:
        """Output -> the inputs, by name, that it depends on directly."""
        part = self._component
        owner = [v.name for v in part.inputs for _ in range(v.size)]
        rows = iter(self.output_dependencies)
        table: dict[str, tuple[str, ...]] = {}
        for output in part.outputs_declared:
            used = {owner[i] for _ in range(output.size) for i in next(rows)["u"]}
            table[output.name] = tuple(v.name for v in part.inputs if v.name in used)
        return table


def _dependencies(f: ca.Function, result: str, arguments: tuple[str, ...]) -> list[dict[str, list[int]]]:
    """Return, row by row of a result, the structural nonzeros of its Jacobian by each argument."""
    out = f.index_out(result)
    rows: list[dict[str, list[int]]] = [{n: [] for n in arguments} for _ in range(f.size1_out(out))]
    for name in arguments:
        index = f.index_in(name)
        if f.size1_in(index) == 0 or not rows:
            continue
        for row, column in zip(*(np.asarray(k) for k in f.jac_sparsity(out, index).get_triplet()), strict=True):
            rows[int(row)][name].append(int(column))
    return rows
