"""What one run of a paper's experiment shows: the claims that it decides, what it leaves open, its figures."""

from typing import TYPE_CHECKING

from cosim.studies.papers.paper import find_owner

if TYPE_CHECKING:  # a run that is not judged or drawn imports nothing that does
    from matplotlib.figure import Figure

    from cosim.results.result import Result
    from cosim.studies.papers.claims import Claim, Verdict


def judge_run(name: str, result: "Result") -> "list[Verdict]":
    """Return the verdicts of the claims that one run decides; none if an FMU was swapped: that is not the paper's."""
    owner = find_owner(name)
    if owner is None or result.info.get("swaps"):
        return []
    from cosim.studies.papers.claims import judge

    return judge(list(filter(None, (_decided(claim, name) for claim in owner.claims))), {name: result})


def explain_open(name: str, result: "Result", as_published: bool = True) -> str:
    """Return why a run of a paper's system leaves claims open and what would decide them, "" if there is nothing."""
    owner = find_owner(name)
    if owner is None:
        return ""
    changed = [f"another FMU for {swap['instance']}" for swap in result.info.get("swaps") or []]
    changed += [] if as_published else ["other parameters, steps or master"]
    if result.info["status"] != "finished":
        return f"claims of {owner.key}: not judged, the run ended early"
    if changed:
        return f"claims of {owner.key}: not judged, for this is not the paper's experiment ({', '.join(changed)})"
    others = [claim for claim in owner.claims if name in claim.runs and _decided(claim, name) is None]
    words = "claims" if len(others) > 1 else "claim"
    if not others:
        return ""
    return f"{len(others)} more {words} of {owner.key}, of several experiments: adcs reproduce {owner.key}"


def _decided(claim: "Claim", name: str) -> "Claim | None":
    """Return the claim, in all its readings or in one alone, as one run decides it; None if it takes others."""
    return next((c for c in (claim, *claim.alone) if set(c.runs) == {name}), None)


def draw_run(name: str, result: "Result") -> "dict[str, Figure]":
    """Return the figures of one run as published: its paper's for which it suffices, and those of any attitude run."""
    from cosim.studies import plots

    owner = find_owner(name)
    own = {} if owner is None or result.info.get("swaps") else owner.draw({name: result})
    return plots.draw({name: result}) | own
