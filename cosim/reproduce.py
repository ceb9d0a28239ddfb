"""Every experiment of a paper, its claims judged and its figures drawn."""

import json
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

from cosim import metrics, papers, plots
from cosim.papers.claims import Verdict, judge
from cosim.result import Result
from cosim.simulate import Progress, refuse_existing, simulate

HEAD = ("paper", "claim", "paper says", "measured", "verdict", "criterion")


@dataclass(frozen=True)
class Report:
    """What reproducing a paper gave: verdicts in the paper's order, results by experiment, files written."""

    verdicts: tuple[Verdict, ...]
    results: dict[str, Result]
    files: tuple[Path, ...]

    @property
    def complete(self) -> bool:
        """Whether every experiment flew to its end; Ctrl-C ends the last one, and with it the report, early."""
        return all(result.info["status"] == "finished" for result in self.results.values())


def paper(
    name: str,
    folder: Path,
    locate: Callable[[str], Path] | None = None,
    progress: Progress | None = None,
    *,
    overwrite: bool = False,
) -> Report:
    """Fly all experiments of a paper into `folder/<experiment>`, write `claims.md`, `claims.json` and the figures.

    Raises what `simulate` raises; an experiment that fails stops here, its rows are in its folder. After Ctrl-C the
    claims that lack runs are "not judged".
    """
    chosen = papers.paper(name)
    if not overwrite:
        for experiment in chosen.systems():
            refuse_existing(folder / experiment)
    results: dict[str, Result] = {}
    for experiment, make in chosen.systems().items():
        system, settings = make()
        results[experiment] = simulate(
            system,
            settings,
            out=folder / experiment,
            locate=locate,
            progress=progress,
            overwrite=overwrite,
            metrics=metrics.attitude,
        )
        if results[experiment].info["status"] != "finished":
            break
    verdicts = tuple(judge(chosen.CLAIMS, results))
    table, data = folder / "claims.md", folder / "claims.json"
    table.write_text(markdown(verdicts), encoding="utf-8")
    data.write_text(json.dumps([asdict(v) for v in verdicts], indent=2) + "\n", encoding="utf-8")
    drawn = plots.save(chosen.figures(results), folder)
    return Report(verdicts, results, (table, data, *drawn))


def markdown(verdicts: Sequence[Verdict]) -> str:
    """Return the claims as a Markdown table."""
    rows = [(v.paper, v.claim, v.said, v.measured, v.verdict, v.criterion) for v in verdicts]
    lines = [" | ".join(cell.replace("|", "\\|") for cell in row) for row in (HEAD, ("---",) * len(HEAD), *rows)]
    return "".join(f"| {line} |\n" for line in lines)
