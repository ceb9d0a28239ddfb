"""A signal: a time series that feeds an input, and what it is between its samples.

With knots t_i, values y_i, for t_i <= t < t_i+1:

    previous   u = y_i                               (zero-order hold)
    linear     u = y_i + (y_i+1 - y_i) / (t_i+1 - t_i) (t - t_i)                                          (1)
    cubic      the spline with continuous first and second derivatives, not-a-knot at both ends

each a polynomial c_0 + c_1 s + c_2 s^2 + c_3 s^3 of s = t - t_i.

Source: de Boor, A Practical Guide to Splines (1978), chapter IV, for the spline; scipy computes it.
"""

import hashlib
from collections.abc import Callable, Sequence
from copy import copy
from dataclasses import dataclass
from typing import Any, Literal, get_args

import numpy as np

from cosim.arrays import FloatArray
from cosim.errors import SignalError
from cosim.system import series
from cosim.system.series import Series
from cosim.time import Seconds, exact_seconds

Interpolation = Literal["linear", "previous", "cubic"]

DEGREES: dict[str, int] = {"previous": 0, "linear": 1, "cubic": 3}
"""Of the polynomial between two samples."""


@dataclass(frozen=True, init=False, eq=False)
class Signal:
    """Values at times, to feed an input: Signal("gust.csv"), Signal("gust.csv", "tau_x,tau_y,tau_z", unit="mN.m").

    `source`: a file (CSV, parquet, MATLAB), a data frame, (time, values), or a mapping with "time"; `Signal.of` takes a
    function. `column`: which, where there are several: a name, that of a whole array, or several, with commas or as a
    list. `unit`: where the header says none; None: the input's own. Times in s or as the header says, increasing.

    `time` has shape (n,), `values` (n, width), `file` and `checksum` (SHA-256) are None for what is no file.
    """

    label: str
    time: FloatArray
    values: FloatArray
    unit: str | None
    interpolation: Interpolation
    columns: tuple[str, ...]
    file: str | None
    checksum: str | None

    def __init__(
        self,
        source: object,
        column: str | Sequence[str] | None = None,
        *,
        unit: str | None = None,
        interpolation: Interpolation = "linear",
    ) -> None:
        """Read and check; raises `SignalError`."""
        found = series.read(source)
        if interpolation not in DEGREES:
            known = ", ".join(get_args(Interpolation))
            raise SignalError(found.label, f'its interpolation is "{interpolation}"', f"Choose {known}.")
        names = [n.strip() for n in column.split(",")] if isinstance(column, str) else list(column or ())
        names = _rejoined(names)
        columns = found.chosen(names)
        values = np.column_stack([c.values for _, c in columns])
        _check(found, values, [n for n, _ in columns])
        known_units = {c.unit for _, c in columns if c.unit is not None} | ({unit} if unit is not None else set())
        if len(known_units) > 1:
            raise SignalError(found.label, f"its columns have the units {', '.join(sorted(known_units))}, not one")
        time = np.ascontiguousarray(found.time)
        values = np.ascontiguousarray(values)
        time.flags.writeable = values.flags.writeable = False
        self._set(
            label=found.label,
            time=time,
            values=values,
            unit=next(iter(known_units), None),
            interpolation=interpolation,
            columns=tuple(n for n, _ in columns),
            file=str(found.file) if found.file is not None else None,
            checksum=found.checksum,
        )

    def _set(self, **fields: Any) -> None:
        for name, value in fields.items():
            object.__setattr__(self, name, value)

    @classmethod
    def of(
        cls,
        function: Callable[[float], Any],
        *,
        step: Seconds,
        stop: Seconds,
        start: Seconds = 0.0,
        unit: str | None = None,
        interpolation: Interpolation = "linear",
    ) -> "Signal":
        """Tabulate a function of time, in s, from `start` to `stop`; it returns a number or a sequence of them."""
        name = getattr(function, "__name__", "function")
        first, last, size = (exact_seconds(x, what) for x, what in ((start, "start"), (stop, "stop"), (step, "step")))
        if size <= 0 or last <= first:
            problem = f"it is tabulated from {first} s to {last} s in steps of {size} s"
            raise SignalError(f"of {name}", problem, "step must be above 0 s, and stop after start.")
        count = -((first - last) // size)
        time = np.array([float(min(first + k * size, last)) for k in range(count + 1)])
        try:
            values = np.array([np.ravel(function(float(t))) for t in time], dtype=np.float64)
        except (TypeError, ValueError) as error:
            raise SignalError(
                f"of {name}", f"its values are no numbers, or not as many at each time ({error})"
            ) from error
        return cls((time, values), unit=unit, interpolation=interpolation).named(f"of {name}")

    def named(self, label: str) -> "Signal":
        """Return the same samples as of a file of another name, for one that lies within an archive."""
        made = copy(self)
        made._set(label=label, file=label if self.file is not None else None)
        return made

    @property
    def width(self) -> int:
        """How many scalars it has."""
        return self.values.shape[1]

    @property
    def degree(self) -> int:
        """Of the polynomials between samples."""
        return DEGREES[self.interpolation]

    def coefficients(self, time: FloatArray | None = None) -> FloatArray:
        """Return c_0 to c_3 of each piece, shape (n - 1, width, 4); `time`: for knots that are a hair off."""
        t = self.time if time is None else time
        y = self.values
        found = np.zeros((len(t) - 1, self.width, 4))
        if self.interpolation == "cubic":
            from scipy.interpolate import CubicSpline

            found[:] = CubicSpline(t, y, axis=0).c[::-1].transpose(1, 2, 0)
        else:
            found[:, :, 0] = y[:-1]
            if self.interpolation == "linear":
                found[:, :, 1] = np.diff(y, axis=0) / np.diff(t)[:, None]  # (1)
        return found

    def told(self) -> dict[str, Any]:
        """Return what run.json says of it."""
        return {
            "file": self.file,
            "sha256": self.checksum or self._digest(),
            "columns": list(self.columns),
            "unit": self.unit,
            "interpolation": self.interpolation,
            "samples": len(self.time),
            "start_time": float(self.time[0]),
            "stop_time": float(self.time[-1]),
        }

    def _digest(self) -> str:
        return hashlib.sha256(self.time.tobytes() + self.values.tobytes()).hexdigest()

    def __eq__(self, other: object) -> bool:
        """Whether both are the same samples, joined in the same way."""
        if not isinstance(other, Signal):
            return NotImplemented
        mine, theirs = ((s._digest(), s.values.shape, s.unit, s.interpolation) for s in (self, other))
        return mine == theirs

    def __hash__(self) -> int:
        """Return the hash of the samples."""
        return hash((self._digest(), self.unit, self.interpolation))

    def __repr__(self) -> str:
        """What it is, how many samples, over which time."""
        over = f"{len(self.time)} samples from {self.time[0]:g} to {self.time[-1]:g} s"
        return f"<Signal {self.label}: {', '.join(self.columns)}, {over}, {self.interpolation}>"


def _rejoined(names: list[str]) -> list[str]:
    """Return names that were cut at commas whole again: "J[1", "2]" is J[1,2]."""
    whole: list[str] = []
    for name in names:
        if whole and whole[-1].count("[") > whole[-1].count("]"):
            whole[-1] += f",{name}"
        else:
            whole.append(name)
    return whole


def _check(found: Series, values: FloatArray, names: list[str]) -> None:
    """Raise `SignalError` for times that do not increase, and for what is not finite."""
    label, time = found.label, found.time
    if len(time) < 2:
        raise SignalError(label, f"it has {len(time)} sample{'s' if len(time) != 1 else ''}, at least 2 are needed")
    for name, column in [("time", time), *zip(names, values.T, strict=True)]:
        bad = np.flatnonzero(~np.isfinite(column))
        if bad.size:
            i = int(bad[0])
            raise SignalError(
                label, f"row {found.row(i)} has {column[i]} in column {name}", "Every value must be finite."
            )
    bad = np.flatnonzero(np.diff(time) <= 0)
    if bad.size:
        i = int(bad[0])
        problem = f"row {found.row(i + 1)} is at {time[i + 1]:.12g} s, row {found.row(i)} at {time[i]:.12g} s"
        raise SignalError(label, problem, "Times must increase from row to row; a jump takes two rows, a little apart.")
