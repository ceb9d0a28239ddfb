"""Slaves in plain Python whose solutions are known in closed form, for tests of the master."""

import math
from collections.abc import Mapping, Sequence

import numpy as np

from cosim.errors import CallFailed
from cosim.slaves.slave import Refusal
from fmus.description.description import ModelDescription, ScalarVariable
from fmus.description.units import BaseUnit, Conversion, Unit

UNITS = {
    "rad": Unit("rad", BaseUnit((0,) * 7 + (1,)), {"deg": Conversion(180 / math.pi)}),
    "N.m": Unit("N.m", BaseUnit((1, 2, -2, 0, 0, 0, 0, 0))),
    "mN.m": Unit("mN.m", BaseUnit((1, 2, -2, 0, 0, 0, 0, 0), Conversion(1e-3))),
    "m": Unit("m", BaseUnit((0, 1, 0, 0, 0, 0, 0, 0))),
    "kg^(1/2).m": Unit("kg^(1/2).m"),
}


def describe(
    *,
    inputs: Sequence[str] = (),
    outputs: Sequence[str] = (),
    parameters: Mapping[str, object] | None = None,
    states: Mapping[str, float] | None = None,
    units: Mapping[str, str] | None = None,
    feedthrough: Mapping[str, tuple[str, ...] | None] | None = None,
    **capabilities,
) -> ModelDescription:
    """An description with Real inputs, calculated outputs, parameters and settable start states.

    `feedthrough` holds for initialization too; an output that is not in it follows no input, None: not said.
    """
    variables: dict[str, ScalarVariable] = {}

    def add(name, start=None, **kind):
        kinds = {bool: "Boolean", int: "Integer", str: "String"}
        variable_type = kinds.get(type(start), "Real")
        variables[name] = ScalarVariable(
            name, len(variables), type=variable_type, start=start, unit=(units or {}).get(name.split("[")[0]), **kind
        )

    for name in inputs:
        add(name, 0.0, causality="input", initial="exact")
    for name in outputs:
        add(name, causality="output", initial="calculated")
    for name, start in (parameters or {}).items():
        add(name, start, causality="parameter", variability="fixed", initial="exact")
    for name, start in (states or {}).items():
        add(name, start, causality="output", initial="exact")
    depends = {name: (feedthrough or {}).get(name, ()) for name in outputs}
    return ModelDescription(
        model_name="Fake",
        guid="{fake}",
        variables=variables,
        dependencies=depends | {name: () for name in states or {}},
        initial_unknowns=depends,
        units=UNITS,
        **{"refresh": True, **capabilities},
    )


class Fake:
    """A slave over a dictionary of values; subclasses write `evaluate` (outputs) and `advance` (a step).

    `calls` keeps what the master did, in order: ("set", {...}), ("step", t, h), ("get", names).
    """

    description: ModelDescription

    def __init__(self, name: str, description: ModelDescription, **values: float):
        self.name, self.description = name, description
        self.messages: list[str] = []
        self.warned: dict[str, tuple[int, float]] = {}
        self.values = {v.name: v.start if v.start is not None else 0.0 for v in description.variables.values()} | values
        self.slopes: dict[str, float] = {}
        self.higher: dict[tuple[str, int], float] = {}
        self.calls: list[tuple] = []
        self._names = {v.value_reference: v.name for v in description.variables.values()}

    def evaluate(self, v: dict) -> None: ...

    def advance(self, t: float, h: float, v: dict, slopes: dict[str, float]) -> None: ...

    def slope(self, name: str, order: int) -> float:
        return 0.0

    def instantiate(self):
        self.calls.append(("instantiate",))

    def get_integer(self, references):
        self.evaluate(self.values)
        return [int(self.values[self._names[r]]) for r in references]

    def set_integer(self, references, values):
        self.values |= {self._names[r]: value for r, value in zip(references, values, strict=True)}

    set_boolean = set_integer

    def get_boolean(self, references):
        self.evaluate(self.values)
        return [bool(self.values[self._names[r]]) for r in references]

    def get_string(self, references):
        self.evaluate(self.values)
        return [str(self.values[self._names[r]]).encode() for r in references]

    def set_string(self, references, values):
        self.values |= {self._names[r]: value.decode() for r, value in zip(references, values, strict=True)}

    def reset(self):
        return False

    def c_interface(self):
        return None

    def failed(self, status):
        return Refusal()

    def setup_experiment(self, t, tolerance=None, stop=None):
        self.calls.append(("setup", t))

    def enter_initialization_mode(self):
        self.calls.append(("enter",))

    def exit_initialization_mode(self):
        self.calls.append(("exit",))

    def get_real(self, references):
        self.evaluate(self.values)
        return np.array([self.values[self._names[r]] for r in references], dtype=float)

    def set_real(self, references, values):
        assert len(references) == len(values)
        new = {self._names[r]: float(x) for r, x in zip(references, values, strict=True)}
        self.calls.append(("set", new))
        self.values |= new

    def set_input_derivatives(self, references, orders, values):
        given = list(zip(references, orders, map(float, values), strict=True))
        self.slopes = {self._names[r]: x for r, n, x in given if n == 1}
        self.higher = {(self._names[r], n): x for r, n, x in given if n > 1}

    def get_output_derivatives(self, references, orders):
        return np.array([self.slope(self._names[r], n) for r, n in zip(references, orders, strict=True)])

    def do_step(self, t, h):
        self.calls.append(("step", t, h))
        self.advance(t, h, self.values, self.slopes)
        self.slopes, self.higher = {}, {}

    def directional_derivative(self, unknowns, knowns, seed):
        raise CallFailed(self.name, "fmi2GetDirectionalDerivative", "fmi2Error")

    def terminate(self):
        self.calls.append(("terminate",))

    def free(self):
        self.calls.append(("free",))

    def get_state(self):
        return dict(self.values)

    def set_state(self, state):
        self.values = dict(state)

    def free_state(self, state): ...

    def serialize_state(self, state):
        raise NotImplementedError

    def deserialize_state(self, data):
        raise NotImplementedError

    def stepped(self) -> list[tuple[float, float]]:
        return [call[1:] for call in self.calls if call[0] == "step"]

    def inputs_at_steps(self, name: str) -> list[float]:
        """What an input was in each step."""
        seen, result = math.nan, []
        for call in self.calls:
            if call[0] == "set" and name in call[1]:
                seen = call[1][name]
            elif call[0] == "step":
                result.append(seen)
        return result


