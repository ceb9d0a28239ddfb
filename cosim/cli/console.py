"""What the command line prints: tables to standard output, notes, progress and errors to standard error."""

import json
import sys
from collections.abc import Callable, Generator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rich.box import Box
from rich.console import Console
from rich.markup import escape
from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn
from rich.table import Table

from cosim.errors import near, quoted
from fmus.description.names import split_element

if TYPE_CHECKING:  # a message must not wait for what flies and draws
    from cosim.results.result import Result
    from cosim.studies.papers.claims import Verdict
    from cosim.system.swap import SwapReport

LONG = 100
"""Characters of a value that are printed."""

MOST = 3
"""Values of an event that are printed; of an array each element is one."""

WIDTH = 120
"""Characters of a table that goes to a file."""

RULED = Box("    \n    \n -- \n    \n -- \n -- \n    \n    \n")
"""Columns between blanks, a line under the head and between groups."""

_out = Console(soft_wrap=True, highlight=False, width=None if sys.stdout.isatty() else WIDTH)
_err = Console(stderr=True, soft_wrap=True, highlight=False)


def width() -> int:
    """Return how many characters a line of standard output has."""
    return _out.width


def note(line: str) -> None:
    """One line of what is going on."""
    _err.print(line, style="dim", markup=False)


def write_error(problem: Exception) -> None:
    """What went wrong, as its class and its text."""
    _err.print(f"{type(problem).__name__}: {problem}", style="red", markup=False)


def write(text: str) -> None:
    """Text as it is."""
    _out.print(text, markup=False)


def write_listing(title: str, entries: Mapping[str, str]) -> None:
    """Names with one line each."""
    width = max(map(len, entries), default=0)
    write("\n".join([f"{title}:", *(f"  {name:{width}}  {text}" for name, text in entries.items()), ""]))


@contextmanager
def progress(title: str) -> Generator[Callable[[float, float], None]]:
    """Show a bar of simulated time; yields a function of (time, stop time), both in s."""
    columns = (TextColumn("{task.description}"), BarColumn(), TextColumn("{task.fields[now]}"), TimeRemainingColumn())
    with Progress(*columns, console=_err, transient=True, disable=not _err.is_terminal) as bar:
        task = bar.add_task(title, total=None, now="")

        def show(t: float, stop: float) -> None:
            bar.update(task, completed=t, total=stop, now=f"{t:.1f} of {stop:g} s")

        yield show


def write_swap(report: "SwapReport") -> None:
    """What replacing the FMU of an instance kept, dropped and added."""
    write("\n".join(_swap_lines(report)))


def note_swap(report: "SwapReport") -> None:
    """The same to standard error, for a command whose output is paths."""
    note("\n".join(_swap_lines(report)))


def _swap_lines(report: "SwapReport") -> Generator[str]:
    yield f"{report.instance} = {report.reference}"
    for word, entries in (("kept", report.kept), ("dropped", report.dropped), ("added", report.added)):
        yield from (f"  {word:8}{entry}" for entry in entries)


def write_summary(result: "Result") -> None:
    """How a run ended, how long it took, whether its controller left its domain, and its metrics."""
    from cosim.results.result import figures
    from cosim.studies.metrics import (
        not_measured,
        out_of_domain,
    )  # here, for a message must not wait for what it imports

    info = result.info
    wall = info["wall_time"]
    end = f"{result.time[-1]:g} s simulated" if len(result) else "nothing simulated"
    _out.print(f"{info['status']}: {end}, {wall['loop']:.2f} s in the loop, {len(result)} rows recorded", markup=False)
    if info.get("event"):
        write(event(info["event"]))
    for line in happened(info):
        write(line)
    if info["last_step"] < info["communication_step_size"]:
        span = info["stop_time"] - info["start_time"]
        write(f"the last step is {info['last_step']:g} s: {span:g} s are no multiple of the step")
    if not result.names:
        write(
            "only the time was recorded: no FMU has an input or output; name other variables in Experiment(record=...)"
        )
    for line in (*(said(info) if info["status"] != "failed" else ()), *returned(info)):
        write(line)
    if outside := out_of_domain(result):
        write(f"the controller was {outside}")
    if missing := not_measured(result):
        write(f"not measured: {missing}")
    metrics: Mapping[str, object] = info.get("metrics") or {}
    write_table((), [(name, figures(value)) for name, value in metrics.items()])


