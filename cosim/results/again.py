"""What it takes to fly a run again: system, experiment, FMUs and their format of rows, as plain data in run.json.

A checkpoint has the same, so that a run goes on only as what it was.
"""

import hashlib
import json
import os
import platform
import sys
import zipfile
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from cosim.errors import NotSupported
from cosim.masters.error_controlled import ErrorControlled
from cosim.masters.explicit import Explicit
from cosim.masters.iterated import Iterated
from cosim.results import runinfo
from cosim.ssp.package import is_packed
from cosim.system import Experiment, System
from cosim.system.declared import KNOWN, changed, made, plain
from cosim.system.reference import is_fmu, name_of
from fmus.description.description import ModelDescription

MASTERS = {master.__name__: master for master in (Explicit, Iterated, ErrorControlled)}

LONG = 200
"""Characters of a text from which on its checksum stands for it in a checkpoint: the samples of signals."""


def record(
    system: System,
    experiment: Experiment,
    paths: Mapping[str, Path],
    descriptions: Mapping[str, ModelDescription],
    format: str,
) -> dict[str, Any]:
    """Return a flight as plain data; raises `NotSupported` for one that cannot be written so."""
    system = replace(system, components={n: _absolute(name_of(r)) for n, r in system.components.items()})
    experiment = replace(experiment, master=experiment.master or Explicit())
    advice = "Fly it without checkpoints."
    try:
        told = {"system": _fields(system), "experiment": _fields(experiment)}
        again = {"system": _fields(system_of(told)), "experiment": _fields(experiment_of(told))}
    except (ValueError, KeyError, TypeError) as error:
        what = f"no class of a master or an experiment here is called {error}" if isinstance(error, KeyError) else error
        raise NotSupported(f"this flight cannot be written down, to be gone on with: {what}", advice) from error
    if again != told:
        raise NotSupported("this flight is read back as another one than was written down", advice)
    return {
        "made_by": {
            "adcs-cosim": runinfo.versions()["adcs-cosim"],
            "system": sys.platform,
            "machine": platform.machine(),
        },
        **told,
        "fmus": {
            name: {
                "path": str(paths[name].absolute()) if name in paths else None,
                "guid": description.guid,
                "contents": _contents(paths.get(name)),
            }
            for name, description in descriptions.items()
        },
        "format": format,
    }


def system_of(told: Mapping[str, Any]) -> System:
    """Return the system of a record."""
    return System(**_read(told["system"]))


def experiment_of(told: Mapping[str, Any]) -> Experiment:
    """Return the experiment of a record."""
    return Experiment(**_read(told["experiment"]))


def short(value: Any) -> Any:
    """Return plain data with checksums for long texts."""
    if isinstance(value, Mapping):
        return {k: short(v) for k, v in value.items()}
    if isinstance(value, list):
        return [short(v) for v in value]
    if isinstance(value, str) and len(value) > LONG:
        return f"SHA-256 {hashlib.sha256(value.encode()).hexdigest()}"
    return value


Difference = tuple[str, str, str]
"""Where two records differ, and what each has there, in words."""


def difference(one: Any, other: Any, where: str = "") -> Difference | None:
    """Return the first difference of two records, None where they are equal; where a file lies is none."""
    if one == other or (where.startswith("fmus.") and where.endswith(".path")):
        return None
    if isinstance(one, Mapping) and isinstance(other, Mapping) and not {*map(_tag, one), *map(_tag, other)} - {""}:
        for key in (*one, *(k for k in other if k not in one)):
            inner = difference(one.get(key), other.get(key), f"{where}.{key}".lstrip("."))
            if inner is not None:
                return inner
        return None
    return where, in_words(one), in_words(other)


def in_words(value: Any) -> str:
    """Return plain data as one would write it in Python."""
    if isinstance(value, Mapping):
        tag = next(map(_tag, value), "")
        if not tag:
            return "{" + ", ".join(f"{k}: {in_words(v)}" for k, v in value.items()) + "}"
        inner = value[f"!{tag}"]
        if not isinstance(inner, Mapping):
            return str(inner)
        return f"{tag}({', '.join(f'{k}={in_words(v)}' for k, v in inner.items())})"
    if isinstance(value, list):
        return f"[{', '.join(map(in_words, value))}]"
    return "not set" if value is None else repr(value) if isinstance(value, str) else str(value)


def _tag(key: str) -> str:
    return key[1:] if key.startswith("!") else ""


def _fields(declared: System | Experiment) -> dict[str, Any]:
    what = type(declared).__name__
    return {name: plain(value, f"{what}.{name}") for name, value in changed(declared).items()}


def _read(told: Mapping[str, Any]) -> dict[str, Any]:
    return json.loads(json.dumps(told), object_hook=lambda entries: made(entries, {**KNOWN, **MASTERS}))


def _absolute(reference: str) -> str:
    """Return a reference to a file as one that means it from every folder."""
    if is_fmu(reference) or is_packed(reference) or ".py:" in reference or reference.endswith(".py"):
        return os.path.abspath(reference)
    return reference


def _contents(path: Path | None) -> str | None:
    """Return a checksum of what an FMU flies with, its binaries and resources: of their checksums in the archive."""
    if path is None:
        return None
    with zipfile.ZipFile(path) as archive:
        parts = sorted(
            f"{i.filename} {i.file_size} {i.CRC}"
            for i in archive.infolist()
            if i.filename.startswith(("binaries/", "resources/"))
        )
    return hashlib.sha256("\n".join(parts).encode()).hexdigest()[:16]
