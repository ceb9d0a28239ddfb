"""MATLAB files: a struct per instance, with an array (rows, n) or (rows, r, c) per variable.

`column_names` are the names as they are elsewhere, `column_fields` where each one is ("a_b.y"): MATLAB's own names
begin with a letter, have at most 63 characters, letters, digits and underscores, and are no word of its language.
"""

import json
import re
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa

from cosim.errors import NotSupported
from cosim.masters.columns import ColumnType
from cosim.results.schema import TYPES, field, items_of, to_numpy, unit_of
from fmus.description.names import Group, group

LARGEST = 2**31 - 1
"""Bytes of one variable of a file of version 5, here of one instance; what scipy writes beyond, MATLAB cannot load."""

LONGEST = 63
TEXT = 64
"""Bytes that a text takes at least, for it is an array of its own."""

OWN = ("time", "column_names", "column_fields", "column_units", "column_types", "column_items")
WORDS = (
    "break case catch classdef continue else elseif end for function global if otherwise parfor persistent return spmd "
    "switch try while"
).split()
_VALID = re.compile(rf"[A-Za-z][A-Za-z0-9_]{{0,{LONGEST - 1}}}")


def unique_names(names: Iterable[str], taken: Iterable[str] = ()) -> dict[str, str]:
    """Return a MATLAB name for each name, no two alike and none of `taken`; one that is valid stays as it is."""
    wanted = list(dict.fromkeys(names))
    used = {*taken, *WORDS}
    found = {name: name for name in wanted if _VALID.fullmatch(name) and name not in used}
    used |= found.keys()
    for name in wanted:
        if name not in found:
            plain = re.sub(r"[^A-Za-z0-9_]", "_", name)
            plain = (plain if plain[:1].isalpha() else f"x{plain}")[:LONGEST]
            number, found[name] = 1, plain
            while found[name] in used:
                number += 1
                found[name] = f"{plain[: LONGEST - len(str(number)) - 1]}_{number}"
            used.add(found[name])
    return found


def check_size(columns: pa.Schema, rows: int) -> None:
    """Raise `NotSupported` for an instance of more bytes than a file takes of one."""
    sizes: dict[str, int] = {}
    for column in columns:
        instance = column.name.partition(".")[0]
        size = TEXT if pa.types.is_string(column.type) else max(1, column.type.bit_width // 8)
        sizes[instance] = sizes.get(instance, 0) + size * rows
    for instance, size in sizes.items():
        if size > LARGEST:
            raise NotSupported(
                f"a MATLAB file takes {LARGEST / 1e9:.1f} GB of one instance, {instance} has {size / 1e9:.1f} GB in "
                f"{rows} rows",
                "Record fewer rows (every) or variables (record), or write parquet.",
            )


def write(table: pa.Table, target: Path) -> None:
    """Write all rows, with names, units, types and literals to read them back; raises ValueError."""
    from scipy.io import savemat  # takes long to import
    from scipy.io.matlab import MatWriteError

    arrays = _arrays(table.column_names[1:], [str(f.type) for f in table.schema][1:])
    places = _places(arrays)
    content: dict[str, Any] = {"time": to_numpy(table["time"])[:, None]}
    fields = dict.fromkeys(table.column_names, "time")
    for base, g in arrays.items():
        array = np.stack([to_numpy(table[name]) for name in g.elements], axis=1)
        instance, variable = places[base]
        content.setdefault(instance, {})[variable] = array.reshape(len(array), *(g.shape or (1,)))
        fields |= dict.fromkeys(g.elements, f"{instance}.{variable}")
    said = {
        "names": table.column_names,
        "fields": fields.values(),
        "units": (unit_of(f) or "" for f in table.schema),
        "types": (str(f.type) for f in table.schema),
        "items": (json.dumps(items_of(f)) for f in table.schema),
    }
    content |= {f"column_{what}": np.array(list(texts), dtype=object) for what, texts in said.items()}
    try:
        savemat(target, content, long_field_names=True, do_compression=True)
    except MatWriteError as error:
        raise ValueError(f"MATLAB files have no room for it: {error}") from error


def read(path: Path) -> pa.Table:
    """Read what `write` wrote."""
    from scipy.io import loadmat  # takes long to import

    content = loadmat(path, squeeze_me=False)
    names, units, types, items = (
        [str(cell[0]) if len(cell) else "" for cell in content[f"column_{what}"].ravel()]
        for what in ("names", "units", "types", "items")
    )
    kinds: dict[str, ColumnType] = {str(kind): name for name, kind in TYPES.items()}
    columns: dict[str, Any] = {"time": content["time"].ravel()}
    arrays = _arrays(names[1:], types[1:])
    for base, (instance, variable) in _places(arrays).items():
        array, elements = content[instance][variable][0, 0], arrays[base].elements
        flat = array.reshape(array.shape[0], len(elements))
        columns |= {name: flat[:, i] for i, name in enumerate(elements)}
    fields = [
        field(name, kinds[kind], unit or None, json.loads(literals))
        for name, unit, kind, literals in zip(names, units, types, items, strict=True)
    ]
    cells = [pa.array(_cells(columns[f.name], f.type), f.type) for f in fields]
    return pa.Table.from_arrays(cells, schema=pa.schema(fields))


def _arrays(names: Sequence[str], types: Sequence[str]) -> dict[str, Group]:
    """Return the arrays among columns; one whose elements are of several types is taken apart."""
    kinds = dict(zip(names, types, strict=True))

    def parts() -> Iterator[tuple[str, Group]]:
        for base, g in group(names).items():
            if len({kinds[name] for name in g.elements}) == 1:
                yield base, g
            else:
                yield from ((name, Group((), (name,))) for name in g.elements)

    return dict(parts())


def _places(bases: Iterable[str]) -> dict[str, tuple[str, str]]:
    """Return struct and field of each variable."""
    inside: dict[str, dict[str, str]] = {}
    for base in bases:
        instance, _, variable = base.partition(".")
        inside.setdefault(instance, {})[variable] = base
    structs = unique_names(inside, OWN)
    fields = {instance: unique_names(variables) for instance, variables in inside.items()}
    return {base: (structs[i], fields[i][v]) for i, variables in inside.items() for v, base in variables.items()}


def _cells(column: Any, kind: pa.DataType) -> list[Any]:
    """Return a MATLAB array as Python has it: a text is an array of texts there, the empty one of none."""
    if kind == pa.string():
        return [str(cell[0]) if cell.size else "" for cell in column]
    return (column != 0 if kind == pa.bool_() else column).tolist()
