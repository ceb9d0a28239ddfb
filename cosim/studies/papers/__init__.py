"""The published control systems that come with the project: their experiments, claims and figures.

A paper is a module with `TITLE`, `SETTLED`, `systems()`, `CLAIMS` and `figures(results)`; `PAPERS` is the only list of
them.
"""

from collections.abc import Callable, Mapping, Sequence
from typing import Protocol

from matplotlib.figure import Figure

from cosim.errors import UnknownName
from cosim.results.result import Result
from cosim.studies import metrics, plots
from cosim.studies.papers import geng2012, li2014, xiao2011, ye2016, zhang2018
from cosim.studies.papers.claims import Claim, Verdict, judge
from cosim.system.system import Experiment, System

Make = Callable[[], tuple[System, Experiment]]


class Paper(Protocol):
    """What the module of a paper has."""

    @property
    def TITLE(self) -> str:
        """Authors, title, journal, year."""
        ...

    @property
    def SETTLED(self) -> float:
        """The attitude error within which its runs count as settled in their metrics, deg."""
        ...

    @property
    def CLAIMS(self) -> Sequence[Claim]:
        """The claims, in the paper's order."""
        ...

    def systems(self) -> Mapping[str, Make]:
        """Return the experiments by name, `<paper>-<experiment>`."""
        ...

    def figures(self, results: Mapping[str, Result]) -> dict[str, Figure]:
        """Return the paper's figures for which `results` has the runs, by file name."""
        ...


PAPERS: dict[str, Paper] = {
    "zhang2018": zhang2018,
    "xiao2011": xiao2011,
    "ye2016": ye2016,
    "li2014": li2014,
    "geng2012": geng2012,
}


def paper(name: str) -> Paper:
    """Return a paper by its key; raises `UnknownName` with the nearest."""
    if name not in PAPERS:
        raise UnknownName("paper", name, "the list of papers", list(PAPERS))
    return PAPERS[name]


def systems() -> dict[str, Make]:
    """Return the experiments of all papers by name."""
    return {name: make for module in PAPERS.values() for name, make in module.systems().items()}


def scenario(name: str) -> tuple[System, Experiment]:
    """Return a paper's system and experiment; raises `UnknownName` with the nearest."""
    known = systems()
    if name not in known:
        raise UnknownName("system", name, "the papers' experiments", list(known))
    return known[name]()


def titles() -> dict[str, str]:
    """Return the papers' keys and titles."""
    return {name: module.TITLE for name, module in PAPERS.items()}


def descriptions() -> dict[str, str]:
    """Return the systems' names, each with the first line of its docstring."""
    return {name: (make.__doc__ or "").strip().split("\n")[0] for name, make in systems().items()}


def settled(name: str) -> float:
    """Return the threshold of the settling time of a system, deg: that of its paper, or the usual one."""
    owner = _owner(name)
    return metrics.THRESHOLD if owner is None else owner.SETTLED


def verdicts(name: str, result: Result) -> list[Verdict]:
    """Return the verdicts of the claims that one run decides; none if an FMU was swapped: that is not the paper's."""
    owner = _owner(name)
    if owner is None or result.info.get("swaps"):
        return []
    return judge([claim for claim in owner.CLAIMS if set(claim.runs) == {name}], {name: result})


def remark(name: str, result: Result, as_published: bool = True) -> str:
    """Return why a run of a paper's system leaves claims open and what would decide them, "" if there is nothing."""
    owner = _owner(name)
    if owner is None:
        return ""
    key = next(key for key, module in PAPERS.items() if module is owner)
    changed = [f"another FMU for {swap['instance']}" for swap in result.info.get("swaps") or []]
    changed += [] if as_published else ["other parameters, steps or master"]
    if result.info["status"] != "finished":
        return f"claims of {key}: not judged, the run ended early"
    if changed:
        return f"claims of {key}: not judged, for this is not the paper's experiment ({', '.join(changed)})"
    others = [claim for claim in owner.CLAIMS if name in claim.runs and set(claim.runs) != {name}]
    words = "claims" if len(others) > 1 else "claim"
    return f"{len(others)} more {words} of {key}, of several experiments: adcs reproduce {key}" if others else ""


def figures(name: str, result: Result) -> dict[str, Figure]:
    """Return the figures of one run: those of its paper for which it suffices, and those of any attitude run."""
    owner = _owner(name)
    own = {} if owner is None or result.info.get("swaps") else owner.figures({name: result})
    return plots.figures({name: result}) | own


def _owner(name: str) -> Paper | None:
    return next((module for module in PAPERS.values() if name in module.systems()), None)
