"""The file formats of a result: parquet, csv, mat, and the stream that a run leaves if it is killed."""

import csv
import json
import re
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from cosim.errors import ResultUnreadable, ResultUnwritable, UnknownName
from cosim.results.names import FORMATS, STREAM
from cosim.results.schema import TYPES as ARROW
from cosim.results.schema import field, items_of, to_numpy, unit_of
from fmus.description.description import Type
from fmus.description.names import group

ROW_GROUP = 65536
Types = Mapping[str, pa.DataType]


def convert(folder: Path, kind: str) -> Path:
    """Turn folder/result.arrows into result.`kind`, batch by batch (mat: at once), and remove the stream.

    Raises `ResultUnwritable` where there is no room for it: the stream stays.
    """
    stream = folder / STREAM
    target = folder / f"result.{kind}"
    part = folder / f".{target.name}"
    try:
        _WRITERS[kind](stream, part)
        part.replace(target)
    except OSError as error:
        raise ResultUnwritable(target, error.strerror or str(error)) from error
    finally:
        part.unlink(missing_ok=True)
    stream.unlink()
    return target


def check_format(kind: str) -> None:
    """Raise `UnknownName` for a format that cannot be written."""
    if kind not in FORMATS:
        raise UnknownName("format", kind, "results", FORMATS)


def read(folder: Path, types: Types) -> pa.Table:
    """Read the result in a folder, whatever its format; raises `ResultUnreadable`.

    `types`: those of columns that are not Real, by name, for formats that have no types.
    """
    for name, reader in _READERS.items():
        if (folder / name).is_file():
            try:
                return reader(folder / name, types)
            except (pa.ArrowException, OSError, ValueError) as error:
                raise ResultUnreadable(folder / name, f"it cannot be read: {error}") from error
    raise ResultUnreadable(folder, f"there is no result in it (none of {', '.join(_READERS)})")


def batches(stream: Path) -> Iterator[pa.RecordBatch]:
    """Yield the complete batches of a stream; one that a kill cut short ends it."""
    with stream.open("rb") as file:
        try:
            reader = pa.ipc.open_stream(file)
        except (pa.ArrowInvalid, EOFError, OSError) as error:
            raise ResultUnreadable(stream, f"it was cut before its first row ({error})") from error
        while True:
            try:
                batch = reader.read_next_batch()
            except (StopIteration, pa.ArrowInvalid, OSError):
                return
            yield batch


def _read_stream(path: Path, _types: Types | None = None) -> pa.Table:
    with path.open("rb") as file:
        try:
            schema = pa.ipc.open_stream(file).schema
        except (pa.ArrowInvalid, EOFError, OSError) as error:
            raise ResultUnreadable(path, f"it was cut before its first row ({error})") from error
    return pa.Table.from_batches(list(batches(path)), schema=schema)


def _chunks(stream: Path) -> Iterator[pa.Table]:
    """Yield tables of about `ROW_GROUP` rows, at least one."""
    with stream.open("rb") as file:
        schema = pa.ipc.open_stream(file).schema
    waiting: list[pa.RecordBatch] = []
    for batch in batches(stream):
        waiting.append(batch)
        if sum(b.num_rows for b in waiting) >= ROW_GROUP:
            yield pa.Table.from_batches(waiting, schema=schema)
            waiting = []
    yield pa.Table.from_batches(waiting, schema=schema)


def _write_parquet(stream: Path, target: Path) -> None:
    chunks = _chunks(stream)
    first = next(chunks)
    with pq.ParquetWriter(target, first.schema, compression="zstd", use_dictionary=False) as writer:
        writer.write_table(first)
        for chunk in chunks:
            writer.write_table(chunk)


def _write_csv(stream: Path, target: Path) -> None:
    import pyarrow.csv as pa_csv

    chunks = _chunks(stream)
    first = next(chunks)
    with pa_csv.CSVWriter(target, first.schema) as writer:
        writer.write_table(first)
        for chunk in chunks:
            writer.write_table(chunk)


