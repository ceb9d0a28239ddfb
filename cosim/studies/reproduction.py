"""Every experiment of the papers, their claims judged, their figures drawn, and one report of all.

`folder/<paper>/<experiment>/` has the runs, `folder/<paper>/` the paper's figures, and `folder/` the report.
"""

import json
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from cosim.errors import SimulationError
from cosim.flights import Locate, Progress, simulate
from cosim.results.folder import make_folder, write_text
from cosim.results.result import Result
from cosim.results.story import refuse_existing
from cosim.studies import markdown, metrics, papers, plots
from cosim.studies.papers.claims import Verdict, judge

PREFACE = (
    "Of the attitude error, from `plant.q_BN` and `guidance.q_RN`: the settling time is the last time at which a "
    "component is above the threshold, after a slew that time less its end; APE (absolute performance error) and RPE "
    "(relative performance error, over 10 s) are those of ECSS-E-ST-60-10C after it, or over the last half where it is "
    "not reached. Of three axes the largest counts. Each run's `run.json` has them all, axis by axis."
)
HEAD = ("paper", "claim", "paper says", "measured", "verdict", "what fails", "depends on", "criterion")
COLUMNS = {  # heads of the table of metrics -> keys of metrics.measure; of an array the largest element counts
    "settled below (deg)": "settling threshold, largest component (deg)",
    "settling time (s)": "settling time (s)",
    "APE max (deg)": "APE max (deg)",
    "APE 95 % (deg)": "APE 95 % (deg)",
    "APE 99.7 % (deg)": "APE 99.7 % (deg)",
    "RPE max (deg)": "RPE max (deg)",
    "peak torque (N.m)": "peak torque (N.m)",
    "torque impulse (N.m.s)": "torque impulse (N.m.s)",
    "peak wheel momentum (N.m.s)": "peak wheel momentum (N.m.s)",
    "peak wheel speed (rad/s)": "peak wheel speed (rad/s)",
    "peak eta (kg^(1/2).m)": "peak modal coordinate (kg^(1/2).m)",
    "momentum drift (N.m.s)": "momentum drift (N.m.s)",
}
BRIEF = ("settled below (deg)", "settling time (s)", "APE max (deg)", "peak torque (N.m)", "momentum drift (N.m.s)")


@dataclass(frozen=True)
class Report:
    """What reproducing papers gave: verdicts in the papers' order, results by experiment, files written.

    `planned` is how many experiments there were to fly, `titles` are those of the figures by paper and file name,
    `failure` is what ended the flights, if something did.
    """

    verdicts: tuple[Verdict, ...]
    results: dict[str, Result]
    files: tuple[Path, ...]
    planned: int
    titles: Mapping[str, Mapping[str, str]]
    failure: SimulationError | None = None

    @property
    def flown(self) -> int:
        """How many experiments flew to their end."""
        return sum(run.info["status"] == "finished" for run in self.results.values())

    @property
    def complete(self) -> bool:
        """Whether every experiment flew to its end; Ctrl-C or a failure ends the last one, and with it the flights."""
        return self.failure is None and self.flown == self.planned


