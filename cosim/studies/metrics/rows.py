"""Rows of a result as arrays, and how long each row stands."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from cosim.arrays import FloatArray
from cosim.results.result import Result

if TYPE_CHECKING:
    from numpy.typing import ArrayLike
    from scipy.spatial.transform import Rotation


def series(run: Result, name: str) -> FloatArray | None:
    """Return the rows of a variable, or None if it was not recorded."""
    return run[name] if name in run else None


def first(run: Result, *names: str) -> FloatArray | None:
    """Return the rows of the first variable of `names` that was recorded."""
    return next((rows for name in names if (rows := series(run, name)) is not None), None)


def settings(run: Result, name: str, otherwise: "ArrayLike" = ()) -> list[float]:
    """Return the elements of a parameter as a run flew it, in its FMU's unit; `otherwise`: where run.json has none."""
    parameters: Mapping[str, Any] = run.info.get("parameters") or {}
    found = [v["value"] for key, v in parameters.items() if key == name or key.startswith(f"{name}[")]
    return [float(v) for v in found] or [float(v) for v in np.atleast_1d(np.asarray(otherwise, float))]


def rotations(quaternions: FloatArray) -> "Rotation":
    """Return scalar-first quaternions q_BN as rotations v_N = q_BN (x) v_B (x) q_BN*."""
    from scipy.spatial.transform import Rotation  # slow to import

    return Rotation.from_quat(quaternions, scalar_first=True)


def spans(t: FloatArray) -> FloatArray:
    """Return the time that each row stands for (trapezoidal rule), so that rows may be unevenly spaced."""
    half = np.diff(t) / 2
    return np.concatenate([half, [0.0]]) + np.concatenate([[0.0], half])