def _write_mat(stream: Path, target: Path) -> None:
    """Write a struct per instance, arrays (rows, n) or (rows, r, c), with names, units and types to read it back."""
    from scipy.io import savemat  # takes long to import

    table = _read_stream(stream)
    content: dict[str, Any] = {"time": to_numpy(table["time"])[:, None]}
    for base, g in group(table.column_names[1:]).items():
        array = np.stack([to_numpy(table[name]) for name in g.elements], axis=1)
        instance, variable = _matlab(base)
        content.setdefault(instance, {})[variable] = array.reshape(len(array), *(g.shape or (1,)))
    content["column_names"] = np.array(table.column_names, dtype=object)
    content["column_units"] = np.array([unit_of(f) or "" for f in table.schema], dtype=object)
    content["column_types"] = np.array([str(f.type) for f in table.schema], dtype=object)
    content["column_items"] = np.array([json.dumps(items_of(f)) for f in table.schema], dtype=object)
    savemat(target, content, long_field_names=True, do_compression=True)


def _matlab(base: str) -> tuple[str, str]:
    instance, _, variable = base.partition(".")
    return re.sub(r"\W", "_", instance), re.sub(r"\W", "_", variable)


def _read_mat(path: Path, _types: Types) -> pa.Table:
    from scipy.io import loadmat  # takes long to import

    content = loadmat(path, squeeze_me=False)
    names, units, types, items = (
        [str(cell[0]) if len(cell) else "" for cell in content[f"column_{what}"].ravel()]
        for what in ("names", "units", "types", "items")
    )
    kinds: dict[str, Type] = {str(kind): name for name, kind in ARROW.items()}
    columns: dict[str, Any] = {"time": content["time"].ravel()}
    for base, g in group(names[1:]).items():
        instance, variable = _matlab(base)
        array = content[instance][variable][0, 0]
        flat = array.reshape(array.shape[0], -1)
        columns |= {name: flat[:, i] for i, name in enumerate(g.elements)}
    fields = [
        field(name, kinds[kind], unit or None, json.loads(literals))
        for name, unit, kind, literals in zip(names, units, types, items, strict=True)
    ]
    arrays = [pa.array(_cells(columns[f.name], f.type), f.type) for f in fields]
    return pa.Table.from_arrays(arrays, schema=pa.schema(fields))


def _cells(column: Any, kind: pa.DataType) -> list[Any]:
    """Return a MATLAB array as Python has it: a text is an array of texts there, the empty one of none."""
    if kind == pa.string():
        return [str(cell[0]) if cell.size else "" for cell in column]
    return (column != 0 if kind == pa.bool_() else column).tolist()


def _read_csv(path: Path, types: Types) -> pa.Table:
    import pyarrow.csv as pa_csv

    with path.open(encoding="utf-8", newline="") as file:
        names = next(csv.reader(file))
    known = {name: types.get(name, pa.float64()) for name in names}
    options = pa_csv.ConvertOptions(column_types=known, strings_can_be_null=False)
    parsing = pa_csv.ParseOptions(newlines_in_values=pa.string() in known.values())
    table = pa_csv.read_csv(path, parse_options=parsing, convert_options=options)
    return table.cast(pa.schema([pa.field(n, known[n], nullable=False) for n in names]))


def _read_parquet(path: Path, _types: Types) -> pa.Table:
    with pq.ParquetFile(path) as file:  # read_table would import pandas
        return file.read()


def units(table: pa.Table) -> dict[str, str | None]:
    """Return the unit of each column, None where there is none."""
    return {f.name: unit_of(f) for f in table.schema}


_WRITERS: dict[str, Callable[[Path, Path], None]] = {
    "parquet": _write_parquet,
    "csv": _write_csv,
    "mat": _write_mat,
}
_READERS: dict[str, Callable[[Path, Types], pa.Table]] = {
    "result.parquet": _read_parquet,
    "result.csv": _read_csv,
    "result.mat": _read_mat,
    STREAM: _read_stream,
}
