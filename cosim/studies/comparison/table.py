"""All flights of the comparison, and the table that is made of them."""

import json
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from cosim.errors import ResultExists, UnknownName
from cosim.flights import Locate, Progress
from cosim.results.folder import make_folder, write_text
from cosim.studies import markdown, papers
from cosim.studies.comparison import mission
from cosim.studies.comparison.cell import COLUMNS, INTERRUPTED, Cell, fly
from cosim.studies.comparison.laws import find_controllers, fit
from cosim.studies.comparison.vehicles import find_plants
from cosim.system import Value

HEAD = ("plant", "controller", *COLUMNS, "remark")
Sets = Mapping[str, Mapping[str, Any]]


@dataclass(frozen=True)
class Table:
    """All flights, what was flown, the parameter sets used, and the files written; `planned`: how many were to fly."""

    cells: tuple[Cell, ...]
    clusters: Mapping[str, str]
    parameters: Sets
    files: tuple[Path, ...]
    planned: int
    complete: bool


def compare(
    chosen_plants: Sequence[str],
    chosen_controllers: Sequence[str],
    folder: Path,
    locate: Locate,
    progress: Progress | None = None,
    announce: Callable[[str], None] = lambda _line: None,
    *,
    overwrite: bool = False,
) -> Table:
    """Fly every chosen controller on every chosen plant (none named: all); write `compare.md` and `compare.json`.

    Ctrl-C ends it: the table then has the flights that were finished. Raises `UnknownName` for a plant or a controller
    that there is not, `ResultExists` or `ResultUnwritable` for the folder, before anything is flown.
    """
    files = table, data = folder / "compare.md", folder / "compare.json"
    if not overwrite and any(file.exists() for file in files):
        raise ResultExists(folder)
    _require_published("plant", chosen_plants, papers.PAPERS)  # before anything is built to look at it
    _require_published("controller", chosen_controllers, papers.describe())
    make_folder(folder)
    rows = _chosen("plant", find_plants(locate), chosen_plants)
    columns = _chosen("controller", find_controllers(locate), chosen_controllers)
    used: dict[str, Mapping[str, Any]] = {p.name: _texts(p.vehicle | p.parameters) for p in rows}
    cells: list[Cell] = []
    pairs = [(plant, controller) for plant in rows for controller in columns]
    complete = True
    for plant, controller in pairs:
        announce(f"{controller.name} on {plant.name}")
        try:
            law = fit(controller, plant, locate)
            done = fly(plant, law, locate, progress)
        except KeyboardInterrupt:  # while a flight is set up or measured
            complete = False
            break
        if done.remark == INTERRUPTED:
            complete = False
            break
        used.setdefault(controller.name, _texts(controller.parameters))
        used[f"{controller.name} on {plant.name}"] = _texts(
            {key: value for key, value in law.parameters.items() if controller.parameters.get(key) != value}
        )
        cells.append(done)
    clusters = {plant.name: plant.cluster for plant in rows}
    write_text(table, write_markdown(cells, clusters))
    content = {
        "mission": list(mission.WORDS),
        "clusters": clusters,
        "cells": [asdict(c) for c in cells],
        "parameters": used,
        "slew": _texts(mission.TURN),
        "disturbance": _texts(mission.DISTURBANCE),
    }
    write_text(data, json.dumps(content, indent=2) + "\n")
    return Table(tuple(cells), clusters, used, files, len(pairs), complete)


def write_markdown(cells: Iterable[Cell], clusters: Mapping[str, str]) -> str:
    """Return the mission, the clusters and the table of figures in Markdown."""
    words = [*mission.WORDS, *(f"{name}: {words}" for name, words in clusters.items())]
    return markdown.write_list(words) + "\n" + markdown.write_table(HEAD, map(make_row, cells))


def make_row(cell: Cell) -> tuple[str, ...]:
    """Return a cell of the table as a row of texts under HEAD."""
    figures = [f"{cell.figures[c]:.4g}" if c in cell.figures else "" for c in COLUMNS]
    return (cell.plant, cell.controller, *figures, cell.remark)


def _require_published(kind: str, names: Sequence[str], known: Iterable[str]) -> None:
    for name in names:
        if name not in known:
            raise UnknownName(kind, name, "the papers", list(known))


def _chosen(kind: str, found: Mapping[str, Any], names: Sequence[str]) -> list[Any]:
    for name in names:
        if name not in found:
            raise UnknownName(kind, name, "the papers", list(found))
    return [found[name] for name in names or found]


def _texts(values: Mapping[str, Any]) -> dict[str, Any]:
    """Return values ready for JSON, those with a unit as text."""
    return {k: f"{v.value} {v.unit or ''}".strip() if isinstance(v, Value) else v for k, v in values.items()}
