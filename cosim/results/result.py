"""What a run leaves: rows by name, units, and the story of the run."""

import json
from collections.abc import Callable, Mapping, Sequence
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from cosim.errors import UnknownName
from cosim.results import formats
from cosim.results.folder import finite
from cosim.results.schema import TYPES, items_of, to_numpy, unit_of
from cosim.results.story import read_info
from fmus.description import html
from fmus.description.names import Group, canonical, group

if TYPE_CHECKING:
    import pandas as pd

Judge = Callable[["Result"], Mapping[str, Any]]
"""What makes metrics of a result."""


class Result:
    """Rows of a run: `result["plant.q_BN"]` has shape (n, 4), a scalar (n,), a matrix (n, rows, columns).

    Each column has its variable's type. `info` is the content of run.json, `folder` where the files are (None:
    nowhere), `units` of the columns, `items` the literals of enumerations with their numbers.
    """

    def __init__(
        self, table: pa.Table, info: Mapping[str, Any], folder: Path | None = None, judge: "Judge | None" = None
    ) -> None:
        self.table = table
        self.info = dict(info)
        self.folder = folder
        self._judge = judge

    @property
    def metrics(self) -> dict[str, Any]:
        """Metrics by name, those of run.json, made when they are first asked for where nothing was written."""
        if "metrics" not in self.info and self._judge is not None:
            self.info["metrics"] = {key: finite(value) for key, value in self._judge(self).items()}
        return self.info.get("metrics", {})

    @classmethod
    def read(cls, folder: Path | str) -> "Result":
        """Read parquet, csv, mat, or the stream of a run that was killed; raises `ResultUnreadable`.

        The status is "running" only where the process may still live; one that has died is "died".
        """
        folder = Path(folder)
        info = read_info(folder)
        types = {name: TYPES[kind] for name, kind in info.get("types", {}).items()}
        table = formats.read(folder, types)
        units, items = {"time": "s"} | info.get("units", {}), info.get("items", {})
        fields = [f.with_metadata(_metadata(f, units.get(f.name), items.get(f.name))) for f in table.schema]
        return cls(pa.Table.from_arrays(table.columns, schema=pa.schema(fields)), info, folder)

    def __repr__(self) -> str:
        """System, how it ended, how much was recorded, where it is."""
        return f"<Result of {self._told()}>"

    def _told(self) -> str:
        rows = f"{html.count(len(self), 'row')} of {html.count(len(self.names), 'variable')}"
        span = f", {self.time[0]:g} to {self.time[-1]:g} s" if len(self) else ""
        place = f" in {self.folder}" if self.folder is not None else ""
        return f"{self.info.get('system', 'a run')}: {self.info.get('status', 'unknown')}, {rows}{span}{place}"

    def _repr_html_(self) -> str:
        """Return tables of what is recorded, with units, and of the metrics where they are made; for a notebook."""
        rows = [
            (name, "Real" if types is None else types, " x ".join(map(str, g.shape)), self.units.get(name) or "")
            for name, g in self._groups.items()
            for types in [self.info.get("types", {}).get(g.elements[0])]
        ]
        metrics = [(name, figures(value)) for name, value in self.info.get("metrics", {}).items()]
        why = [self.info["why"]] if "why" in self.info else []
        return "".join(
            [
                html.title(f"Result of {self._told()}", *why),
                html.table(("variable", "type", "size", "unit"), rows),
                html.table(("metric", "value"), metrics),
            ]
        )

    def __len__(self) -> int:
        """Return the number of rows."""
        return self.table.num_rows

    @cached_property
    def time(self) -> NDArray[np.float64]:
        """Time in s, shape (n,)."""
        return to_numpy(self.table["time"])

    def __getitem__(self, name: str) -> NDArray[Any]:
        """Return an array or an element by name, of its type; raises `UnknownName` with the nearest names."""
        name = canonical(name)
        found = self._groups.get(name)
        if found is None and name in self.table.column_names:
            found = Group((), (name,))
        if found is None:
            raise UnknownName("variable", name, "the result", self.names)
        columns = [to_numpy(self.table[e]) for e in found.elements]
        if found.shape == ():
            return columns[0]
        return np.stack(columns, axis=1).reshape(len(self), *found.shape)

    def __contains__(self, name: str) -> bool:
        """Whether an array or element is recorded."""
        return canonical(name) in self._groups or canonical(name) in self.table.column_names

    @property
    def names(self) -> list[str]:
        """Names of the recorded arrays and scalars."""
        return list(self._groups)

    @cached_property
    def units(self) -> dict[str, str | None]:
        """Units by array and by element name, `time` included."""
        units = formats.units(self.table)
        return units | {base: units[g.elements[0]] for base, g in self._groups.items()}

    @cached_property
    def items(self) -> dict[str, dict[str, int]]:
        """Literals of enumerations with their numbers, by the name of the element."""
        found = {f.name: items_of(f) for f in self.table.schema}
        return {name: items for name, items in found.items() if items is not None}

    @cached_property
    def _groups(self) -> Mapping[str, Group]:
        return group(self.table.column_names[1:])

    def to_pandas(self) -> "pd.DataFrame":
        """Return a data frame with the columns of the file, `time` first."""
        return self.table.to_pandas()


def figures(value: Any) -> str:
    """Return a metric with four digits, of several components all."""
    if isinstance(value, list | tuple):
        return ", ".join(map(figures, cast(Sequence[Any], value)))
    if value is None:
        return "not reached"
    return f"{value:.4g}" if isinstance(value, float) else str(value)


def _metadata(column: pa.Field, unit: str | None, items: Mapping[str, int] | None) -> dict[str, str]:
    """Return the metadata of a column: its own, and where its file has none that of run.json."""
    unit, items = unit_of(column) or unit, items_of(column) or items
    return ({} if unit is None else {"unit": unit}) | ({} if items is None else {"items": json.dumps(items)})
