"""The figures of papers from runs of their experiments, as published or not, over one another.

A paper draws its figures from runs by the names of their experiments, whatever parameters these flew with. A second run
of one experiment, and the published one where it is given, go behind (plots/overlay.py). A run with another FMU than
the paper's is none of its experiment: it has the figures of any run only.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from cosim.errors import UnknownName
from cosim.flights import Locate, Progress, simulate
from cosim.results import runinfo
from cosim.studies.papers.paper import Paper, find_owner, scenario
from cosim.system.expand import wire
from cosim.time import exact_seconds
from fmus.description.names import split_element
from fmus.description.read import read_description

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from cosim.results.result import Result

MOST_NAMED = 4
"""Departures that the title of a figure names."""


@dataclass
class Drawn:
    """Figures by file name, and what is to be said of them."""

    figures: "dict[str, Figure]" = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)


def draw_papers(runs: "Mapping[str, Result]", locate: Locate, published: "Mapping[str, Result] | None" = None) -> Drawn:
    """Return the figures of the papers whose experiments `runs` (by their labels) are.

    `published`: experiment -> its run as published, which is drawn behind.
    """
    drawn = Drawn()
    owners: dict[str, tuple[Paper, dict[str, Result]]] = {}
    for label, run in runs.items():
        owner = find_owner(run.info.get("system", ""))
        if owner is None:
            continue
        if swapped := [swap["instance"] for swap in run.info.get("swaps") or []]:
            drawn.notes.append(f"{label}: no figures of {owner.key}, for another FMU flew as {', '.join(swapped)}")
        else:
            owners.setdefault(owner.key, (owner, {}))[1][label] = run
    for owner, mine in owners.values():
        try:
            figures = _of_paper(owner, mine, locate, published or {}, drawn.notes)
        except UnknownName as error:  # a run that has recorded less than the paper draws
            drawn.notes.append(f"no figures of {owner.key}: {str(error).partition(' There:')[0]}")
            continue
        prefix = f"{owner.key}_" if len(owners) > 1 else ""
        drawn.figures |= {f"{prefix}{name}": figure for name, figure in figures.items()}
    return drawn


def _of_paper(
    owner: Paper, mine: "Mapping[str, Result]", locate: Locate, published: "Mapping[str, Result]", notes: list[str]
) -> "dict[str, Figure]":
    from cosim.studies.plots import marks, overlay

    first: dict[str, str] = {}  # experiment -> the label of its first run
    again: list[str] = []
    for label, run in mine.items():
        if first.setdefault(run.info["system"], label) != label:
            again.append(label)
    runs = {experiment: mine[label] for experiment, label in first.items()}
    figures = owner.draw(runs)
    if len(again) == 1:
        word = again[0]
        behind = owner.draw({**runs, mine[word].info["system"]: mine[word]})
        for name in figures.keys() & behind.keys():
            overlay.overlay(figures[name], behind[name], word)
    elif again:
        shown, others = ", ".join(first.values()), ", ".join(again)
        notes.append(f"the figures of {owner.key} show {shown}, not {others}: of an experiment two runs at most")
    if known := {experiment: run for experiment, run in published.items() if experiment in runs}:
        behind = owner.draw(runs | known)
        for name in figures.keys() & behind.keys():
            overlay.overlay(figures[name], behind[name], "published")
    if changed := list(dict.fromkeys(d for run in runs.values() for d in departures(run, locate))):
        more = f" and {len(changed) - MOST_NAMED} more" if len(changed) > MOST_NAMED else ""
        for figure in figures.values():
            overlay.note(figure, f"not as published: {', '.join(changed[:MOST_NAMED])}{more}")
    return marks.mark(figures, mine)


def departures(run: "Result", locate: Locate) -> list[str]:
    """Return what of a run of a paper's experiment is not as published.

    That is parameters, held inputs, the step, the master, what happens in flight.
    """
    system, experiment = scenario(run.info["system"])
    wiring = wire(system, {name: read_description(_fmu(run, name, r, locate)) for name, r in system.components.items()})
    known = runinfo.values(wiring, wiring.settings) | runinfo.values(wiring, wiring.held)
    flown = {**run.info.get("parameters", {}), **run.info.get("held", {})}
    other = [name for name, v in flown.items() if known.get(name, {}).get("value") != v["value"]]
    found = list(dict.fromkeys(split_element(name)[0] for name in [*other, *(n for n in known if n not in flown)]))
    step = exact_seconds(experiment.communication_step_size, "communication_step_size")
    if run.info.get("communication_step_size", float(step)) != float(step):
        found.append("the step")
    if not _same_master(run.info.get("master", {}), experiment.master):
        found.append("the master")
    happenings = {"events": experiment.events, "faults": experiment.faults}
    found += [name for name, declared in happenings.items() if run.info.get(name) and not declared]
    return found


def _same_master(told: Mapping[str, Any], master: Any) -> bool:
    """Whether run.json tells of a master with these settings; what it writes as a text is not compared."""
    settings = {k: v for k, v in told.items() if k != "name" and isinstance(v, str | bool | int | None)}
    name = told.get("name", type(master).__name__)
    return name == type(master).__name__ and all(getattr(master, k, None) == v for k, v in settings.items())


def _fmu(run: "Result", instance: str, reference: Any, locate: Locate) -> Path:
    """Return the FMU that flew, where it still is, else where it is located."""
    path = run.info.get("components", {}).get(instance, {}).get("path")
    return Path(path) if path and Path(path).is_file() else locate(reference)


def fly_published(
    runs: "Sequence[Result]",
    locate: Locate,
    progress: Progress | None = None,
    announce: Callable[[str], None] = lambda _line: None,
) -> "dict[str, Result]":
    """Fly the experiments of runs as they are published, each up to the last row of its longest run; nothing is kept.

    Runs that are no paper's, or had another FMU, are passed over.
    """
    until: dict[str, float] = {}
    for run in runs:
        name = run.info.get("system", "")
        if find_owner(name) is not None and not run.info.get("swaps"):
            until[name] = max(until.get(name, 0.0), float(run.time[-1]))
    flown: dict[str, Result] = {}
    for name, end in until.items():
        system, experiment = scenario(name)
        stop = min(exact_seconds(end, "time"), exact_seconds(experiment.stop_time, "stop_time"))
        announce(f"{name} as published: flown to {float(stop):g} s, to be drawn behind")
        flown[name] = simulate(system, replace(experiment, stop_time=stop), locate=locate, progress=progress)
    return flown
