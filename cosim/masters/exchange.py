"""What an exchange is called: the settings of a master that are not those that it has without a word."""

from dataclasses import MISSING, fields
from typing import Any


def name_of(master: Any) -> str:
    """Return the settings of a master as one writes them, without `kernel`: "Explicit(preset='jacobi')"."""
    told: list[str] = []
    for field in fields(master):
        default = field.default_factory() if field.default_factory is not MISSING else field.default
        value = getattr(master, field.name)
        if field.name != "kernel" and value != default:  # both loops give the same bits
            told.append(f"{field.name}={value!r}")
    return f"{type(master).__name__}({', '.join(told)})"
