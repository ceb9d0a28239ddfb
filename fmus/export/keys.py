"""The key of a built FMU: the hash of all that it was made from. Reads files, imports no component, builds nothing.

What the FMU is made from: the component's source files, found by reading their imports; the files that its code read
when it was built (reads.py); this package, which makes it; the reference, its structure and values; the versions of the
libraries; the compiler.
"""

import hashlib
from collections.abc import Mapping, Sequence
from functools import cache
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from fmus.errors import BuildError
from fmus.export.references import Reference
from fmus.export.sources import content, own_files
from fmus.toolchain import compiler_name

LIBRARIES = ("casadi", "fmpy", "pythonfmu")


def key_of(
    reference: Reference, name: str, backend: str, platforms: Sequence[str], values: Mapping[str, Any] | None
) -> str:
    """Return the key of the FMU `name` of a reference, but for what its code reads; values: built-in start values."""
    tool = compiler_name() if backend == "native" else ""
    plain: dict[str, Any] = {}
    if values:
        import numpy as np  # here, for listing what there is must not wait for it

        plain = {variable: np.asarray(value).tolist() for variable, value in values.items()}
    sources = reference.sources()
    what = [backend, list(platforms), name, sources.module, reference.name, reference.structure, plain, tool]
    parts = [repr(what), _libraries(), _exporter()]
    parts += [f"{relative} {_hash(file)}" for relative, file in sources.files.items()]
    return hashlib.sha256("\n".join(parts).encode()).hexdigest()


def with_reads(key: str, reads: Mapping[str, str | None]) -> str:
    """Return the key of an FMU whose component's code reads files; without any it stays as it is."""
    return hashlib.sha256(repr((key, sorted(reads.items()))).encode()).hexdigest() if reads else key


@cache
def _libraries() -> str:
    return " ".join(_version(name) for name in LIBRARIES)


def _version(library: str) -> str:
    """Return name and version of a library, from the folder that pip has written beside it.

    importlib.metadata says the same, but its import takes as long as all else here.
    """
    spec = find_spec(library)
    beside = Path(spec.origin).parents[1] if spec is not None and spec.origin else None
    if beside is None:
        raise BuildError(f"the package {library} is not installed: pip install {library}.")
    found = sorted(folder.name for folder in beside.glob(f"{library}-*.dist-info"))
    return " ".join(found) or f"{library} {Path(beside, library, '__init__.py').stat().st_mtime_ns}"


@cache
def _exporter() -> str:
    return " ".join(_hash(file) for file in own_files("fmus"))


def _hash(file: Path) -> str:
    return _hash_of(content(file))


@cache  # by the content: components share most of their files
def _hash_of(data: bytes) -> str:
    return hashlib.sha256(data).hexdigest()