def happened(info: Mapping[str, Any]) -> Sequence[str]:
    """Return a line for each event and each fault of a run."""
    lines: list[str] = []
    for change in info.get("events", ()):
        values = [f"{name} = {v['value']} {v['unit'] or ''}".rstrip() for name, v in change["values"].items()]
        more = f" and {len(values) - MOST} more" if len(values) > MOST else ""
        lines.append(f"event: at {change['time']:.12g} s {', '.join(values[:MOST])}{more}")
    return [*lines, *(f"fault: {fault['words']}" for fault in info.get("faults", ()))]


def event(happened: Mapping[str, Any]) -> str:
    """Return the event that ended a run in words."""
    return f"ended by {happened['variable']} at {happened['time']:g} s: {happened['meaning']}"


def said(info: Mapping[str, Any]) -> Generator[str]:
    """Yield the first message of each FMU of a run, with how often it came."""
    for name, texts in info.get("messages", {}).items():
        (first, count), *others = texts.items()
        times = f" ({count} times)" if count > 1 else ""
        more = f"; {len(others)} more in run.json" if others else ""
        yield f"{name} says: {first}{times}{more}"


def returned(info: Mapping[str, Any]) -> Generator[str]:
    """Yield which calls returned fmi2Warning, how often and when first, and which FMUs did not terminate well."""
    for name, functions in info.get("fmi2Warning", {}).items():
        for function, warned in functions.items():
            times = f"{warned['count']} times, first" if warned["count"] > 1 else "once,"
            yield f"{name}: {function} returned fmi2Warning {times} at communication point {warned['first']} s"
    for name, end in info.get("fmi2Terminate", {}).items():
        yield f"{name}: fmi2Terminate returned {end['status']}, after the last row{quoted(end['messages'])}"


def write_held(result: "Result", named: Mapping[str, object]) -> None:
    """The inputs that were held at their start values, for nothing was connected to them."""
    taken = {n: v for n, v in result.info["held"].items() if not {n, split_element(n)[0]} & named.keys()}
    if taken:
        write("held at start values: " + ", ".join(f"{name} = {held['value']}" for name, held in taken.items()))


def write_claims(verdicts: "Sequence[Verdict]") -> None:
    """The claims beside what was measured, in one table; of those not judged only why."""
    judged = [v for v in verdicts if v.verdict != "not judged"]
    head = ("paper", "claim", "paper says", "measured", "verdict", "what fails")
    write_table(head, [(v.paper, v.claim, v.said, v.measured, v.word, v.failing) for v in judged], grouped=True)
    for paper, why in dict.fromkeys((v.paper, v.measured) for v in verdicts if v not in judged):
        count = sum((v.paper, v.measured) == (paper, why) for v in verdicts if v not in judged)
        write(f"{count} claim{'s' if count > 1 else ''} of {paper} not judged: {why}")


def write_table(
    head: Sequence[str], rows: Sequence[Sequence[str]], *, whole: Sequence[int] = (), grouped: bool = False
) -> None:
    """Rows of texts under a head, if it has one; nothing without rows.

    A text that is too long for the screen goes on below, except in the columns `whole`. Grouped: a line where the first
    text changes.
    """
    if not rows:
        return
    shown = Table(*head, show_header=bool(head), box=RULED, show_edge=False, pad_edge=False, padding=(0, 1, 0, 0))
    for index in whole:
        shown.columns[index].no_wrap = True
    firsts = [row[0] for row in rows]
    for row, following in zip(rows, [*firsts[1:], firsts[-1]], strict=True):
        shown.add_row(*map(escape, row), end_section=grouped and row[0] != following)
    _out.print(shown)


def write_parameters(sets: Mapping[str, Mapping[str, object]]) -> None:
    """Parameter sets by name; of long arrays only the beginning."""
    for name, values in sets.items():
        write(f"{name}:" if values else f"{name}: as published")
        for key, value in values.items():
            text = json.dumps(value)
            write(f"  {key} = {text if len(text) <= LONG else f'{text[:LONG]} ...'}")


def note_nothing_drawn() -> None:
    """What figures would need."""
    note("no figures: they show plant.q_BN, plant.omega_BN_B, plant.tau_B, plant.eta and guidance.q_RN, none is here")


def write_files(paths: Sequence[Path]) -> None:
    """Files that were written."""
    for path in paths:
        _out.print(f"wrote {near(path)}", markup=False)
