"""All flights of the comparison, and the table that is made of them."""

import json
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from cosim.errors import ResultExists
from cosim.flights import Locate, Progress
from cosim.results.folder import make_folder, write_text
from cosim.studies import markdown
from cosim.studies.comparison import own
from cosim.studies.comparison.cell import COLUMNS, INTERRUPTED, Cell, fly
from cosim.studies.comparison.laws import fit
from cosim.studies.comparison.mission import Mission
from cosim.studies.comparison.own import Given
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
    mission: Mission


def compare(
    chosen_plants: Sequence[Given],
    chosen_controllers: Sequence[Given],
    folder: Path,
    locate: Locate,
    progress: Progress | None = None,
    announce: Callable[[str], None] = lambda _line: None,
    *,
    mission: Mission | None = None,
    overwrite: bool = False,
) -> Table:
    """Fly every chosen controller on every chosen plant, and write `compare.md` and `compare.json`.

    Plants and controllers: own.py says as what they may be given; none: all of the papers. `mission`: what each flight
    is asked to do, the papers' table's if it is None. `locate`: FMU reference -> path, as `cosim.Library()`.

        from cosim import Library
        from cosim.studies.comparison import Mission, compare
        mission = Mission(slew={"angle": Value(30, "deg"), "axis": [0, 0, 1]}, stop=600)
        table = compare(["zhang2018", my_flight()], ["xiao2011-pid", MyController], Path("out"), Library(),
                        mission=mission)

    Ctrl-C ends it: the table then has the flights that were finished. Raises `UnknownName` or `FmuError` for a name
    that there is not, `ResultExists` or `ResultUnwritable` for the folder, before anything is built, and `Unsuited` for
    an FMU that is no plant or controller, before anything is flown.
    """
    mission = mission or Mission()
    files = table, data = folder / "compare.md", folder / "compare.json"
    if not overwrite and any(file.exists() for file in files):
        raise ResultExists(folder)
    own.check_names("plant", chosen_plants)
    own.check_names("controller", chosen_controllers)
    make_folder(folder)
    rows = own.told_apart(own.plants(chosen_plants, locate))
    columns = own.told_apart(own.controllers(chosen_controllers, locate))
    used: dict[str, Mapping[str, Any]] = {p.name: _texts({**p.vehicle, **p.parameters}) for p in rows}
    cells: list[Cell] = []
    pairs = [(plant, controller) for plant in rows for controller in columns]
    complete = True
    for plant, controller in pairs:
        announce(f"{controller.name} on {plant.name}")
        try:
            law = fit(controller, plant, locate)
            done = fly(plant, law, mission, locate, progress)
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
    write_text(table, write_markdown(cells, clusters, mission))
    content = {
        "mission": list(mission.words),
        "clusters": clusters,
        "cells": [asdict(c) for c in cells],
        "parameters": used,
        "slew": _texts(mission.slew),
        "disturbance": _texts(mission.disturbance),
    }
    write_text(data, json.dumps(content, indent=2) + "\n")
    return Table(tuple(cells), clusters, used, files, len(pairs), complete, mission)


def write_markdown(cells: Iterable[Cell], clusters: Mapping[str, str], mission: Mission) -> str:
    """Return the mission, the clusters and the table of figures in Markdown."""
    words = [*mission.words, *(f"{name}: {words}" for name, words in clusters.items())]
    return markdown.write_list(words) + "\n" + markdown.write_table(HEAD, map(make_row, cells))


def make_row(cell: Cell) -> tuple[str, ...]:
    """Return a cell of the table as a row of texts under HEAD."""
    figures = [f"{cell.figures[c]:.4g}" if c in cell.figures else "" for c in COLUMNS]
    return (cell.plant, cell.controller, *figures, cell.remark)


def _texts(values: Mapping[str, Any]) -> dict[str, Any]:
    """Return values ready for JSON, those with a unit as text."""
    return {k: f"{v.value} {v.unit or ''}".strip() if isinstance(v, Value) else v for k, v in values.items()}
