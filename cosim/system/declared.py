"""Systems and experiments as plain data, which JSON writes and reads: the fields that are not the defaults.

What JSON does not know is an object of one entry, {"!Value": ...}, whose name is that of its class in `KNOWN`, or of a
master, which this floor does not know.
"""

import base64
import math
from collections.abc import Callable, Mapping
from dataclasses import MISSING, fields, is_dataclass
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np

from cosim.errors import SignalError
from cosim.system.fault import Fault
from cosim.system.signal import Signal
from cosim.system.system import At, Connection
from cosim.system.value import Value


def changed(declared: Any) -> dict[str, Any]:
    """Return the fields of a dataclass that are given and are not the defaults."""
    found: dict[str, Any] = {}
    for f in fields(declared):
        usual = f.default_factory() if f.default_factory is not MISSING else f.default
        value = getattr(declared, f.name)
        if f.init and (value != usual or type(value) is not type(usual)):
            found[f.name] = value
    return found


def plain(value: Any, where: str) -> Any:
    """Return a value of a system or experiment as JSON has it; raises ValueError, with `where`, for what it has not."""
    if isinstance(value, np.generic):
        coarse = isinstance(value, np.floating) and value.itemsize < 8  # float32, float16: the decimal that is meant
        value = Fraction(str(value)) if coarse else value.item()
    if isinstance(value, float) and not math.isfinite(value):
        return {"!float": str(value)}
    if value is None or isinstance(value, bool | int | float | str):
        return value
    if isinstance(value, Mapping):
        if any(not isinstance(key, str) or key.startswith("!") for key in value):
            raise ValueError(f"{where}: its names cannot be written")
        return {key: plain(v, where) for key, v in value.items()}
    if isinstance(value, list | tuple):
        return [plain(v, where) for v in value]
    if isinstance(value, Fraction):
        return {"!Fraction": str(value)}
    if isinstance(value, Value) and value.text is not None:
        bare = Value(value.text) == value
        return {"!Value": {"value": value.text if bare else f'"{value.text}"'}}
    if isinstance(value, Signal):
        return {"!Signal": _written(value)}
    if is_dataclass(value) and not isinstance(value, type):
        return {f"!{type(value).__name__}": plain(changed(value), where)}
    raise ValueError(f"{where}: a {type(value).__name__} cannot be written")


def made(entries: dict[str, Any], classes: Mapping[str, Callable[..., Any]]) -> Any:
    """Return what an object of JSON stands for, for `json.loads`; raises KeyError for a class that is not known."""
    name = next(iter(entries)) if len(entries) == 1 else ""
    if not name.startswith("!"):
        return entries
    make, given = classes[name[1:]], entries[name]
    return make(**given) if isinstance(given, dict) else make(given)


def _written(signal: Signal) -> dict[str, Any]:
    """Return where the samples of a signal lie, or the samples themselves of one that is of no file."""
    said = {"columns": list(signal.columns), "unit": signal.unit, "interpolation": signal.interpolation}
    if signal.file is not None:
        return {**said, "file": str(Path(signal.file).absolute()), "checksum": signal.checksum}
    rows = np.column_stack([signal.time, signal.values]).astype("<f8")
    return {**said, "label": signal.label, "rows": base64.b64encode(rows.tobytes()).decode()}


def _signal(
    *, columns: list[str], unit: str | None, interpolation: Any, file: str = "", checksum: str = "", rows: str = "",
    label: str = "",
) -> Signal:  # fmt: skip
    """Return the signal that `_written` wrote; raises `SignalError` where its file has changed."""
    if not file:
        table = np.frombuffer(base64.b64decode(rows), "<f8").reshape(-1, 1 + len(columns)).astype(np.float64)
        samples = {"time": table[:, 0]} | {name: table[:, 1 + i] for i, name in enumerate(columns)}
        return Signal(samples, columns, unit=unit, interpolation=interpolation).named(label)
    signal = Signal(file, columns, unit=unit, interpolation=interpolation)
    if signal.checksum != checksum:
        problem = f"{file} has changed: its SHA-256 is {signal.checksum}, when the run began it was {checksum}"
        raise SignalError(signal.label, problem, "Put the file back as it was, or fly anew.")
    return signal


KNOWN: Mapping[str, Callable[..., Any]] = {
    "At": At, "Connection": Connection, "Fault": Fault, "Fraction": Fraction, "Signal": _signal, "Value": Value,
    "float": float,
}  # fmt: skip
"""Classes within systems and experiments."""
