"""What several tests use: random points of a component, and a whole system as one ODE for scipy."""

from collections.abc import Sequence

import casadi as ca
import numpy as np
from numpy.testing import assert_allclose
from scipy.integrate import solve_ivp

from components.framework import Component
from components.framework.component import start_vector
from components.framework.units import UNITS
from components.framework.vectors import unflatten


def split(group, vector) -> dict[str, np.ndarray]:
    """Name -> array of a flat vector, or of rows of flat vectors."""
    found, at = {}, 0
    for v in group:
        part = np.asarray(vector)[..., at : at + v.size]
        found[v.name] = part.reshape((*part.shape[:-1], *v.shape))
        at += v.size
    return found


def numbers(values) -> np.ndarray:
    """A CasADi result as a flat array."""
    return np.asarray(ca.DM(values)).ravel()


class Point:
    """A component initialised at t = 0, at its start or near it at random: x, u, p flat vectors, at the time t.

    Values by name replace what is drawn. c and m are the calculated parameters and step means that belong to them,
    e the starts of the exact outputs.
    """

    def __init__(self, component: Component, rng: np.random.Generator | None = None, spread=0.1, t=0.0, **values):
        self.component, self.functions, self.t = component, component.functions, 0.0
        groups = {
            "x": component.states,
            "u": component.inputs,
            "p": component.parameters,
            "e": component.exact_outputs,
        }
        for name, group in groups.items():
            vector = start_vector(group)
            if rng is not None:
                # A parameter moves by per mille, so that a matrix keeps its definiteness; the rest by its nominal size.
                nominal = np.concatenate([np.full(v.size, v.nominal or 1.0) for v in group] or [np.zeros(0)])
                size = 1e-3 * np.abs(vector) if name == "p" else spread * nominal
                vector = vector + size * rng.uniform(0.1, 1, len(vector)) * rng.choice([-1, 1], len(vector))
            at = 0
            for v in group:
                if v.name in values:
                    vector[at : at + v.size] = np.ravel(values.pop(v.name))
                at += v.size
            setattr(self, name, vector)
        if values:
            raise KeyError(f"{component.name} has no {', '.join(values)}")
        means = sum(o.size for o in component.outputs_declared if o.step_mean)
        self.m = np.zeros(means) if rng is None else rng.uniform(-1, 1, means)
        self.x = self.initial()
        if rng is not None:  # else what starts from its inputs would be at an equilibrium of all that is held
            sizes = [np.full(v.size, v.calculated * (v.nominal or 1.0)) for v in component.states]
            moved = np.concatenate(sizes or [np.zeros(0)])
            self.x = self.x + spread * moved * rng.uniform(0.1, 1, len(moved))
        self.t = t

    @property
    def c(self):
        return numbers(self.functions.calculate(self.p))

    def initial(self):
        return numbers(self.functions.initial(self.t, self.x, self.u, self.p, self.c, self.e))

    def rates_flat(self):
        if not self.component.states:
            return np.zeros(0)
        f = self.functions.update if self.component.sampled else self.functions.rates
        return numbers(f(self.t, self.x, self.u, self.p, self.c))

    def rates(self):
        return split(self.component.states, self.rates_flat())

    def states(self):
        return split(self.component.states, self.x)

    def output_rates(self) -> dict[str, np.ndarray]:
        """The time derivatives of the outputs along the motion, inputs held."""
        held = (0 * self.u, 0 * self.p, 0 * self.m)
        _, y = self.functions.forward(self.t, self.x, self.u, self.p, self.c, 1, self.rates_flat(), *held)
        return split(self.component.outputs_declared, numbers(y))

    def outputs_flat(self):
        return numbers(self.functions.outputs(self.t, self.x, self.u, self.p, self.c, self.m))

    def outputs(self):
        return split(self.component.outputs_declared, self.outputs_flat())

    def advance(self, h: float, steps: int = 1):
        """The states after 1, 2, ... internal steps of h with the inputs held, a column a step."""
        x, k = ca.MX.sym("x", len(self.x)), ca.MX.sym("k")
        after = self.functions.advance(self.t, x, self.u, 0 * self.u, 0 * self.u, 0 * self.u, self.p, self.c, k * h, h)
        return ca.Function("step", [x, k], [after]).mapaccum(steps)(self.x, np.arange(steps)[None]).full()

    def violated(self) -> list[str]:
        """The messages of the violated conditions of `check`."""
        margins, shown = (numbers(v) for v in self.functions.check(self.t, self.x, self.u, self.p, self.c))
        messages, at = [], 0
        for condition, margin in zip(self.functions.conditions, margins, strict=True):
            values = shown[at : at + len(condition.shown)]
            at += len(condition.shown)
            if not margin > 0:
                messages.append(condition.text.format(*(f"{v:.6g}" for v in values)))
        return messages


