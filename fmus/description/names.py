"""Names of variables: `plant.J[1,1]` is element (1, 1) of the array `plant.J`; FMI 2.0 itself knows no arrays."""

import difflib
import itertools
import math
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

_NUMBER = r"\s*\d{1,18}\s*"
_ELEMENT = re.compile(rf"(?P<base>.+)\[(?P<index>{_NUMBER}(?:,{_NUMBER})*)\]", re.ASCII | re.DOTALL)


@dataclass(frozen=True)
class Group:
    """A scalar or array: `shape` () for a scalar, `elements` its scalar names, row by row."""

    shape: tuple[int, ...]
    elements: tuple[str, ...]


def split_element(name: str) -> tuple[str, tuple[int, ...]]:
    """Return base name and 1-based index: "J[1,2]" -> ("J", (1, 2)), "J" -> ("J", ())."""
    match = _ELEMENT.fullmatch(name)
    if match is None:
        return name, ()
    return match["base"], tuple(int(i) for i in match["index"].split(","))


def element(base: str, index: Iterable[int]) -> str:
    """Return the scalar name of a 1-based index: ("J", (1, 2)) -> "J[1,2]"."""
    return f"{base}[{','.join(map(str, index))}]"


def canonical(name: str) -> str:
    """Return a name with its index written the one way that this package writes it, "J[1, 2]" -> "J[1,2]"."""
    base, index = split_element(name)
    return element(base, index) if index else name


def indices(shape: Sequence[int]) -> list[tuple[int, ...]]:
    """Return all 1-based indices of a shape, row by row."""
    return list(itertools.product(*(range(1, n + 1) for n in shape)))


def nested(flat: Sequence[Any], shape: Sequence[int]) -> Any:
    """Return the elements of a variable, row by row, as the one value, a list, or a list of rows."""
    if not shape:
        return flat[0]
    if len(shape) == 1:
        return list(flat)
    size = math.prod(shape[1:])
    return [nested(flat[i * size : (i + 1) * size], shape[1:]) for i in range(shape[0])]


def group(names: Iterable[str]) -> Mapping[str, Group]:
    """Collect scalar names into arrays, in order of first appearance.

    Elements whose indices do not fill a whole array (a[1], a[3]) stay scalars of their own, and so do those of an array
    that has the name of another one (a, a[1]; a[1], a[1][1]).
    """
    names = list(names)
    single = set(names)
    found: dict[str, dict[tuple[int, ...], str]] = {}
    for name in names:
        base, index = split_element(name)
        found.setdefault(base, {})[index] = name
    groups: dict[str, Group] = {}
    for base, members in found.items():
        shape = tuple(map(max, zip(*members, strict=False)))
        same = len({len(i) for i in members}) == 1 and (() in members or base not in single)
        if same and math.prod(shape) == len(members) and sorted(members) == indices(shape):
            groups[base] = Group(shape, tuple(members[i] for i in sorted(members)))
        else:
            groups |= {name: Group((), (name,)) for name in members.values()}
    return groups


def identifier(name: str) -> str:
    """Return a name as an identifier of C: what cannot be in one is an underscore."""
    plain = re.sub(r"\W", "_", name, flags=re.ASCII)
    return plain if plain[:1].isalpha() or plain[:1] == "_" else f"_{plain}"


def nearest(name: str, available: Iterable[str]) -> list[str]:
    """Return up to three names of `available` that look like `name`, letter case ignored."""
    folded: dict[str, list[str]] = {}
    for known in available:
        folded.setdefault(known.lower(), []).append(known)
    matches = difflib.get_close_matches(name.lower(), folded, n=3, cutoff=0.6)
    return [known for match in matches for known in folded[match]][:3]


def did_you_mean(name: str, available: Iterable[str]) -> str:
    """Return ' Did you mean "x"?' with the nearest names of the right kind, "" where none looks like it."""
    near = " or ".join(f'"{known}"' for known in nearest(name, available))
    return f" Did you mean {near}?" if near else ""


def did_you_mean_file(path: Path) -> str:
    """Return ' Did you mean "x"?' with the nearest names of files of this kind in the file's folder."""
    try:
        there = [other.name for other in path.parent.iterdir() if other.suffix == path.suffix]
    except OSError:
        return ""
    return did_you_mean(path.name, there)


def split_port(name: str) -> tuple[str, str]:
    """Return instance and variable of "plant.q_BN[1]"; the variable is "" where the name has no dot."""
    instance, _, variable = name.partition(".")
    return instance, canonical(variable)
