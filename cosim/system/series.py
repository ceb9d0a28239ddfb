"""Time series as files and tables have them: CSV, parquet, MATLAB, a data frame, arrays. Read into plain columns.

A column's header has its unit in brackets at its end, "gust[1] (N.m)" or "torque [mN.m]"; a parquet file of ours has it
in the metadata. `time` or `t` is the column of times, in s or as its header says.
"""

import csv
import hashlib
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import Any, cast

import numpy as np

from cosim.arrays import FloatArray
from cosim.errors import SignalError, near
from cosim.time import UNITS as TIMES
from fmus.description.names import element, group, nearest

TIME = ("time", "t")
_UNIT = re.compile(r"^(?P<name>.*?)\s*(?:\((?P<round>.*)\)|\[(?P<square>[^\]]*[^\d\s,\]][^\]]*)\])$", re.DOTALL)
"""A name and a unit behind it; brackets with whole numbers only are the index of an element."""


@dataclass(frozen=True)
class Column:
    """Values of one scalar, shape (n,), and their unit, None where none is said. `problem`: why they are no numbers."""

    values: FloatArray
    unit: str | None = None
    problem: str = ""


@dataclass(frozen=True)
class Series:
    """Times in s, shape (n,), and columns by name.

    `label`, `rows`: for messages, what it is, and the numbers of its rows where it is a text.
    """

    label: str
    time: FloatArray
    columns: Mapping[str, Column]
    file: Path | None = None
    checksum: str | None = None
    rows: Sequence[int] = ()

    def row(self, i: int) -> int:
        """Return the number of a sample, as the file counts its lines; without lines from 0 on."""
        return _row(self.rows, i)

    def chosen(self, names: Sequence[str]) -> list[tuple[str, Column]]:
        """Return the columns of some names, arrays whole; of none named, all if they are one scalar or one array.

        Raises `SignalError`.
        """
        groups = group(self.columns)
        if not names and len(groups) != 1:
            there = ", ".join(groups) or "none"
            advice = f"Choose, as FILE:{next(iter(groups))} or Signal(..., column=...)." if groups else ""
            raise SignalError(self.label, f"it has {len(groups)} columns beside time: {there}", advice)
        found: list[tuple[str, Column]] = []
        for name in names or groups:
            elements = groups[name].elements if name in groups else (name,)
            if name not in groups and name not in self.columns:
                near_by = nearest(name, groups)
                hint = f"Did you mean {' or '.join(near_by)}?" if near_by else f"There: {', '.join(groups)}."
                raise SignalError(self.label, f'it has no column "{name}"', hint)
            found += [(e, self.columns[e]) for e in elements]
        for _, column in found:
            if column.problem:
                raise SignalError(self.label, column.problem, "Numbers are decimal, with a point: 2.5, 1e-3.")
        return found


def read(source: object) -> Series:
    """Read a path, a data frame, (time, values), or a mapping of arrays; raises `SignalError`."""
    if isinstance(source, str | Path):
        return _file(Path(source).expanduser())
    if isinstance(source, tuple) and len(cast(tuple[Any, ...], source)) == 2:
        time, values = cast(tuple[Any, Any], source)
        return _series("of arrays", {"time": time, "values": values}, {})
    if hasattr(source, "columns") and hasattr(source, "index"):
        return _frame(source)
    if isinstance(source, Mapping):
        return _series("of arrays", cast(Mapping[str, Any], source), {})
    problem = f"it is {type(source).__name__}, which is no time series"
    raise SignalError(
        repr(source)[:60], problem, "Give a file, a data frame, (time, values), or Signal.of(function, ...)."
    )


def _file(path: Path) -> Series:
    label = str(near(path.absolute()))
    readers = {".csv": _csv, ".txt": _csv, ".parquet": _parquet, ".mat": _mat}
    reader = readers.get(path.suffix.lower())
    if reader is None:
        raise SignalError(label, f'its suffix is "{path.suffix}"', f"Known are {', '.join(readers)}.")
    try:
        checksum = hashlib.sha256(path.read_bytes()).hexdigest()
        values, units, rows = reader(path, label)
    except FileNotFoundError as error:
        raise SignalError(label, "there is no such file") from error
    except (OSError, UnicodeDecodeError) as error:
        raise SignalError(label, f"it cannot be read: {error}") from error
    return _series(label, values, units, path, checksum, rows)


_Read = tuple[Mapping[str, Any], Mapping[str, str | None], Sequence[int]]
"""Columns by header, units of those whose headers have none, the line of each row of a text."""


def _csv(path: Path, label: str) -> _Read:
    with path.open(newline="", encoding="utf-8-sig") as file:
        first = file.readline()
        separator = max(",;\t", key=first.count)
        header = [name.strip() for name in next(csv.reader([first.lstrip("# ")], delimiter=separator), [])]
        rows = [(n, row) for n, row in enumerate(csv.reader(file, delimiter=separator), 2) if any(map(str.strip, row))]
    if not rows:
        raise SignalError(label, "it has no rows of values", "Its first line is the header: time, gust (N.m).")
    for n, row in rows:
        if len(row) != len(header):
            raise SignalError(label, f"row {n} has {len(row)} values, the header has {len(header)} columns")
    return {name: [row[i] for _, row in rows] for i, name in enumerate(header)}, {}, [n for n, _ in rows]