def reproduce(
    names: Sequence[str],
    folder: Path,
    locate: Locate | None = None,
    progress: Progress | None = None,
    announce: Callable[[str], None] = lambda _line: None,
    *,
    overwrite: bool = False,
) -> Report:
    """Fly all experiments of papers, judge and draw; write `report.md`, `claims.json` and `metrics.json` too.

    Raises `UnknownName` for a paper that there is not, `ResultExists` before anything is flown. An experiment that
    fails, or Ctrl-C, ends the flights: the report has what was flown, claims that lack runs are "not judged".
    """
    chosen = {name: papers.find(name) for name in names}
    if not overwrite:
        for name, paper in chosen.items():
            for experiment in paper.experiments:
                refuse_existing(folder / name / experiment)
    make_folder(folder)
    results: dict[str, Result] = {}
    failure: SimulationError | None = None
    interrupted = False
    for name, paper in chosen.items():
        for experiment in paper.experiments:
            if failure is None and not interrupted:
                announce(experiment)
                try:
                    results[experiment] = simulate(
                        *paper.make(experiment),
                        out=folder / name / experiment,
                        locate=locate,
                        progress=progress,
                        overwrite=overwrite,
                        metrics=partial(metrics.measure, threshold_deg=paper.settled),
                    )
                    interrupted = results[experiment].info["status"] != "finished"
                except KeyboardInterrupt:  # between two runs, or while one is set up
                    interrupted = True
                except SimulationError as error:
                    failure = error
                    if error.result is not None:
                        results[experiment] = error.result
    finished = {name: run for name, run in results.items() if run.info["status"] == "finished"}
    verdicts = tuple(v for paper in chosen.values() for v in judge(paper.claims, finished))
    figures = {name: paper.draw(finished) for name, paper in chosen.items()}
    titles = {name: {n: figure.get_suptitle() for n, figure in own.items()} for name, own in figures.items()}
    drawn = {name: plots.save(own, folder / name) for name, own in figures.items()}
    files = _written(folder, verdicts, results, drawn)
    drawings = [path for paths in drawn.values() for path in paths]
    planned = sum(len(paper.experiments) for paper in chosen.values())
    return Report(verdicts, results, (*files, *drawings), planned, titles, failure)


def _written(
    folder: Path, verdicts: Sequence[Verdict], results: Mapping[str, Result], drawn: Mapping[str, Sequence[Path]]
) -> tuple[Path, ...]:
    """Write the report, and claims and metrics for machines; return the files."""
    report, claims, numbers = folder / "report.md", folder / "claims.json", folder / "metrics.json"
    parts = [
        "# What holds of the papers\n",
        "## Claims\n",
        _claims(v for v in verdicts if not v.beyond),
        "## Beyond the papers\n",
        "What no paper claims, and a reader would ask next.\n",
        _claims(v for v in verdicts if v.beyond),
        "## Metrics of every run\n",
        f"{PREFACE}\n",
        markdown.write_table(("experiment", *COLUMNS, "ended"), map(list, metrics_rows(results))),
        *(_gallery(name, [path.relative_to(folder) for path in paths]) for name, paths in drawn.items()),
    ]
    write_text(report, "\n".join(parts))
    write_text(claims, json.dumps([v.row() for v in verdicts], indent=2) + "\n")
    known = {name: run.info.get("metrics", {}) for name, run in results.items()}
    write_text(numbers, json.dumps(known, indent=2) + "\n")
    return report, claims, numbers


def _claims(verdicts: Iterable[Verdict]) -> str:
    rows = ([v.paper, v.claim, v.said, v.measured, v.word, v.failing, v.depends, v.criterion] for v in verdicts)
    return markdown.write_table(HEAD, rows)


def metrics_rows(results: Mapping[str, Result], columns: Sequence[str] = tuple(COLUMNS)) -> Iterator[tuple[str, ...]]:
    """Return a row an experiment: its name, its metrics under some of COLUMNS, and how it ended."""
    for name, run in results.items():
        known = run.info.get("metrics", {})
        event = run.info.get("event")
        end = f"{event['variable']} at {event['time']:g} s" if event else run.info["status"]
        yield (name, *(_figure(known[key]) if key in known else "" for key in map(COLUMNS.__getitem__, columns)), end)


def _figure(value: Any) -> str:
    if value is None:
        return "not reached"
    return f"{max(value) if isinstance(value, list) else value:.3g}"


def _gallery(name: str, paths: Sequence[Path]) -> str:
    """Return the figures of a paper as Markdown."""
    pictures = "".join(f"![{path.stem}]({path.as_posix()})\n\n" for path in paths)
    return f"## Figures of {name}: {papers.find(name).title}\n\n{pictures}" if pictures else ""