def assert_units(component: Component, spread=0.1, seed=5, kg=3.0, m=0.7, s=1.9) -> None:
    """Every result moves by its declared unit when kg, m and s change: declared units are those of the equations."""
    point, other = (Point(component, np.random.default_rng(seed), spread, t=2.0) for _ in range(2))

    def factors(group):
        return np.concatenate([np.full(v.size, UNITS[v.unit].scale(kg=kg, m=m, s=s)) for v in group] or [np.zeros(0)])

    x, y = factors(component.states), factors(component.outputs_declared)
    means = factors(o for o in component.outputs_declared if o.step_mean)
    other.t, other.x, other.m = point.t * s, point.x * x, point.m * means
    other.e = point.e * factors(component.exact_outputs)
    other.u, other.p = point.u * factors(component.inputs), point.p * factors(component.parameters)
    per_time = 1 if component.sampled else s
    pairs = {
        "rates or update": (component.states, point.rates_flat() * x / per_time, other.rates_flat()),
        "outputs": (component.outputs_declared, point.outputs_flat() * y, other.outputs_flat()),
        "calculate": (component.calculated_parameters, point.c * factors(component.calculated_parameters), other.c),
        "initial": (component.states, point.initial() * x, other.initial()),
    }
    for where, (group, expected, found) in pairs.items():
        for (name, a), b in zip(split(group, expected).items(), split(group, found).values(), strict=True):
            atol = 1e-9 * np.max(np.abs(a), initial=0)
            assert_allclose(b, a, rtol=1e-9, atol=atol, err_msg=f"unit of {component.name}.{name} in {where}")


