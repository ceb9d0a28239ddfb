"""adcs verify: the order and the error of a flight on the terminal."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from cosim.cli import console
from cosim.cli.options import (
    Backend,
    Extrapolation,
    Flown,
    Force,
    Inputs,
    Master,
    MasterTolerance,
    Params,
    Set,
    Step,
    Stop,
    Use,
    reported,
    times,
)
from cosim.time import in_words

if TYPE_CHECKING:
    from cosim.studies.verification import Verification


def verify_(
    name: Flown,
    use: Use = None,
    set_: Set = None,
    params: Params = None,
    stop: Stop = None,
    step: Step = None,
    master: Master = None,
    inputs: Inputs = None,
    extrapolation: Extrapolation = None,
    master_tolerance: MasterTolerance = None,
    limit: Annotated[
        bool, typer.Option("--limit", help="Search the largest step at which the exchange flies the system too.")
    ] = False,
    limit_time: Annotated[str, typer.Option(metavar="TIME", help="Wall time that this search may take.")] = "60s",
    backend: Backend = "native",
    out: Annotated[
        Path | None, typer.Option("--out", "-o", help="Folder for verification.json. Default: none is written.")
    ] = None,
    force: Force = False,
) -> None:
    """Fly a system at its step, a half and a quarter of it: the order of the exchange, and the error of the flight.

    Exit status: 0 compared, 1 interrupted or fewer than two flights came to their end, 2 not begun.
    """
    from cosim.cli import overrides, scenario
    from cosim.cli.library import Library
    from cosim.errors import ResultExists
    from cosim.studies import verification
    from cosim.time import parse_seconds

    with reported():
        if out is not None and (out / verification.FILE).exists() and not force:
            raise ResultExists(out)
        system, experiment = scenario.load(name, *times(stop, step))
        locate = Library(backend, console.note)
        system, _ = overrides.with_changes(system, use or [], params or [], set_ or [], locate, console.write_swap)
        experiment = overrides.with_experiment(
            experiment,
            step,
            stop,
            master=master,
            inputs=inputs,
            extrapolation=extrapolation,
            master_tolerance=master_tolerance,
        )
        search = float(parse_seconds(limit_time, "--limit-time")) if limit else None
        with console.progress(system.name) as progress:
            found = verification.verify(system, experiment, locate=locate, search=search, progress=progress)
        _write(found)
        if out is not None:
            console.write_files([found.write(out)])
    if not found.complete or len(found.compared) < 2:
        raise typer.Exit(1)


def _write(found: "Verification") -> None:
    """Flights, variables and the largest step, a table each."""
    console.write(f"{found.system} by {found.exchange}, {found.stop_time:g} s")
    rows = [
        (in_words(t.step), t.ended, f"{t.wall:.2f} s", f"{t.cpu:.2f} s", f"{t.evaluations:.2f}") for t in found.trials
    ]
    head = ("step", "flight", "loop", "CPU in all", "evaluations a step")
    console.write_table(head, rows, whole=(0, 2, 3, 4))
    if len(found.compared) < 2:
        console.write("fewer than two flights came to their end: nothing to compare. Try a shorter step: --step")
    elif found.variables:
        _write_variables(found)
    if found.limit is not None:
        _write_limit(found)


def _write_variables(found: "Verification") -> None:
    first, second, *third = map(in_words, found.compared)
    finer = f"{second} - {third[0]}" if third else "-"
    head = ("variable", "unit", "largest", f"{first} - {second}", finer, "order", f"error at {first}", "")
    rows = [
        (
            v.where or v.variable, v.unit, _figure(v.largest), _figure(v.coarse), _figure(v.fine),
            "" if v.order is None else f"{v.order:.2f}", _figure(v.error), v.remark,
        )
        for v in found.variables
    ]  # fmt: skip
    console.write("")
    console.write_table(head, rows, whole=(0,))


def _write_limit(found: "Verification") -> None:
    limit = found.limit
    assert limit is not None
    flies = "no step was found that flies" if limit.flies is None else f"{in_words(limit.flies)} flies"
    fails = "" if limit.fails is None else f", {in_words(limit.fails)} does not ({limit.how})"
    remark = f"; {limit.remark}" if limit.remark else ""
    console.write(f"\nlargest step: {flies}{fails}{remark}; {limit.trials} flights")


def _figure(value: float | None) -> str:
    return "" if value is None or value != value else f"{value:.3g}"
