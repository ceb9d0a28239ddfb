"""Rows while a run goes on: to disk as an Arrow stream, which stays readable whatever ends the process, or kept."""

import os
import shutil
import time
from collections.abc import Callable
from io import FileIO
from pathlib import Path
from types import TracebackType
from typing import Any

import numpy as np
import pyarrow as pa

from cosim.arrays import FloatArray
from cosim.errors import ResultUnwritable
from cosim.masters.columns import Columns, ColumnType
from cosim.masters.types import Texts
from cosim.masters.watch import Block
from cosim.results.continued import Continuation, reopened
from cosim.results.names import STREAM
from cosim.results.schema import ENUMERATION, schema

FLUSH = 1.0
"""Seconds after which rows go to the operating system at the latest."""

BLOCK_BYTES = 4_000_000
BLOCK_ROWS = 16384


class Recorder:
    """Takes the rows of `block`, to `folder/result.arrows` or, without a folder, into memory; a context manager.

    `kept`: so many rows of an earlier flight in the folder stay, and others follow (None: it is a new one). Raises
    `ResultUnwritable` where the disk takes no more; the rows that it took stay readable, and none follow.
    """

    def __init__(
        self,
        folder: Path | None,
        columns: Columns,
        texts: Texts,
        most_rows: int = BLOCK_ROWS,
        kept: int | None = None,
    ) -> None:
        width = 1 + len(columns.names)
        capacity = max(2, min(BLOCK_ROWS, most_rows, BLOCK_BYTES // (8 * width)))
        self.block = Block(capacity, len(columns.names))
        self.rows, self._before = kept or 0, kept
        self._columns, self._texts = columns, texts
        self._schema = schema(columns)
        self._types: tuple[ColumnType, ...] = ("Real", *columns.types)
        self._whole = [_reals(column) for column in self.block.columns]
        self._folder = folder
        self._stream: _Stream | None = None
        self._kept: list[pa.RecordBatch] = []
        self._flushed = time.perf_counter()
        self._cut = False

    def __enter__(self) -> "Recorder":
        """Open the stream; raises `ResultUnwritable`."""
        if self._folder is not None:
            self._stream = _Stream(self._folder / STREAM, self._schema, self._before)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Write what is left, and the end of the stream."""
        try:
            if not self._cut:
                self.flush()
        finally:
            if self._stream is not None:
                self._stream.close(whole=not self._cut)

    def look(self) -> None:
        """Write the block if it is full, `FLUSH` has passed, or the file has no row yet."""
        first = self._stream is not None and not self.rows
        if self.block.full or first or time.perf_counter() - self._flushed > FLUSH:
            self.flush()

    def flush(self) -> None:
        """Write all complete rows."""
        count = self.block.count
        if count:
            if self._stream is None:
                columns = self.block.columns[:, :count].copy()  # the block's own are overwritten
                self._kept.append(self._batch(columns, list(map(_reals, columns))))
            else:
                try:
                    self._stream.write(self._batch(self.block.columns[:, :count], self._whole))
                except ResultUnwritable:
                    self._cut, self.block.count = True, 0
                    raise
            self.block.count = 0
            self.rows += count
            if self._stream is not None:
                self._stream.check()
        self._flushed = time.perf_counter()

    def settle(self) -> None:
        """Write all complete rows, and have them on the disk whatever ends the machine."""
        self.flush()
        if self._stream is not None:
            self._stream.settle()

    def table(self) -> pa.Table:
        """Return the rows that were kept in memory."""
        return pa.Table.from_batches(self._kept, schema=self._schema)

    def _batch(self, columns: FloatArray, reals: list[pa.Array]) -> pa.RecordBatch:
        """Return some rows by their columns; `reals`: the same as Arrow has them, perhaps with more rows."""
        parts = zip(columns, reals, self._types, strict=True)
        arrays = [r.slice(0, len(c)) if kind == "Real" else self._array(c, kind) for c, r, kind in parts]
        return pa.RecordBatch.from_arrays(arrays, schema=self._schema)

    def _array(self, column: FloatArray, kind: ColumnType) -> pa.Array:
        """Return a column in a type that is not Real."""
        if kind in ("Integer", "Enumeration"):
            buffer = pa.py_buffer(column.astype(np.int32))
            return pa.Array.from_buffers(ENUMERATION, len(column), [None, buffer])
        if kind == "Long":
            return pa.Array.from_buffers(pa.int64(), len(column), [None, pa.py_buffer(column.astype(np.int64))])
        if kind == "Boolean":
            bits = np.packbits(column != 0, bitorder="little")
            return pa.Array.from_buffers(pa.bool_(), len(column), [None, pa.py_buffer(bits)])
        return pa.array([self._texts.words(number) for number in column.tolist()], pa.string())


def _reals(column: FloatArray) -> pa.Array:
    """Return a column of Reals over the same memory. pa.array of a NumPy array would import pandas."""
    return pa.Array.from_buffers(pa.float64(), len(column), [None, pa.py_buffer(column)])


class _Stream:
    """An Arrow stream in a file, new or behind the rows `kept` of one; every call may raise `ResultUnwritable`."""

    def __init__(self, path: Path, schema: pa.Schema, kept: int | None = None) -> None:
        self.path = path
        self._missed = False
        self._file: FileIO
        self._writer: Any
        if kept is None:
            self._file = self._try(path.open, "w+b", buffering=0)
            self._writer = self._try(pa.ipc.new_stream, self._file, schema)
        else:
            self._file = self._try(reopened, path, schema, kept)
            self._writer = Continuation(self._file)

    def write(self, batch: pa.RecordBatch) -> None:
        """Add rows."""
        self._try(self._writer.write_batch, batch)

    def settle(self) -> None:
        """Have the disk take what the operating system has."""
        self._try(os.fsync, self._file.fileno())

    def check(self) -> None:
        """Refuse to go on, once, where somebody has removed the file."""
        if not self._missed and not self._is_there():
            self._missed = True
            raise ResultUnwritable(self.path, "it was removed while the run went on")

    def close(self, *, whole: bool) -> None:
        """Write the end if it is `whole`; a file that was removed is put back."""
        try:
            if whole:
                self._try(self._writer.close)
        finally:
            if not self._is_there():
                self._try(self._put_back)
            self._file.close()

    def _is_there(self) -> bool:
        try:
            return os.path.samestat(os.fstat(self._file.fileno()), self.path.stat())
        except OSError:
            return False

    def _put_back(self) -> None:
        self.path.parent.mkdir(parents=True, exist_ok=True)
        self._file.seek(0)
        with self.path.open("xb") as file:
            shutil.copyfileobj(self._file, file)

    def _try(self, call: Callable[..., Any], *arguments: Any, **more: Any) -> Any:
        try:
            return call(*arguments, **more)
        except OSError as error:
            raise ResultUnwritable(self.path, error.strerror or str(error)) from error
