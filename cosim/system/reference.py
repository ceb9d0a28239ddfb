"""What names an FMU in a system: FILE.fmu, NAME or FILE.py:Class as a text, a path, or a class.

Here it is only told apart and written down. Whoever locates FMUs knows what a name or a class stands for.
"""

import os
import sys
from pathlib import Path
from typing import TypeGuard

from cosim.errors import WiringError

Reference = str | type


def reference_of(given: object, name: str = "") -> Reference:
    """Return a reference as a text, "~" expanded, or as the class that it is; raises `WiringError` for all else."""
    if isinstance(given, type):
        return given
    if isinstance(given, str | Path):
        return os.path.expanduser(given)
    where = f"component {name}" if name else "a component"
    problem = f"{where} is {type(given).__name__} {given!r:.80}, which names no FMU"
    raise WiringError(problem, "Give FILE.fmu, NAME:modes=6, FILE.py:Class, a Path, or a component's class.")


def is_fmu(reference: object) -> TypeGuard[str]:
    """Whether a reference is the file of an FMU, its suffix in small letters or not."""
    return isinstance(reference, str) and reference.lower().endswith(".fmu")


def name_of(reference: Reference) -> str:
    """Return a reference as text: FILE.py:Class for a class of a file, module.Class for one of a package."""
    if isinstance(reference, str):
        return reference
    file = getattr(sys.modules.get(reference.__module__), "__file__", None)
    alone = file is not None and "." not in reference.__module__
    return f"{file}:{reference.__qualname__}" if alone else f"{reference.__module__}.{reference.__qualname__}"
