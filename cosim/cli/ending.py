"""What a command that flies a system prints of it, and with which status it ends."""

from collections.abc import Callable
from typing import TYPE_CHECKING

import typer

from cosim.cli import console, plotting
from cosim.errors import ResultUnwritable, SimulationError

if TYPE_CHECKING:
    from cosim.cli.library import Library
    from cosim.results.result import Result
    from cosim.system import System

Progress = Callable[[float, float], None]


def fly(
    name: str,
    system: "System",
    flight: "Callable[[Progress], Result]",
    locate: "Library | None",
    as_published: bool,
) -> None:
    """Fly a system with a bar of progress, and tell what came of it; `name`, `locate`, `as_published` see `_tell`.

    Raises what ended the flight early, and `typer.Exit` with status 1 where it was interrupted.
    """
    failure: SimulationError | None = None
    with console.progress(system.name) as progress:
        try:
            result = flight(progress)
        except SimulationError as error:
            if error.result is None:
                raise
            failure, result = error, error.result
    if system.hold_unconnected:
        console.write_held(result, system.held)
    try:
        _tell(name, result, locate, as_published)
    except ResultUnwritable as error:  # the run was flown; what ended it is the first to be told
        failure, error.result = failure or error, result
    if failure is not None:
        raise failure
    if result.info["status"] != "finished":
        raise typer.Exit(1)


def _tell(name: str, result: "Result", locate: "Library | None", as_published: bool) -> None:
    """Print metrics, the claims that this run decides (of the paper's own parameters only), and the files written.

    `locate`: figures are drawn too.
    """
    from cosim.results.names import FILES
    from cosim.studies import papers

    console.write_summary(result)
    own = result.info["status"] == "finished" and as_published
    if own:
        console.write_claims(papers.judge_run(name, result))
    remark = papers.explain_open(name, result, as_published)
    if remark:
        console.write(remark)
    if result.folder is None:
        return
    files = [result.folder / file for file in FILES if (result.folder / file).exists()]
    if locate is not None and len(result) > 1:
        from cosim.studies import plots

        drawn, notes = plotting.draw_runs({result.info["system"]: result}, locate)
        files += plots.save(drawn, result.folder)
        for note in notes:
            console.note(note)
        if not drawn:
            console.note_nothing_drawn()
    console.write_files(files)
