"""The master that the command line names, with the settings that it gives."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

from cosim.errors import NotSupported, UnknownName
from cosim.masters.error_controlled import ErrorControlled
from cosim.masters.explicit import Explicit
from cosim.masters.iterated import Iterated

MASTERS: dict[str, Callable[[Any], Any]] = {
    "explicit": lambda own: replace(own, preset="declared") if isinstance(own, Explicit) else Explicit(),
    "jacobi": lambda _: Explicit("jacobi"),
    "plain": lambda _: Explicit("plain"),
    "gauss-seidel": lambda _: Explicit("gauss_seidel"),
    "iterated": lambda own: own if isinstance(own, Iterated) else Iterated(),
    "error-controlled": lambda own: own if isinstance(own, ErrorControlled) else ErrorControlled(),
}
"""Name -> the master, of the experiment's own one; one of another kind than that is plain."""

TOLERANCE: dict[type[Any], str] = {Iterated: "tolerance", ErrorControlled: "relative"}
"""The setting that --master-tolerance is."""


def choose(
    own: Any,
    name: str | None = None,
    inputs: str | None = None,
    extrapolation: int | None = None,
    tolerance: float | None = None,
) -> Any:
    """Return an experiment's own master, or that of a name, with the settings that are given.

    Raises `UnknownName` for a name or value that there is not, `NotSupported` for a setting that the master has not.
    """
    plain = name if name is None else name.replace("_", "-")
    if plain is not None and plain not in MASTERS:
        raise UnknownName("master", plain, "--master", list(MASTERS))
    master = (own or Explicit()) if plain is None else MASTERS[plain](own)
    given: dict[str, Any] = {"inputs": inputs, "extrapolation": extrapolation}
    if tolerance is not None:
        given[TOLERANCE.get(type(master), "tolerance")] = tolerance
    given = {setting: value for setting, value in given.items() if value is not None}
    for setting in given:
        if not hasattr(master, setting):
            others = [known for known, make in MASTERS.items() if hasattr(make(None), setting)]
            what = f"the master {type(master).__name__} has no setting {setting}"
            raise NotSupported(what, f"Choose --master {' or '.join(others)}.")
    return replace(master, **given)
