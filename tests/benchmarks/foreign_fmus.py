"""Other people's FMUs, flown here and in fmpy with the same steps and tolerance: one line each, and totals by exporter.

    python tests/benchmarks/foreign_fmus.py FOLDER [--timeout 60] [--out survey.md] [--references] [--only TEXT]

Each flight has a process of its own and a time limit, so that a crash costs one line. A flight is the FMU's
DefaultExperiment (1 s where there is none) in at most 1000 steps, inputs at their start values. Outcomes:

    same          equal bits in every row
    differs       how much, of each variable's largest value, and the cause, found by flights in fmpy that change one
                  thing: its times, its inputs, nothing at all
    refused       fmpy flies it, this project does not, with its words
    more          this project flies it, fmpy does not
    both refuse   with the words of each

`--references` compares with NAME_ref.csv or NAME_out.csv beside an FMU instead of fmpy.
"""

import argparse
import hashlib
import multiprocessing
import os
import pickle
import signal
import sys
import tempfile
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import fmpy

sys.path[:0] = [str(Path(__file__).parent / "foreign"), str(Path(__file__).parents[2])]

from differing import cause, difference  # noqa: E402 (the folder is not a package)
from flights import Columns, by_fmpy, opened, ours, words  # noqa: E402
from references import against_reference  # noqa: E402
from setup import Setup, described, exporter, setup  # noqa: E402

ENDLESS = "no end after"

_FORK = multiprocessing.get_context("fork")


@dataclass(frozen=True)
class Flown:
    """What became of a flight: columns, or why there are none."""

    columns: Columns | None = None
    why: str = ""


def apart(timeout: float, do: Callable[..., Any], *told: Any, **more: Any) -> Flown:
    """Call a function in a process of its own and return what became of it."""
    with tempfile.TemporaryDirectory() as folder:
        answer = Path(folder, "answer")

        def work() -> None:
            os.setsid()
            said = os.open(Path(folder, "said"), os.O_CREAT | os.O_WRONLY)
            os.dup2(said, 1)
            os.dup2(said, 2)
            try:
                found = Flown(do(*told, **more))
            except BaseException as error:
                found = Flown(why=words(error))
            answer.write_bytes(pickle.dumps(found))
            os._exit(0)  # what unloading an FMU does is not asked here

        child = _FORK.Process(target=work)
        child.start()
        child.join(timeout)
        if child.is_alive():
            os.killpg(child.pid, signal.SIGKILL)
            child.join()
            return Flown(why=f"{ENDLESS} {timeout:g} s")
        if answer.exists():
            return pickle.loads(answer.read_bytes())
        lines = Path(folder, "said").read_text(errors="replace").strip().splitlines()
        code = child.exitcode or 0
        how = signal.Signals(-code).name if code < 0 else f"exit({code})"
        return Flown(why=f"the process ended by {how}: {lines[-1] if lines else 'no word'}")


@dataclass(frozen=True)
class Line:
    """One FMU of the survey."""

    file: str
    exporter: str
    version: str
    outcome: str
    cause: str = ""


