"""What acts by its rate must not come in once more as the step mean of that rate.

A body that takes the momentum of a cluster has the cluster's torque in it, minus the rate of that momentum: an input
that is marked so (`RateActs`, annotations.py). The same cluster's step-mean torque (`StepMean`, with what it is `of`)
into another input of the body would count it twice, also on a way through components that add (role "sum").
An FMU without the mark may take both.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from cosim.errors import WiringError
from cosim.system.wiring import Link, Port
from fmus.description.description import ModelDescription
from fmus.description.names import split_element

SUM = "sum"  # the role of a component that adds


@dataclass(frozen=True)
class _Way:
    """From an output over sums to an input."""

    source: Port
    links: tuple[Link, ...]

    def __str__(self) -> str:
        """Write "a.y -> sum.u -> b.u", arrays by their names."""
        first = [str(_whole(link.source)) for link in self.links[:1]]
        return " -> ".join([*first, *(str(_whole(link.target)) for link in self.links)])


def counted_twice(links: Sequence[Link], descriptions: Mapping[str, ModelDescription]) -> list[WiringError]:
    """Return a mistake for each input that takes the step mean of what acts by its rate on another of its component."""
    into = {link.target: link for link in links}
    found: dict[str, WiringError] = {}
    for target, link in into.items():
        body = descriptions[target.component]
        for mean in _ways(link, into, descriptions) if body.rates_act else ():
            means = descriptions[mean.source.component].step_means
            of = Port(mean.source.component, means.get(mean.source.variable, ""))
            for name in body.rates_act:
                acting = into.get(Port(target.component, name))
                for way in _ways(acting, into, descriptions) if acting is not None else ():
                    if way.source == of:
                        error = _mistake(mean, way, target, body)
                        found.setdefault(str(error), error)
    return list(found.values())


def _ways(link: Link, into: Mapping[Port, Link], descriptions: Mapping[str, ModelDescription]) -> Iterator[_Way]:
    """Yield how something comes to the target of a link: from its source, or over the sum that this is an output of."""
    open_ways = [(link,)]
    while open_ways:
        links = open_ways.pop()
        source = links[0].source
        description = descriptions[source.component]
        before = () if description.role != SUM else description.feedthrough(source.variable)
        ahead = [into.get(Port(source.component, name)) for name in before]
        open_ways += [(k, *links) for k in ahead if k is not None and k not in links]
        yield _Way(source, links)


def _mistake(mean: _Way, way: _Way, target: Port, body: ModelDescription) -> WiringError:
    """Return the mistake, which names both ways whole: of arrays it is one."""
    taken, acting, first = _whole(target), _whole(way.links[-1].target), mean.links[0]
    problem = f"{taken} counts what {acting} counts: {mean} is the step mean of the rate of {way}, which acts too"
    ends = _whole(first.source), _whole(first.target)
    advice = f"Remove the connection {ends[0]} -> {ends[1]}"
    if len(mean.links) == 1:
        elements = body.find(taken.variable, "variable", target.component).elements
        value = [0.0] * len(elements) if len(elements) > 1 else 0.0
        advice += f', and hold the input where no other torque takes its place: held={{"{taken}": {value}}}'
    return WiringError(problem, f"{advice}.", (str(ends[0]), str(ends[1])))


def _whole(port: Port) -> Port:
    return Port(port.component, split_element(port.variable)[0])
