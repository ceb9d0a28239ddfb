"""The file formats of a result: parquet, csv, mat, and the stream that a run leaves if it is killed."""

import re
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.csv as pa_csv
import pyarrow.parquet as pq
from scipy.io import loadmat, savemat

from cosim.errors import ResultUnreadable, ResultUnwritable, UnknownName
from fmus.description.names import group
from cosim.results.recorder import STREAM

ROW_GROUP = 65536
FORMATS = ("parquet", "csv", "mat")


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


def read(folder: Path) -> pa.Table:
    """Read the result in a folder, whatever its format; raises `ResultUnreadable`."""
    for name, reader in _READERS.items():
        if (folder / name).is_file():
            try:
                return reader(folder / name)
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


def _read_stream(path: Path) -> pa.Table:
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
    chunks = _chunks(stream)
    first = next(chunks)
    with pa_csv.CSVWriter(target, first.schema) as writer:
        writer.write_table(first)
        for chunk in chunks:
            writer.write_table(chunk)


def _write_mat(stream: Path, target: Path) -> None:
    """Write a struct per instance, arrays (rows, n) or (rows, r, c), with names and units to read it back."""
    table = _read_stream(stream)
    content: dict[str, Any] = {"time": table["time"].to_numpy()[:, None]}
    for base, g in group(table.column_names[1:]).items():
        array = np.stack([table[name].to_numpy() for name in g.elements], axis=1)
        instance, variable = _matlab(base)
        content.setdefault(instance, {})[variable] = array.reshape(len(array), *(g.shape or (1,)))
    content["column_names"] = np.array(table.column_names, dtype=object)
    content["column_units"] = np.array([_unit(f) or "" for f in table.schema], dtype=object)
    savemat(target, content, long_field_names=True, do_compression=True)


def _matlab(base: str) -> tuple[str, str]:
    instance, _, variable = base.partition(".")
    return re.sub(r"\W", "_", instance), re.sub(r"\W", "_", variable)


def _read_mat(path: Path) -> pa.Table:
    content = loadmat(path, squeeze_me=False)
    names = [str(n[0]) for n in content["column_names"].ravel()]
    units = [str(u[0]) if len(u) else None for u in content["column_units"].ravel()]
    columns: dict[str, Any] = {"time": content["time"].ravel()}
    for base, g in group(names[1:]).items():
        instance, variable = _matlab(base)
        array = content[instance][variable][0, 0]
        flat = array.reshape(array.shape[0], -1)
        columns |= {name: flat[:, i] for i, name in enumerate(g.elements)}
    fields = [
        pa.field(n, pa.float64(), metadata={"unit": u} if u is not None else None)
        for n, u in zip(names, units, strict=True)
    ]
    return pa.table([pa.array(columns[n], pa.float64()) for n in names], schema=pa.schema(fields))


def _read_csv(path: Path) -> pa.Table:
    table = pa_csv.read_csv(path)
    return table.cast(pa.schema([pa.field(n, pa.float64()) for n in table.column_names]))


def _unit(field: pa.Field) -> str | None:
    metadata = field.metadata or {}
    return metadata[b"unit"].decode() if b"unit" in metadata else None


def units(table: pa.Table) -> dict[str, str | None]:
    """Return the unit of each column, None where there is none."""
    return {f.name: _unit(f) for f in table.schema}


_WRITERS: dict[str, Callable[[Path, Path], None]] = {
    "parquet": _write_parquet,
    "csv": _write_csv,
    "mat": _write_mat,
}
_READERS: dict[str, Callable[[Path], pa.Table]] = {
    "result.parquet": pq.read_table,
    "result.csv": _read_csv,
    "result.mat": _read_mat,
    STREAM: _read_stream,
}
