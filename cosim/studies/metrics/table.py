"""The metrics of several runs in one table: a line a metric, a column a run; blank where a run has no such metric."""

import csv
import io
import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from cosim.errors import UnknownName
from cosim.results.folder import finite
from cosim.results.result import Result, figures
from cosim.studies import markdown
from cosim.studies.metrics.attitude import measure
from cosim.studies.metrics.pointing import THRESHOLD

ABOUT = ("system", "ended")
"""The first lines: what flew, and how it ended."""


@dataclass(frozen=True)
class MetricTable:
    """Metrics of runs by the names of the runs; a metric that was not reached is None."""

    about: Mapping[str, tuple[str, str]]
    metrics: Mapping[str, Mapping[str, Any]]

    @property
    def keys(self) -> list[str]:
        """Metrics that any run has: those of the first run in its order, what others have besides after them."""
        return list(dict.fromkeys(key for found in self.metrics.values() for key in found))

    def lines(self, shown: Callable[[Any], str] = figures) -> Iterator[tuple[str, ...]]:
        """Yield a line a metric: its name, and of each run its value as a text, "" where it has none."""
        for i, word in enumerate(ABOUT):
            yield word, *(words[i] for words in self.about.values())
        for key in self.keys:
            yield key, *(shown(found[key]) if key in found else "" for found in self.metrics.values())

    @property
    def head(self) -> tuple[str, ...]:
        """The heads of the columns."""
        return "metric", *self.metrics

    def write(self, kind: str) -> str:
        """Return the table as csv, markdown or json; raises `UnknownName`."""
        check_format(kind)
        return _WRITERS[kind](self)


def tabulate(runs: Mapping[str, Result], threshold_deg: float | None = None) -> MetricTable:
    """Return the metrics of runs, taken from their rows; `threshold_deg`: None: each run's own, as run.json has it."""
    found = {
        name: {
            key: finite(value)
            for key, value in measure(run, own_threshold(run) if threshold_deg is None else threshold_deg).items()
        }
        for name, run in runs.items()
    }
    return MetricTable({name: (run.info.get("system", ""), _ended(run)) for name, run in runs.items()}, found)


def own_threshold(run: Result) -> float:
    """Return the threshold of settling that a run was measured with, deg."""
    known = run.info.get("metrics", {}).items()
    return next((value for key, value in known if "settling threshold" in key), THRESHOLD)


def check_format(kind: str) -> None:
    """Raise `UnknownName` for a format that a table is not written in."""
    if kind not in FORMATS:
        raise UnknownName("format", kind, "tables of metrics", FORMATS)


def _ended(run: Result) -> str:
    reached = f" at {run.time[-1]:.6g} s" if len(run) else ""
    return f"{run.info.get('status', 'not known')}{reached}"


def _csv(table: MetricTable) -> str:
    """Write numbers with all their digits, each component of an array on a line of its own, "NAME [i]"."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(table.head)
    writer.writerows((word, *(words[i] for words in table.about.values())) for i, word in enumerate(ABOUT))
    for key in table.keys:
        values = [found.get(key, "") for found in table.metrics.values()]
        size = max((len(v) for v in values if isinstance(v, list)), default=0)
        for i in range(max(size, 1)):
            writer.writerow((f"{key} [{i + 1}]" if size else key, *(_cell(v, i) for v in values)))
    return text.getvalue()


def _cell(value: Any, i: int) -> str:
    if isinstance(value, list):
        value = value[i] if i < len(value) else ""
    return "not reached" if value is None else repr(value) if isinstance(value, float) else str(value)


def _markdown(table: MetricTable) -> str:
    return markdown.write_table(table.head, list(table.lines()))


def _json(table: MetricTable) -> str:
    runs = {
        name: {**dict(zip(ABOUT, table.about[name], strict=True)), "metrics": found}
        for name, found in table.metrics.items()
    }
    return json.dumps(runs, indent=2, allow_nan=False) + "\n"


_WRITERS: Mapping[str, Callable[[MetricTable], str]] = {"csv": _csv, "markdown": _markdown, "json": _json}
FORMATS: Sequence[str] = tuple(_WRITERS)
