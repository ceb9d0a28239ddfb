"""The rows of a run that goes on: a stream that is cut behind some rows, to which others are added.

An Arrow stream is its schema, its batches and an end, one behind the other (Arrow columnar format, IPC streaming
format), so that batches can follow wherever one ends. Of a run that has ended, whose rows are in another file, a stream
is made first; only then that file goes.
"""

import os
from collections.abc import Iterator
from contextlib import suppress
from io import FileIO
from pathlib import Path

import pyarrow as pa

from cosim.errors import ResultUnreadable
from cosim.results import formats
from cosim.results.folder import writing
from cosim.results.names import FORMATS, STREAM
from cosim.results.result import Result

END = b"\xff\xff\xff\xff\x00\x00\x00\x00"
"""What ends a stream: a message of length 0."""


class Continuation:
    """Adds batches behind those of a stream's file, which is open at its end; as the writer of a new stream does."""

    def __init__(self, file: FileIO) -> None:
        self._file = file

    def write_batch(self, batch: pa.RecordBatch) -> None:
        """Add rows; raises `OSError`."""
        self._write(memoryview(batch.serialize()))

    def close(self) -> None:
        """Write the end; raises `OSError`."""
        self._write(memoryview(END))

    def _write(self, data: memoryview) -> None:
        while len(data):  # a disk that becomes full takes a part, and then nothing
            data = data[self._file.write(data) :]


def reopened(path: Path, schema: pa.Schema, rows: int) -> FileIO:
    """Return the file of a stream, cut behind `rows` rows and open there.

    Raises `ResultUnreadable` where it has fewer, or other columns; `OSError`.
    """
    file = path.open("r+b", buffering=0)
    try:
        whole, end, rest = 0, len(schema.serialize()), None
        for batch, behind in _batches(path, file, schema):
            if whole + batch.num_rows > rows:
                rest = batch.slice(0, rows - whole)
                break
            whole, end = whole + batch.num_rows, behind
            if whole == rows:
                break
        if whole + (rest.num_rows if rest is not None else 0) < rows:
            raise ResultUnreadable(path, f"it has {whole} rows, {rows} were there before the checkpoint")
        file.truncate(end)
        file.seek(end)
        if rest is not None and rest.num_rows:
            Continuation(file).write_batch(rest)
    except BaseException:
        file.close()
        raise
    return file


def _batches(path: Path, file: FileIO, schema: pa.Schema) -> Iterator[tuple[pa.RecordBatch, int]]:
    """Yield the complete batches of a stream, each with where it ends in the file."""
    try:
        reader = pa.ipc.open_stream(file)
    except (pa.ArrowInvalid, EOFError, OSError) as error:
        raise ResultUnreadable(path, f"it was cut before its first row ({error})") from error
    if not reader.schema.equals(schema, check_metadata=True):
        lost = [name for name in schema.names if name not in reader.schema.names]
        raise ResultUnreadable(path, f"its columns are others: {', '.join(lost) or 'types or units'}")
    while True:
        try:
            batch = reader.read_next_batch()
        except (StopIteration, pa.ArrowInvalid, OSError):
            return
        yield batch, file.tell()


def as_stream(folder: Path, schema: pa.Schema) -> None:
    """Make the stream of a folder anew where its rows are in another file, which then goes.

    Raises `ResultUnreadable`, `ResultUnwritable`.
    """
    files = [folder / f"result.{kind}" for kind in FORMATS]
    if any(path.is_file() for path in files):
        table = Result.read(folder).table
        part, target = folder / f".{STREAM}", folder / STREAM
        if table.column_names != schema.names:
            raise ResultUnreadable(folder, "its columns are not those of the checkpoint")
        with writing(part), part.open("wb") as file:
            with pa.ipc.new_stream(file, schema) as stream:
                stream.write_table(table.cast(schema), max_chunksize=formats.ROW_GROUP)
            file.flush()
            os.fsync(file.fileno())
        with writing(target):
            part.replace(target)
    elif not (folder / STREAM).is_file():
        raise ResultUnreadable(folder, f"there are no rows in it (no {STREAM}, and no result)")
    for path in files:
        with suppress(FileNotFoundError):
            path.unlink()
