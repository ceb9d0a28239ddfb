"""A component becomes an FMI 2.0 co-simulation FMU: interpreted (pythonfmu) or native (C).

`build(component, path, backend)` writes one, `BuildError` is what it raises; both are imported when they are asked for.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from fmus.errors import BuildError
    from fmus.export.build import build

__all__ = ["BuildError", "build"]

_HOMES = {"BuildError": "fmus.errors", "build": "fmus.export.build"}


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(_HOMES[name]), name)