def surveyed(path: Path, name: str, timeout: float) -> Line:
    """Fly an FMU on both sides and say how they compare."""
    try:
        about = described(path)
        kind = "CS" if about.coSimulation is not None else "ME"
        head = name, exporter(about), f"{about.fmiVersion} {kind}"
    except Exception as error:
        head = name, "not readable", "-"
        told = Setup(0.0, 0.01, tuple(k / 100 for k in range(101)), None, ())
        here = apart(timeout, ours, path, told)
        both = f"here: {here.why}; fmpy: {words(error)}"
        return Line(*head, "more" if here.columns is not None else "both refuse", both)
    there = offered(path)
    if fmpy.platform not in there and "c-code" not in there:
        why = apart(timeout, opened, path).why
        return Line(*head, "other platform", f"{', '.join(there) or 'no binary'}; here: {why}")
    try:
        told = setup(path)
    except Exception as error:
        return Line(*head, "no setup", words(error))
    here, there = apart(timeout, ours, path, told), apart(timeout, by_fmpy, path, told)
    lenient = None
    if there.columns is None and not there.why.startswith(ENDLESS):
        lenient = apart(timeout, by_fmpy, path, told, validate=False)
    if here.columns is None:
        if there.columns is not None:
            return Line(*head, "refused", here.why)
        unvalidated = " (it flies it unvalidated)" if lenient is not None and lenient.columns is not None else ""
        return Line(*head, "both refuse", f"here: {here.why}; fmpy{unvalidated}: {there.why}")
    if lenient is not None and lenient.columns is not None:
        there = lenient
    if there.columns is None:
        return Line(*head, "more", f"fmpy: {there.why}")
    validate = lenient is None
    found = difference(here.columns, there.columns, told)
    if not found:
        return Line(*head, "same", f"{len(here.columns) - 1} columns, {len(here.columns['time'])} rows")

    def again(**changes: Any) -> Columns | None:
        return apart(timeout, by_fmpy, path, told, validate=validate, **changes).columns

    def both(other: Setup) -> tuple[Columns | None, Columns | None]:
        mine, theirs = apart(timeout, ours, path, other), apart(timeout, by_fmpy, path, other, validate=validate)
        return mine.columns, theirs.columns

    return Line(*head, *cause(found, here.columns, again, both, told, kind))


def unique(folder: Path) -> Iterator[tuple[Path, str]]:
    """FMU files with names to show; of equal files one; those first that have a binary for this platform."""
    seen: dict[bytes, Path] = {}
    for path in sorted(folder.rglob("*.fmu")):
        seen.setdefault(hashlib.sha256(path.read_bytes()).digest(), path)
    for path in sorted(seen.values(), key=lambda path: fmpy.platform not in offered(path)):
        yield path, str(path.relative_to(folder))


def offered(path: Path) -> list[str]:
    """The platforms of an FMU's binaries, "c-code" for sources."""
    try:
        return fmpy.supported_platforms(str(path))
    except Exception:  # no archive, or a broken one
        return []


def report(lines: list[Line], out: Path | None) -> None:
    """Print totals by exporter; write all as Markdown where a file is given."""
    outcomes = sorted({line.outcome for line in lines})
    totals = [("exporter", "FMUs", *outcomes)]
    for tool in sorted({line.exporter for line in lines}):
        found = Counter(line.outcome for line in lines if line.exporter == tool)
        totals.append((tool, str(found.total()), *(str(found[o] or "") for o in outcomes)))
    found = Counter(line.outcome for line in lines)
    totals.append(("all", str(found.total()), *(str(found[o]) for o in outcomes)))
    for row in totals:
        print("  ".join(f"{word:<12}" for word in row))
    if out is not None:
        rows = [("FMU", "exporter", "FMI", "outcome", "cause"), *(tuple(vars(line).values()) for line in lines)]
        out.write_text(_markdown(totals) + "\n" + _markdown(rows), encoding="utf-8")


def _markdown(rows: list[tuple[str, ...]]) -> str:
    head, *rest = [[word.replace("|", "\\|") for word in row] for row in rows]
    return "".join(f"| {' | '.join(row)} |\n" for row in (head, ["---"] * len(head), *rest))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("--timeout", type=float, default=60.0, help="seconds a flight may take")
    parser.add_argument("--out", type=Path, help="Markdown file of the list")
    parser.add_argument("--only", default="", help="FMUs whose path has this text")
    parser.add_argument("--references", action="store_true", help="compare with the CSV beside each FMU")
    told = parser.parse_args()
    lines: list[Line] = []
    for path, name in unique(told.folder):
        if told.only not in name:
            continue
        if told.references:
            outcome, why = against_reference(path, partial(apart, told.timeout, ours, path))
            about = described(path)
            lines.append(Line(name, exporter(about), about.fmiVersion, outcome, why))
        else:
            lines.append(surveyed(path, name, told.timeout))
        print(" | ".join(vars(lines[-1]).values()), flush=True)
    report(lines, told.out)


if __name__ == "__main__":
    main()
