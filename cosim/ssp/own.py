"""What SSP has no place for, in an annotation of our own: a system and an experiment as they were declared.

    <ssc:Annotation type="org.adcs-cosim">
      <adcs:Flight xmlns:adcs="urn:adcs-cosim:ssp" version="1">
        <adcs:System>{"vehicle": ...}</adcs:System> <adcs:Experiment>{"communication_step_size": ...}</adcs:Experiment>
        <adcs:Signals>{"plant_signals": ...}</adcs:Signals>

The first two have the fields that are not the defaults, as JSON (cosim/system/declared.py); signals.py tells of
signals. The system structure stays the truth: what another tool has changed in it since wins over the annotation
(refine.py).
"""

import json
from collections.abc import Mapping
from dataclasses import fields
from typing import Any

from cosim.ssp.errors import SspError
from cosim.system import Experiment, System
from cosim.system.declared import KNOWN, changed, made, plain

TYPE, NAMESPACE, VERSION = "org.adcs-cosim", "urn:adcs-cosim:ssp", "1"


def encode(declared: System | Experiment, leave: tuple[str, ...] = ()) -> str:
    """Return the fields of a system or experiment that are not the defaults, but those to `leave` out, as JSON."""
    what = type(declared).__name__
    try:
        return json.dumps({k: plain(v, f"{what}.{k}") for k, v in changed(declared).items() if k not in leave})
    except ValueError as error:
        where, _, problem = str(error).partition(": ")
        raise SspError(where, [problem]) from error


def decode(text: str, declared: type, masters: Mapping[str, Any], file: str) -> dict[str, Any]:
    """Return the fields that `encode` has written; `masters`: class name -> class. Raises `SspError`."""
    found = parsed(text, {**KNOWN, **masters}, file)
    known = {f.name for f in fields(declared)}
    if not isinstance(found, dict) or set(found) - known:
        extra = ", ".join(sorted(set(found) - known)) if isinstance(found, dict) else "no object"
        raise SspError(file, [f"its annotation {TYPE} has in {declared.__name__} what is not known here: {extra}"])
    return found


def parsed(text: str, classes: Mapping[str, Any], file: str) -> Any:
    """Return what a part of the annotation says; `classes`: class name -> class. Raises `SspError`."""
    allowed = {
        name: maker for name, maker in classes.items() if name != "Signal"
    }  # a file that is read reads no others
    try:
        return json.loads(text, object_hook=lambda entries: made(entries, allowed))
    except (ValueError, TypeError, KeyError, ZeroDivisionError, RecursionError) as error:
        raise SspError(file, [f"its annotation {TYPE} is damaged: {error}. Without it the file is read too"]) from error