class Monolithic:
    """Components and connections as one ODE, made of the components' own functions.

    connections: ("plant.q_BN", "controller.q_BN"), ...; an input without one keeps its start value. A step-mean output
    is the derivative that it is the mean of.
    """

    def __init__(self, components: dict[str, Component], connections: Sequence[tuple[str, str]]):
        self.components = components
        self._source = {target: source for source, target in connections}
        self._t = ca.SX.sym("t")
        self._x = {n: ca.SX.sym(n, c.size(c.states)) for n, c in components.items()}
        self._p = {n: start_vector(c.parameters) for n, c in components.items()}
        self._c = {n: c.functions.calculate(self._p[n]) for n, c in components.items()}
        self._values: dict[str, ca.SX] = {}
        rates = [self._rates(n) for n in components]
        self._outputs = [f"{n}.{o.name}" for n, c in components.items() for o in c.outputs_declared]
        signals = ca.densify(ca.vertcat(*(self.value(name) for name in self._outputs), ca.SX(0, 1)))
        state = ca.vertcat(*self._x.values())
        self.rates = ca.Function("rates", [self._t, state], [ca.densify(ca.vertcat(*rates))], {"cse": True})
        self.signals = ca.Function("signals", [self._t, state], [signals], {"cse": True})

    def _rates(self, name: str) -> ca.SX:
        part = self.components[name]
        if not part.states:
            return ca.SX(0, 1)
        u = self._inputs(name, [v.name for v in part.inputs])
        return part.functions.rates(self._t, self._x[name], u, self._p[name], self._c[name])

    def _inputs(self, name: str, needed) -> ca.SX:
        """The inputs of a component; those that are not needed keep their start values."""
        parts = []
        for v in self.components[name].inputs:
            source = self._source.get(f"{name}.{v.name}")
            parts.append(self.value(source) if source and v.name in needed else ca.SX(np.ravel(v.start)))
        return ca.vertcat(*parts) if parts else ca.SX(0, 1)

    def value(self, signal: str) -> ca.SX:
        """A state or an output, flat, as an expression of the time and all states."""
        if signal not in self._values:
            name, variable = signal.split(".", 1)
            part = self.components[name]
            states = unflatten_flat(part.states, self._x[name])
            self._values[signal] = states[variable] if variable in states else self._output(name, variable)
        return self._values[signal]

    def _output(self, name: str, variable: str) -> ca.SX:
        part, f = self.components[name], self.components[name].functions
        point = [self._t, self._x[name], None, self._p[name], self._c[name]]
        means = [o for o in part.outputs_declared if o.step_mean]
        if variable in [o.name for o in means]:
            point[2] = self._inputs(name, [v.name for v in part.inputs])
            return unflatten_flat(means, f.mean_rates(*point))[variable]
        point[2] = self._inputs(name, part.direct_feedthrough[variable])
        m = ca.DM.zeros(sum(o.size for o in means))
        return unflatten_flat(part.outputs_declared, f.outputs(*point, m))[variable]

    def start(self, t: float = 0.0) -> np.ndarray:
        """The states at the start, calculated ones too (they depend on inputs: one sweep a component is enough)."""
        x = {n: start_vector(c.states) for n, c in self.components.items()}
        inputs = {n: self._inputs(n, [v.name for v in c.inputs]) for n, c in self.components.items()}
        u = ca.Function("u", [self._t, *self._x.values()], list(inputs.values()))
        for _ in range(len(x) + 1):
            now = u.call([t, *x.values()])
            for (n, c), values in zip(self.components.items(), now, strict=True):
                e = start_vector(c.exact_outputs)
                x[n] = numbers(c.functions.initial(t, x[n], values, self._p[n], self._c[n], e))
        return np.concatenate(list(x.values()))

    def solve(self, t: np.ndarray, x: np.ndarray | None = None, rtol: float = 1e-10, atol: float = 1e-14) -> np.ndarray:
        """Integrate by scipy's DOP853 from t[0] and the states x (at the start if not given); the states as rows."""
        buffer, call = self.rates.buffer()
        time, state = np.zeros(1), np.zeros(self.rates.numel_in(1))
        result = np.zeros_like(state)
        buffer.set_arg(0, memoryview(time))
        buffer.set_arg(1, memoryview(state))
        buffer.set_res(0, memoryview(result))

        def rates(now: float, values: np.ndarray) -> np.ndarray:
            time[0], state[:] = now, values
            call()
            return result.copy()

        start = self.start(t[0]) if x is None else x
        solution = solve_ivp(rates, (t[0], t[-1]), start, "DOP853", t_eval=t, rtol=rtol, atol=atol)
        if solution.status:
            raise RuntimeError(f"monolithic integration ended at {solution.t[-1]} s: {solution.message}")
        return solution.y.T

    def split(self, rows: np.ndarray) -> dict[str, np.ndarray]:
        """Rows of all states -> {"component.state": rows}."""
        found, at = {}, 0
        for n, c in self.components.items():
            size = c.size(c.states)
            values = split(c.states, rows[..., at : at + size])
            found |= {f"{n}.{name}": value for name, value in values.items()}
            at += size
        return found

    def outputs(self, t: np.ndarray, rows: np.ndarray) -> dict[str, np.ndarray]:
        """{"component.output": rows} at the times of the rows."""
        values = self.signals.map(len(t))(np.reshape(t, (1, -1)), rows.T).full().T
        found, at = {}, 0
        for n, c in self.components.items():
            size = c.size(c.outputs_declared)
            part = split(c.outputs_declared, values[:, at : at + size])
            found |= {f"{n}.{name}": value for name, value in part.items()}
            at += size
        return found


def unflatten_flat(group, vector) -> dict[str, ca.SX]:
    """Name -> flat column of a flat vector, matrices row by row."""
    return {n: ca.vec(v.T) if v.shape[1] > 1 else v for n, v in unflatten(group, vector).items()}


def monolithic(
    components: dict[str, Component],
    connections: Sequence[tuple[str, str]],
    stop: float,
    rows: np.ndarray | None = None,
    rtol: float = 1e-10,
    atol: float = 1e-14,
) -> tuple[np.ndarray, dict[str, np.ndarray], dict[str, np.ndarray]]:
    """Integrate a whole system with scipy's DOP853; return t, {"component.state": rows}, {"component.output": rows}.

    rows: the times to return, the first the start's; every 10 ms if not given.
    """
    system = Monolithic(components, connections)
    t = np.linspace(0.0, stop, round(stop / 0.01) + 1) if rows is None else np.asarray(rows, float)
    x = system.solve(t, None, rtol, atol)
    return t, system.split(x), system.outputs(t, x)
