"""What SSP has no place for, in an annotation of our own: a system and an experiment as they were declared.

    <ssc:Annotation type="org.adcs-cosim">
      <adcs:Flight xmlns:adcs="urn:adcs-cosim:ssp" version="1">
        <adcs:System>{"vehicle": ...}</adcs:System> <adcs:Experiment>{"communication_step_size": ...}</adcs:Experiment>
        <adcs:Signals>{"plant_signals": ...}</adcs:Signals>

The first two have the fields that are not the defaults, as JSON; signals.py tells of signals. What JSON does not know
is an object of one entry, {"!Value": ...}, whose name is that of its class. The system structure stays the truth: what
another tool has changed in it since wins over the annotation (refine.py).
"""

import json
from collections.abc import Mapping
from dataclasses import MISSING, fields, is_dataclass
from fractions import Fraction
from typing import Any

from cosim.ssp.errors import SspError
from cosim.system import At, Connection, Experiment, System, Value

TYPE, NAMESPACE, VERSION = "org.adcs-cosim", "urn:adcs-cosim:ssp", "1"

KNOWN: Mapping[str, Any] = {"Value": Value, "Connection": Connection, "At": At, "Fraction": Fraction}
"""Classes within systems and experiments; masters are given, as this floor does not know them."""


def encode(declared: System | Experiment, leave: tuple[str, ...] = ()) -> str:
    """Return the fields of a system or experiment that are not the defaults, but those to `leave` out, as JSON."""
    what = type(declared).__name__
    return json.dumps({k: _plain(v, f"{what}.{k}") for k, v in _changed(declared).items() if k not in leave})


def decode(text: str, made: type, masters: Mapping[str, Any], file: str) -> dict[str, Any]:
    """Return the fields that `encode` has written; `masters`: class name -> class. Raises `SspError`."""
    found = parsed(text, {**KNOWN, **masters}, file)
    known = {f.name for f in fields(made)}
    if not isinstance(found, dict) or set(found) - known:
        extra = ", ".join(sorted(set(found) - known)) if isinstance(found, dict) else "no object"
        raise SspError(file, [f"its annotation {TYPE} has in {made.__name__} what is not known here: {extra}"])
    return found


def parsed(text: str, classes: Mapping[str, Any], file: str) -> Any:
    """Return what a part of the annotation says; `classes`: class name -> class. Raises `SspError`."""
    try:
        return json.loads(text, object_hook=lambda entries: _object(entries, classes))
    except (ValueError, TypeError, KeyError, ZeroDivisionError, RecursionError) as error:
        raise SspError(file, [f"its annotation {TYPE} is damaged: {error}. Without it the file is read too"]) from error


def _changed(declared: Any) -> dict[str, Any]:
    """Return the fields of a dataclass that are given and are not the defaults."""
    found: dict[str, Any] = {}
    for f in fields(declared):
        usual = f.default_factory() if f.default_factory is not MISSING else f.default
        value = getattr(declared, f.name)
        if f.init and (value != usual or type(value) is not type(usual)):
            found[f.name] = value
    return found


def _plain(value: Any, where: str) -> Any:
    if value is None or isinstance(value, bool | int | float | str):
        return value
    if isinstance(value, Mapping):
        if any(not isinstance(key, str) or key.startswith("!") for key in value):
            raise SspError(where, ["its names cannot be written"])
        return {key: _plain(v, where) for key, v in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(v, where) for v in value]
    if isinstance(value, Fraction):
        return {"!Fraction": str(value)}
    if isinstance(value, Value) and value.text is not None:
        bare = Value(value.text) == value
        return {"!Value": {"value": value.text if bare else f'"{value.text}"'}}
    if is_dataclass(value) and not isinstance(value, type):
        return {f"!{type(value).__name__}": _plain(_changed(value), where)}
    raise SspError(where, [f"a {type(value).__name__} cannot be written"])


def _object(entries: dict[str, Any], classes: Mapping[str, Any]) -> Any:
    name = next(iter(entries)) if len(entries) == 1 else ""
    if not name.startswith("!"):
        return entries
    made, given = classes[name[1:]], entries[name]
    return made(**given) if isinstance(given, dict) else made(given)