def _parquet(path: Path, label: str) -> _Read:
    import pyarrow as pa
    import pyarrow.parquet as pq

    try:
        table: Any = pq.read_table(path)
    except pa.ArrowInvalid as error:
        raise SignalError(label, f"it is no parquet file: {error}") from error
    numbers = [f for f in table.schema if pa.types.is_floating(f.type) or pa.types.is_integer(f.type)]
    units = {f.name: (f.metadata or {}).get(b"unit", b"").decode() or None for f in numbers}
    return {f.name: np.array(table[f.name].to_pylist(), dtype=np.float64) for f in numbers}, units, ()


def _mat(path: Path, label: str) -> _Read:
    from scipy.io import loadmat
    from scipy.io.matlab import MatReadError

    try:
        content: dict[str, Any] = loadmat(path, simplify_cells=True)
    except (ValueError, NotImplementedError, MatReadError) as error:
        raise SignalError(label, f"it is no MATLAB file of version 5 to 7 ({error})", "In MATLAB: save -v7.") from error
    own = {name: content.pop(name, ()) for name in ("column_names", "column_fields", "column_units")}
    flat = {k: v for k, v in content.items() if not k.startswith(("__", "column_"))}
    for name in [k for k, v in flat.items() if isinstance(v, dict)]:
        flat |= {f"{name}.{k}": v for k, v in flat.pop(name).items()}
    arrays = {k: v for k, v in flat.items() if np.asarray(v).dtype.kind in "fiub"}
    names = list(map(str, np.atleast_1d(own["column_names"])))
    if not names:
        return arrays, {}, ()
    places = list(map(str, np.atleast_1d(own["column_fields"])))
    columns: dict[str, Any] = {}
    for place in dict.fromkeys(places):  # a result of ours says what its fields are called elsewhere
        mine = [name for name, p in zip(names, places, strict=True) if p == place]
        if place in arrays:
            columns |= zip(mine, np.asarray(arrays[place], dtype=np.float64).reshape(-1, len(mine)).T, strict=True)
    units = dict(zip(names, (str(u) or None for u in np.atleast_1d(own["column_units"])), strict=True))
    return columns, units, ()


def _frame(frame: Any) -> Series:
    """Read a data frame: a column of times, else its index, which may be of time differences."""
    values = {str(name): np.asarray(frame[name]) for name in frame.columns}
    if not any(_split(name)[0].lower() in TIME for name in values):
        index = frame.index
        values = {"time": index.total_seconds() if hasattr(index, "total_seconds") else index.to_numpy(), **values}
    return _series("of a data frame", values, {})


def _series(
    label: str,
    values: Mapping[str, Any],
    units: Mapping[str, str | None],
    file: Path | None = None,
    checksum: str | None = None,
    rows: Sequence[int] = (),
) -> Series:
    """Split headers into names and units, arrays of several columns into elements."""
    columns: dict[str, Column] = {}
    time: tuple[FloatArray, str | None] | None = None
    for header, given in values.items():
        name, unit = _split(header)
        unit = unit or units.get(header)
        array, problem = _numbers(given, name, rows)
        if time is None and name.lower() in TIME:
            if problem:
                raise SignalError(label, problem)
            time = array.ravel(), unit
        else:
            columns |= {n: Column(v, unit, problem) for n, v in _elements(name, array, label)}
    if time is None:
        there = ", ".join(columns) or "none"
        raise SignalError(
            label, f'it has no column "time". Columns: {there}', "Its header begins with time, or time (s)."
        )
    if (time[1] or "s") not in TIMES:
        raise SignalError(label, f"its time has the unit {time[1]}", f"Known are {', '.join(TIMES)}.")
    factor = Fraction(TIMES[time[1] or "s"])
    seconds = time[0] * factor.numerator / factor.denominator  # 1 ms is 1 / 1000 s, rounded once
    for name, column in columns.items():
        if len(column.values) != len(seconds) and not column.problem:
            problem = f'column "{name}" has {len(column.values)} values, there are {len(seconds)} times'
            raise SignalError(label, problem)
    return Series(label, seconds, columns, file, checksum, rows)


def _numbers(given: Any, name: str, rows: Sequence[int]) -> tuple[FloatArray, str]:
    """Return values as doubles, an empty text as NaN; or why they are none, with the row of the first that is none."""
    try:
        return np.array(given, dtype=np.float64), ""
    except (TypeError, ValueError) as error:
        numbers = np.full(np.shape(given)[:1], np.nan)
        for i, value in enumerate(given if numbers.shape else ()):
            try:
                numbers[i] = float(value) if str(value).strip() else np.nan
            except (TypeError, ValueError):
                return np.zeros(0), f"row {_row(rows, i)} has {value!r} in column {name}, which is no number"
        return numbers, "" if numbers.shape else f'column "{name}" is no array of numbers ({error})'


def _row(rows: Sequence[int], i: int) -> int:
    return rows[i] if rows else i


def _split(header: str) -> tuple[str, str | None]:
    match = _UNIT.match(header.strip())
    if match is None:
        return header.strip(), None
    return match["name"], (match["round"] or match["square"] or "").strip() or None


def _elements(name: str, array: FloatArray, label: str) -> Iterable[tuple[str, FloatArray]]:
    if array.ndim == 1:
        return [(name, array)]
    if array.ndim != 2:
        raise SignalError(label, f'column "{name}" has the shape {array.shape}', "Give one of (n,) or (n, width).")
    if array.shape[1] == 1 or array.shape[0] == 1:
        return [(name, array.ravel())]  # MATLAB's vectors
    return [(element(name, (i + 1,)), array[:, i]) for i in range(array.shape[1])]
