"""The file formats of a result: parquet, csv, mat, and the stream that a run leaves if it is killed."""

import csv
import os
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq

from cosim.errors import ResultUnreadable, ResultUnwritable, UnknownName
from cosim.masters.columns import Columns
from cosim.results import matlab
from cosim.results.names import FORMATS, STREAM
from cosim.results.schema import schema, unit_of

ROW_GROUP = 65536
SMALL = 256
"""So many batches are joined: a run with checkpoints flushes its rows at each."""

Types = Mapping[str, pa.DataType]


def convert(folder: Path, kind: str) -> pa.Table:
    """Turn folder/result.arrows into result.`kind`, batch by batch (mat: at once), and remove the stream.

    Returns its rows, which need not be read back then. Raises `ResultUnwritable` where there is no room for it, or what
    was written is not read back: the stream stays.
    """
    stream = folder / STREAM
    target = folder / f"result.{kind}"
    part = folder / f".{target.name}"
    try:
        table = _WRITERS[kind](stream, part)
        _check_written(part, kind, table)
        part.replace(target)
    except OSError as error:
        raise ResultUnwritable(target, error.strerror or str(error)) from error
    except (pa.ArrowException, ValueError, LookupError, MemoryError) as error:
        raise ResultUnwritable(target, str(error) or type(error).__name__) from error
    finally:
        part.unlink(missing_ok=True)
    stream.unlink()
    return table


def _check_written(part: Path, kind: str, written: pa.Table) -> None:
    """Raise ValueError unless names and rows are read back."""
    columns, rows = written.schema, written.num_rows
    if kind == "parquet":
        with pq.ParquetFile(part) as file:
            names, found = file.schema_arrow.names, file.metadata.num_rows
    else:
        table = _READERS[f"result.{kind}"](part, {f.name: f.type for f in columns})
        names, found = table.column_names, table.num_rows
    if names != columns.names:
        lost = [name for name in columns.names if name not in names]
        raise ValueError(f"columns are not read back as they were written: {', '.join(lost) or 'their order'}")
    if found != rows:
        raise ValueError(f"{found} of {rows} rows are read back")


def check_format(kind: str) -> None:
    """Raise `UnknownName` for a format that cannot be written."""
    if kind not in FORMATS:
        raise UnknownName("format", kind, "results", FORMATS)


def check_room(kind: str, columns: Columns, rows: int) -> None:
    """Raise `NotSupported` for columns and rows that a format has no room for, before they are flown."""
    if kind == "mat":
        matlab.check_size(schema(columns), rows)


def read(folder: Path, types: Types) -> pa.Table:
    """Read the result in a folder, whatever its format; raises `ResultUnreadable`.

    `types`: those of columns that are not Real, by name, for formats that have no types.
    """
    for name, reader in _READERS.items():
        if os.path.isfile(folder / name):
            try:
                return reader(folder / name, types)
            except ResultUnreadable:
                raise
            except Exception as error:  # the readers raise whatever a damaged file leads to
                raise ResultUnreadable(
                    folder / name, f"it cannot be read: {str(error) or type(error).__name__}"
                ) from error
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
    return pa.Table.from_batches(list(batches(path)), schema=_schema(path))


def _schema(stream: Path) -> pa.Schema:
    with stream.open("rb") as file:
        try:
            return pa.ipc.open_stream(file).schema
        except (pa.ArrowInvalid, EOFError, OSError) as error:
            raise ResultUnreadable(stream, f"it was cut before its first row ({error})") from error


def _chunks(stream: Path) -> Iterator[pa.Table]:
    """Yield tables of about `ROW_GROUP` rows, at least one; many small batches, each with its costs, are joined."""
    columns = _schema(stream)
    joined: list[pa.RecordBatch] = []
    small: list[pa.RecordBatch] = []
    rows = 0
    for batch in batches(stream):
        small.append(batch)
        rows += batch.num_rows
        if len(small) == SMALL:
            joined += pa.Table.from_batches(small, schema=columns).combine_chunks().to_batches()
            small = []
        if rows >= ROW_GROUP:
            yield pa.Table.from_batches([*joined, *small], schema=columns)
            joined, small, rows = [], [], 0
    yield pa.Table.from_batches([*joined, *small], schema=columns)


def _write_parquet(stream: Path, target: Path) -> pa.Table:
    # numbers as they are: split by bytes they take a quarter less room, but older readers do not know that
    how: Any = {"compression": "zstd", "use_dictionary": False}
    return _write_chunks(stream, lambda schema: pq.ParquetWriter(target, schema, **how))


def _write_csv(stream: Path, target: Path) -> pa.Table:
    import pyarrow.csv as pa_csv

    return _write_chunks(stream, lambda schema: pa_csv.CSVWriter(target, schema))


def _write_chunks(stream: Path, writer: Callable[[pa.Schema], Any]) -> pa.Table:
    written: list[pa.Table] = []
    with writer(_schema(stream)) as file:
        for chunk in _chunks(stream):
            file.write_table(chunk)
            written.append(chunk)
    return pa.concat_tables(written)


def _write_mat(stream: Path, target: Path) -> pa.Table:
    table = _read_stream(stream)
    matlab.write(table, target)
    return table


def _read_mat(path: Path, _types: Types) -> pa.Table:
    return matlab.read(path)


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


_WRITERS: dict[str, Callable[[Path, Path], pa.Table]] = {
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
