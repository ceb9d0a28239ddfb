"""Signals in a wiring: all that feed one component are the outputs of one more component, which steps before it.

Over a step from t to t + h that component tells, of each signal u, its value and slope at t + h, and the polynomial
v(s) that the target is given, by its derivatives at s = 0. Where no knot lies within the step, and the target takes
polynomials of that degree, v is u. Else, with the moments

    I_0 = int_0^h u(t + s) ds,    I_1 = int_0^h s u(t + s) ds                                             (1)

v has those of them that it can: a target that takes derivatives up to order 3 a cubic with both, and u's values at both
ends; of order 1 the line with both; a target that does not interpolate, and every `previous` signal, the mean. So the
impulse of a force is exact over each step whatever lies within it, and but for the mean its first moment too: a free
body is at each communication point where the signal itself would take it.

Variables other than Real take a `previous` signal of whole numbers, at its value at t.
"""

from collections.abc import Mapping

import numpy as np

from cosim.arrays import FloatArray
from cosim.errors import SignalError, SimulationError, UnknownName, WiringError
from cosim.system.parameters import Parameters
from cosim.system.signal import Signal
from cosim.system.system import System
from cosim.system.wiring import Channel, Feed, Link, Port
from cosim.time import Schedule
from fmus.description.description import ModelDescription, ScalarVariable
from fmus.description.names import nearest, split_port

Pieces = list[tuple[FloatArray, FloatArray]]
"""Knots and coefficients of each channel, shapes (n,) and (n - 1, 4)."""

SLOTS = 5
"""Of each channel, by value references: the value at the end of the step, then v, v', v'', v''' at its start."""

COVER = 1e-9
"""How near a signal's time must be to one of the flight to be the same, s: sums of decimals are."""


def description(feed: Feed) -> ModelDescription:
    """Return what the instance that signals are offers a master."""
    variables: dict[str, ScalarVariable] = {}
    for i, channel in enumerate(feed.channels):
        for j, name in enumerate(_names(channel.target.variable, channel.degree)):
            variables[name] = ScalarVariable(name, SLOTS * i + j, causality="output", initial="calculated")
    return ModelDescription(
        model_name="Signals",
        guid="",
        variables=variables,
        dependencies=dict.fromkeys(variables, ()),
        initial_unknowns=dict.fromkeys(variables, ()),
        max_output_derivative_order=1,
        can_get_and_set_state=True,
        can_serialize_state=True,
        refresh=True,
    )


def uncovered(feed: Feed, schedule: Schedule) -> list[SignalError]:
    """Return what is wrong with signals that do not reach over the flight, each signal once."""
    first, last = schedule.time(0), schedule.time(schedule.steps)
    found: dict[str, SignalError] = {}
    for channel in feed.channels:
        signal = channel.signal
        a, b = float(signal.time[0]), float(signal.time[-1])
        if a > first + COVER or b < last - COVER:
            problem = f"it reaches from {a:.12g} to {b:.12g} s, the flight from {first:.12g} to {last:.12g} s"
            name = _whole(channel.target)
            advice = f"It feeds {name}: give it samples over the whole flight, or let that end earlier."
            found.setdefault(str(name), SignalError(signal.label, problem, advice))
    return list(found.values())


def pieces(feed: Feed, schedule: Schedule) -> Pieces:
    """Return knots and coefficients of each channel, shapes (n,) and (n - 1, 4)."""
    made: dict[int, tuple[FloatArray, FloatArray]] = {}
    for channel in feed.channels:
        if id(channel.signal) not in made:
            knots = _on_points(channel.signal.time, schedule)
            made[id(channel.signal)] = _with_last(channel.signal, knots, channel.signal.coefficients(knots))
    both = [(*made[id(c.signal)], c.element) for c in feed.channels]
    return [(knots, np.ascontiguousarray(found[:, element])) for knots, found, element in both]


