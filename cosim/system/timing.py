"""How an input is carried over a step of its component: what a connection asks for, and what two FMUs can.

With a and b the source's values at both ends of the step of length h, a' and b' its slopes there, s = 0 ... h:

    at_point           a                        extrapolated       a + a' s  (+ a'' s^2 / 2)
    after_step         b                        extrapolated_mean  the mean of that line, held
    midpoint           (a + b) / 2, held        mean               the mean of the cubic, held
    ramp               the line from a to b     smooth             the cubic through a, a', b, b'

A user declares those of `TIMINGS`; a master makes the others of them. What a signal feeds has a timing of its own in
every master: `signal` the polynomial of feeds.py, `signal_mean` and `signal_held` the mean over the step, held, of a
signal that moves and of one that moves in steps.
"""

from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import Literal

from cosim.system.wiring import Link, Port, Wiring
from fmus.description.description import ModelDescription

Timing = Literal["at_point", "after_step", "midpoint", "ramp", "smooth"]
TIMINGS: tuple[Timing, ...] = ("at_point", "after_step", "midpoint", "ramp", "smooth")

CUBIC = 3
"""The order of input derivatives that a smooth input needs."""


def between(wiring: Wiring, link: Link) -> bool:
    """Whether there is anything between two values of a connection: both Real, and the source moves, not in steps."""
    if link.fed:
        return link.timing in ("signal", "signal_mean")
    types = {wiring.variable(link.source).type, wiring.variable(link.target).type}
    return types == {"Real"} and not link.step_mean and not wiring.descriptions[link.source.component].sampled


def carried(link: Link, asked: str, source: ModelDescription, target: ModelDescription) -> Link:
    """Return a connection with the timing that is asked for, or the nearest that both FMUs can.

    A sampled source moves in steps: a smooth connection from it holds what it showed at the start.
    """
    order = target.interpolation_order
    timing = asked
    if asked == "smooth" and source.sampled:
        return replace(link, timing="at_point", asked="")
    if asked == "smooth" and order < CUBIC:
        timing = "ramp" if order else "mean"
    if asked == "ramp" and not order:
        timing = "midpoint"
    return replace(link, timing=timing, asked=asked if timing != asked else "")


def straight(
    taken: Iterable[tuple[Port, str]], descriptions: Mapping[str, ModelDescription]
) -> frozenset[tuple[Port, str]]:
    """Return what step means are of, each with the component that takes the mean: to it, it is a line.

    Its slope is the mean then. A momentum on another curve, beside its mean torque, would not be of one exchange, and
    be lost. `taken`: outputs, each with a component that takes it.
    """
    return frozenset(
        (Port(source.component, of), target)
        for source, target in taken
        if (of := descriptions[source.component].step_means.get(source.variable))
    )


def moving(wiring: Wiring, asked: str) -> Wiring:
    """Return a wiring whose inputs are carried as asked, where there is anything between two of their values.

    Those that need no more than the start of a step, and step means, stay as they are.
    """
    lines = straight(((k.source, k.target.component) for k in wiring.links if k.step_mean), wiring.descriptions)

    def carry(link: Link) -> Link:
        if link.fed or link.from_start or not between(wiring, link):
            return link
        line = asked == "smooth" and (link.source, link.target.component) in lines
        ends = (wiring.descriptions[port.component] for port in (link.source, link.target))
        return carried(link, "ramp" if line else asked, *ends)

    return replace(wiring, links=tuple(carry(link) for link in wiring.links))


def extrapolated(link: Link, target: ModelDescription) -> Link:
    """Return an at_point connection that follows the source's slope; see `limited`."""
    return replace(link, timing="extrapolated" if target.interpolation_order else "extrapolated_mean")


def limited(link: Link, order: int, told: int, target: ModelDescription) -> Link:
    """Return an extrapolated connection with the order that both FMUs can; `told`: up to which its slopes are told.

    Where none is told, differences give the first.
    """
    possible = min(order, max(told, 1), max(target.interpolation_order, 1))
    weaker = possible < order or link.timing == "extrapolated_mean"
    return replace(link, order=possible, asked=f"extrapolation {order}" if weaker else "")


def remarks(wiring: Wiring) -> list[str]:
    """Return a line for each pair of components between which inputs are carried more weakly than asked for."""
    pairs = dict.fromkeys(
        (link.source.component, link.target.component, link.asked, link.timing, link.order) for link in _weaker(wiring)
    )
    return [_remark(*pair) for pair in pairs]


def _weaker(wiring: Wiring) -> Iterable[Link]:
    return (link for link in wiring.links if link.asked)


def _remark(source: str, target: str, asked: str, timing: str, order: int) -> str:
    cannot = f"{target} cannot interpolate its inputs (canInterpolateInputs=false)"
    held = {
        "midpoint": f"{cannot}, and is given the middle of the line, held over each step",
        "mean": f"{cannot}, and is given the mean of the curve, held over each step",
        "extrapolated_mean": f"{cannot}, and is given the mean of the line, held over each step",
        "ramp": f"{target} does not say that it takes input derivatives of order {CUBIC}, and is given a line",
        "extrapolated": f"the two FMUs know derivatives of order {order} only",
    }
    return f"{source} -> {target} is weaker than asked for ({asked}): {held[timing]}"
