"""The columns of a result as Arrow fields: name, type, and in the metadata unit and literals of an enumeration."""

import json
from collections.abc import Mapping
from typing import Any
from weakref import WeakKeyDictionary

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from cosim.masters.columns import Columns, ColumnType

ENUMERATION = pa.int32()
TYPES: Mapping[ColumnType, pa.DataType] = {
    "Real": pa.float64(),
    "Integer": pa.int32(),
    "Long": pa.int64(),
    "Enumeration": ENUMERATION,
    "Boolean": pa.bool_(),
    "String": pa.string(),
}


_known: "WeakKeyDictionary[Columns, pa.Schema]" = WeakKeyDictionary()


def schema(columns: Columns) -> pa.Schema:
    """Return `time` in s, then the columns, each of its own type."""
    if columns not in _known:
        fields = [field("time", "Real", "s", None)]
        parts = zip(columns.names, columns.types, columns.units, columns.items, strict=True)
        _known[columns] = pa.schema([*fields, *(field(*part) for part in parts)])
    return _known[columns]


def field(name: str, kind: ColumnType, unit: str | None, items: Mapping[str, int] | None) -> pa.Field:
    """Return one column; `items` are the literals of an enumeration, with their numbers."""
    metadata = {} if unit is None else {"unit": unit}
    if items is not None:
        metadata["items"] = json.dumps(dict(items))
    return pa.field(name, TYPES[kind], nullable=False, metadata=metadata or None)


def unit_of(column: pa.Field) -> str | None:
    """Return the unit of a column, None where there is none."""
    metadata = column.metadata or {}
    return metadata[b"unit"].decode() if b"unit" in metadata else None


def items_of(column: pa.Field) -> dict[str, int] | None:
    """Return the literals of an enumeration's column with their numbers, None for another column."""
    metadata = column.metadata or {}
    return json.loads(metadata[b"items"]) if b"items" in metadata else None


def to_numpy(column: pa.ChunkedArray) -> NDArray[Any]:
    """Return a column without nulls, of texts an array of objects. Arrow's own conversion would import pandas."""
    if pa.types.is_string(column.type):
        return np.array(column.to_pylist(), dtype=object)
    return np.concatenate([_values(chunk) for chunk in column.chunks] or [np.zeros(0, _DTYPES[column.type])])


_DTYPES = {pa.float64(): np.float64, pa.int32(): np.int32, pa.int64(): np.int64, pa.bool_(): np.bool_}


def _values(chunk: pa.Array) -> NDArray[Any]:
    data, first, last = chunk.buffers()[1], chunk.offset, chunk.offset + len(chunk)
    if data is None:
        return np.zeros(0, _DTYPES[chunk.type])
    if pa.types.is_boolean(chunk.type):
        bits = np.unpackbits(np.frombuffer(data, np.uint8), bitorder="little")
        return bits[first:last].astype(np.bool_)
    return np.frombuffer(data, _DTYPES[chunk.type])[first:last]