class Feeds:
    """Resolves the signals of a system; every mistake is put into `mistakes` instead of raised."""

    def __init__(self, system: System, descriptions: Mapping[str, ModelDescription]) -> None:
        self.mistakes: list[SimulationError] = []
        self.feeds: dict[str, Feed] = {}
        self.links: list[Link] = []
        self._descriptions = descriptions
        self._parameters = Parameters(system, descriptions)
        channels: dict[str, list[Channel]] = {}
        for key, signal in system.inputs.items():
            for channel, link in self._fed(key, signal):
                channels.setdefault(channel.target.component, []).append(channel)
                self.links.append(link)
        for component in descriptions:
            if component in channels:
                feed = Feed(component, tuple(channels[component]))
                self.feeds[feed.name] = feed

    def _fed(self, key: str, signal: object) -> list[tuple[Channel, Link]]:
        """Return what one entry of `System.inputs` feeds, element by element."""
        component, name = split_port(key)
        description = self._descriptions.get(component)
        if description is None:
            return self._wrong(UnknownName("component", component, f'inputs "{key}"', list(self._descriptions)))
        if not isinstance(signal, Signal):
            problem = f"inputs has for {key} {type(signal).__name__} {signal!r:.60}, which is no Signal"
            return self._wrong(
                WiringError(problem, f'Write Signal({signal!r:.60}), or hold it: held={{"{key}": ...}}.')
            )
        try:
            group = description.find(name, "input", f'component "{component}"')
        except UnknownName as error:
            known = error if error.kind == "element" else None
            inputs = description.base_names("input")
            return self._wrong(known or UnknownName("input", error.name, error.where, inputs))
        variables = [description.variables[e] for e in group.elements]
        if variables[0].causality != "input":
            known_inputs = ", ".join(description.base_names("input")) or "none"
            near = nearest(name, description.base_names("input"))
            hint = f"Did you mean {near[0]}?" if near else f"Inputs: {known_inputs}."
            return self._wrong(SignalError(signal.label, f"it feeds {key}, which is no input", hint))
        if len(variables) != signal.width:
            size = f"{len(variables)} element{'s' if len(variables) != 1 else ''}"
            problem = f"it has {signal.width} column{'s' if signal.width != 1 else ''}, {key} has {size}"
            return self._wrong(SignalError(signal.label, problem, 'Choose columns, or feed one element: "NAME[1]".'))
        try:
            return [self._channel(signal, component, v, i) for i, v in enumerate(variables)]
        except ValueError as error:
            return self._wrong(SignalError(signal.label, f"it feeds {key}: {error}"))

    def _channel(self, signal: Signal, component: str, variable: ScalarVariable, i: int) -> tuple[Channel, Link]:
        """Return one channel and its link; raises ValueError."""
        target = Port(component, variable.name)
        unit = signal.unit if variable.unit is not None else None  # as of a connection: nothing to compare
        conversion = self._parameters.conversion(component, variable, unit)
        order = self._descriptions[component].interpolation_order
        degree = 0 if signal.degree == 0 else 3 if order >= 3 else min(order, 1)
        timing = "signal" if degree else "signal_mean" if signal.degree else "signal_held"
        if variable.type != "Real":
            _refuse_numbers(variable, signal, i)
            timing = "at_point"
        source = Port(Feed(component, ()).name, variable.name)
        link = Link(source, target, timing, conversion, order=degree, fed=True)
        return Channel(target, signal, i, degree), link

    def _wrong(self, mistake: SimulationError) -> list[tuple[Channel, Link]]:
        self.mistakes.append(mistake)
        return []


def _names(variable: str, degree: int) -> list[str]:
    """Return the names of what a channel tells: the value, and the derivatives of v."""
    return [variable, *(polynomial(variable, n) for n in range(degree + 1))]


def polynomial(variable: str, n: int) -> str:
    """Return the name of the n-th derivative of v at the start of a step."""
    return f"{variable} v({n})"


def _refuse_numbers(variable: ScalarVariable, signal: Signal, i: int) -> None:
    """Raise ValueError for a signal whose values a variable that is not Real cannot take."""
    if variable.type == "String":
        raise ValueError("it is String, and takes no number")
    if signal.degree:
        raise ValueError(f'it is {variable.type}: choose interpolation="previous"')
    allowed = {"Boolean": (0, 1), "Enumeration": tuple((variable.items or {}).values())}.get(variable.type)
    for t, value in zip(signal.time, signal.values[:, i], strict=True):
        if value != int(value) or (allowed and value not in allowed):
            raise ValueError(f"it is {variable.type}, the value at {t:.12g} s is {value:g}")


def _on_points(knots: FloatArray, schedule: Schedule) -> FloatArray:
    """Return knots, those at a communication point by a hair exactly there."""
    k = np.clip(np.rint((knots * schedule.denominator - schedule.start) / schedule.step), 0, schedule.steps)
    points = np.minimum(schedule.start + k * schedule.step, schedule.stop) / schedule.denominator
    off = np.abs(points - knots)
    near = off <= min(COVER, 1e-3 * float(schedule.step_size))
    for i in np.flatnonzero(near[:-1] & near[1:] & (points[:-1] == points[1:])):  # of two the nearer one
        near[i + int(off[i + 1] > off[i])] = False
    return np.where(near, points, knots)


def _with_last(signal: Signal, knots: FloatArray, found: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return knots and coefficients, for a `previous` signal with one more piece, which begins at its last sample."""
    if signal.degree:
        return knots, found
    last = np.zeros((1, signal.width, 4))
    last[0, :, 0] = signal.values[-1]
    return np.append(knots, knots[-1] + 1.0), np.concatenate([found, last])


def _whole(port: Port) -> str:
    return str(port).partition("[")[0]
