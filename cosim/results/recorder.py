"""Rows to disk while a run goes on: an Arrow IPC stream, so that whatever ends the process leaves readable rows."""

import time
from collections.abc import Callable
from pathlib import Path
from types import TracebackType
from typing import Any

import numpy as np
import pyarrow as pa

from cosim.errors import ResultUnwritable
from cosim.masters.master import Block
from cosim.masters.plan import Columns

STREAM = "result.arrows"
FLUSH = 1.0
"""Seconds after which rows go to the operating system at the latest."""

BLOCK_BYTES = 4_000_000
BLOCK_ROWS = 4096


class Recorder:
    """Writes the rows of `block` to `folder/result.arrows`; use it as a context manager.

    Raises `ResultUnwritable` where the disk takes no more; the rows that it took stay readable, and none follow.
    """

    def __init__(self, folder: Path, columns: Columns) -> None:
        width = 1 + len(columns.names)
        self.block = Block(max(2, min(BLOCK_ROWS, BLOCK_BYTES // (8 * width))), len(columns.names))
        self.path = folder / STREAM
        self.rows = 0
        self._schema = schema(columns)
        self._file = self.path.open("wb", buffering=0)
        self._writer: Any = pa.ipc.new_stream(self._file, self._schema)
        self._flushed = time.perf_counter()
        self._cut = False

    def __enter__(self) -> "Recorder":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Write what is left, and the end of the stream."""
        try:
            if not self._cut:
                self.flush()
                self._write(self._writer.close)
        finally:
            self._file.close()

    def look(self) -> None:
        """Write the block if it is full or `FLUSH` has passed."""
        if self.block.full or time.perf_counter() - self._flushed > FLUSH:
            self.flush()

    def flush(self) -> None:
        """Write all complete rows."""
        count = self.block.count
        if count:
            columns = [pa.array(np.ascontiguousarray(column)) for column in self.block.data[:count].T]
            self._write(self._writer.write_batch, pa.record_batch(columns, schema=self._schema))
            self.block.count = 0
            self.rows += count
        self._flushed = time.perf_counter()

    def _write(self, call: Callable[..., None], *arguments: Any) -> None:
        try:
            call(*arguments)
        except OSError as error:
            self._cut, self.block.count = True, 0
            raise ResultUnwritable(self.path, error.strerror or str(error)) from error


def schema(columns: Columns) -> pa.Schema:
    """Return `time` in s, then the columns, all float64, units in the fields' metadata."""
    fields = [pa.field("time", pa.float64(), nullable=False, metadata={"unit": "s"})]
    for name, unit in zip(columns.names, columns.units, strict=True):
        metadata = {"unit": unit} if unit is not None else None
        fields.append(pa.field(name, pa.float64(), nullable=False, metadata=metadata))
    return pa.schema(fields)
