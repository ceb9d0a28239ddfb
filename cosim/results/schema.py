"""The columns of a result as Arrow fields: name, type, and in the metadata unit and literals of an enumeration."""

import json
from collections.abc import Mapping
from weakref import WeakKeyDictionary

import pyarrow as pa

from cosim.masters.columns import Columns
from fmus.description.description import Type

ENUMERATION = pa.int32()
TYPES: Mapping[Type, pa.DataType] = {
    "Real": pa.float64(),
    "Integer": pa.int32(),
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


def field(name: str, kind: Type, unit: str | None, items: Mapping[str, int] | None) -> pa.Field:
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
