"""A checkpoint: the point that a run has reached, and of which flight, in one file that is whole or not there.

    adcs-cosim checkpoint 1          the format
    <SHA-256 of all that follows>
    {"flight": ..., "rows": ...}     the header, JSON in one line
    <the point>                      `Point.to_bytes`

A new file is written beside the one before, taken by the disk (fsync), and then put in its place, so that whatever ends
the process or the machine, and where there is no room, the older one stays whole. Rows that it counts are on the disk
before it is.
"""

import contextlib
import hashlib
import json
import os
import zipfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from cosim.errors import ResultUnwritable, SimulationError, near
from cosim.masters.point import Point
from cosim.results.folder import writing
from cosim.results.names import CHECKPOINT

MAGIC = b"adcs-cosim checkpoint "
VERSION = b"1"


@dataclass(eq=False)
class CheckpointRefused(SimulationError):
    """A checkpoint from which no run can go on: missing, damaged, of another flight."""

    path: Path
    problem: str
    advice: str

    def __str__(self) -> str:
        """File, problem, the way out."""
        return f"{near(self.path)}: {self.problem}. {self.advice}"


@dataclass(eq=False)
class CheckpointUnwritable(ResultUnwritable):
    """A checkpoint that there is no room for; `older`: the time of the one that stays, s, None where there is none."""

    older: float | None = None

    def __str__(self) -> str:
        """File, problem, what there is, the way out."""
        what = f"checkpoint {near(self.path)} cannot be written: {self.problem}."
        if self.older is None:
            return f"{what} There is none before it. Choose another folder (out=..., --out DIR)."
        return (
            f"{what} The one of {self.older:.12g} s is whole: make room, then go on from it with "
            f"adcs run --resume {near(self.path.parent)}."
        )


@dataclass(frozen=True)
class Checkpoint:
    """A point that was saved: at `time`, s, `rows` rows from the start on, the last of them of the point `last_row`.

    `every`: the time between two checkpoints, s, a fraction as a text. `flight`: what flies, as plain data. `written`:
    when, UTC.
    """

    time: float
    rows: int
    last_row: int
    every: str
    flight: Mapping[str, Any]
    written: str
    point: Point

    def write(self, folder: Path, older: float | None) -> None:
        """Put it into a folder, in place of the one before, of `older` s. Raises `CheckpointUnwritable`."""
        fields = {name: value for name, value in vars(self).items() if name != "point"}
        data = json.dumps(fields).encode() + b"\n" + self.point.to_bytes()
        path = folder / CHECKPOINT
        part = path.with_name(f".{path.name}")
        try:
            with writing(part):
                with part.open("wb") as file:
                    file.write(MAGIC + VERSION + b"\n" + _checksum(data) + b"\n" + data)
                    file.flush()
                    os.fsync(file.fileno())
                part.replace(path)
                _settle(folder)
        except ResultUnwritable as error:
            raise CheckpointUnwritable(path, error.problem, older) from error

    @classmethod
    def read(cls, folder: Path) -> "Checkpoint":
        """Return the one in a folder; raises `CheckpointRefused`."""
        path = folder / CHECKPOINT
        try:
            data = path.read_bytes()
        except OSError as error:
            missing = isinstance(error, FileNotFoundError)
            where, problem = (folder, "there is no checkpoint in it") if missing else (path, str(error.strerror))
            advice = "A flight with --checkpoint TIME (checkpoint=...) leaves one."
            raise CheckpointRefused(where, problem, advice) from error
        return cls(**_fields(path, data))


def _fields(path: Path, data: bytes) -> dict[str, Any]:
    anew = "No run can go on from it: fly anew."
    head, _, rest = data.partition(b"\n")
    if not head.startswith(MAGIC):
        raise CheckpointRefused(path, "it is no checkpoint of adcs-cosim", anew)
    if head != MAGIC + VERSION:
        said = f"its format is {_begin(head[len(MAGIC) :])}, known here is {_begin(VERSION)}"
        raise CheckpointRefused(path, said, "Go on with the version of adcs-cosim that wrote it.")
    told, _, body = rest.partition(b"\n")
    found = _checksum(body)
    if told != found:
        sums = f"its checksum is {_begin(found)}, written was {_begin(told)}"
        said = f"it is cut or damaged: {sums}"
        raise CheckpointRefused(path, said, anew)
    header, _, point = body.partition(b"\n")
    try:
        return {**json.loads(header), "point": Point.from_bytes(point)}
    except (ValueError, KeyError, TypeError, zipfile.BadZipFile) as error:  # by another program, with a checksum
        raise CheckpointRefused(path, f"it cannot be read: {error}", anew) from error


def _begin(text: bytes) -> str:
    return text[:12].decode(errors="replace") + ("..." if len(text) > 12 else "")


def _checksum(data: bytes) -> bytes:
    return hashlib.sha256(data).hexdigest().encode()


def _settle(folder: Path) -> None:
    """Have the disk take the name of a new file, where a folder can be opened."""
    with contextlib.suppress(OSError):
        handle = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(handle)
        finally:
            os.close(handle)