class Integrator(Fake):
    """x' = u, exactly for an input with derivatives up to order 3; y = x; x0 can be set."""

    def __init__(self, name: str, x0: float = 0.0, **capabilities):
        super().__init__(name, describe(inputs=["u"], states={"y": x0}, **capabilities))

    def advance(self, t, h, v, slopes):
        second, third = (self.higher.get(("u", n), 0.0) for n in (2, 3))
        v["y"] += h * (v["u"] + h / 2 * (slopes.get("u", 0.0) + h / 3 * (second + h / 4 * third)))


class Clock(Fake):
    """y = t at each communication point, and its slope 1."""

    def __init__(self, name: str, **capabilities):
        super().__init__(name, describe(outputs=["y"], **capabilities))

    def setup_experiment(self, t, tolerance=None, stop=None):
        self.values["y"] = t

    def advance(self, t, h, v, slopes):
        v["y"] = round(t + h, 9)

    def slope(self, name, order):
        return 1.0 if order == 1 else 0.0


class Gain(Fake):
    """y = k u + b, direct feedthrough; `said` False: no dependencies in its modelDescription."""

    def __init__(self, name: str, k: float = 1.0, b: float = 0.0, said: bool = True, **capabilities):
        capabilities = {"provides_directional_derivative": True} | capabilities
        feedthrough = {"y": ("u",) if said else None}
        super().__init__(
            name,
            describe(inputs=["u"], outputs=["y"], parameters={"k": k, "b": b}, feedthrough=feedthrough, **capabilities),
        )

    def evaluate(self, v):
        v["y"] = v["k"] * v["u"] + v["b"]

    def directional_derivative(self, unknowns, knowns, seed):
        return np.array([self.values["k"] * seed[0]])


class Mean(Fake):
    """A step mean: y is the mean over the last step of the derivative of x = t^2, that is 2 t + h; x its integral."""

    def __init__(self, name: str):
        super().__init__(name, describe(outputs=["y", "x"], step_means={"y": ""}))

    def advance(self, t, h, v, slopes):
        v["y"] = ((t + h) ** 2 - t**2) / h
        v["x"] = (t + h) ** 2


class Failing(Integrator):
    """An integrator that fails in the step from `at`: with a status, with NaN, or with an interrupt."""

    def __init__(self, name: str, at: float, how: str):
        super().__init__(name, x0=1.0)
        self.at, self.how = at, how

    def advance(self, t, h, v, slopes):
        if t < self.at - 1e-12:
            return super().advance(t, h, v, slopes)
        if self.how == "interrupt":
            raise KeyboardInterrupt
        if self.how == "nan":
            v["y"] = math.nan
            return None
        self.messages.append("the wheel came off")
        last = t + 0.25 * h if self.how == "fmi2Discard" else None
        raise CallFailed(self.name, "fmi2DoStep", self.how, tuple(self.messages), last)


class Vehicle(Fake):
    """Arrays, units and all kinds of variables: what wiring and parameters are tested on."""

    def __init__(self, name: str = "plant", **capabilities):
        vector = [f"tau_B[{i}]" for i in (1, 2, 3)]
        matrix = {f"J[{i},{j}]": float(i == j) for i in (1, 2) for j in (1, 2)}
        units = {"tau_B": "N.m", "angle": "rad", "q_BN": "rad", "rho": "rad", "eta": "kg^(1/2).m"}
        super().__init__(
            name,
            describe(
                inputs=[*vector, "angle"],
                outputs=["q_BN[1]", "q_BN[2]", "q_BN[3]", "power", "eta"],
                parameters={
                    **matrix,
                    "rho": 0.1,
                    "count": 3,
                    "on": True,
                    "label": "a",
                    "Omega[1]": 1.0,
                    "Omega[2]": 2.0,
                },
                states={"omega[1]": 0.5, "omega[2]": 0.25},
                units=units,
                **capabilities,
            ),
        )


class Mass(Fake):
    """m x'' = f - k x, solved exactly for constant f."""

    def __init__(self, name, x0, k, m=1.0):
        super().__init__(name, describe(inputs=["f"], states={"x": x0, "v": 0.0}))
        self.w, self.k = math.sqrt(k / m), k

    def advance(self, t, h, v, slopes):
        rest = v["f"] / self.k
        x, speed, c, s = v["x"] - rest, v["v"], math.cos(self.w * h), math.sin(self.w * h)
        v["x"], v["v"] = rest + c * x + s * speed / self.w, c * speed - s * x * self.w


class Spring(Fake):
    """Feedthrough: f_1 = c (x_2 - x_1) = -f_2."""

    def __init__(self, name, c):
        both = ("x_1", "x_2")
        super().__init__(name, describe(inputs=both, outputs=["f_1", "f_2"], feedthrough={"f_1": both, "f_2": both}))
        self.c = c

    def evaluate(self, v):
        v["f_1"] = self.c * (v["x_2"] - v["x_1"])
        v["f_2"] = -v["f_1"]
