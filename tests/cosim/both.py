"""The same flight in the kernel and in the Python loop."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from cosim import flights
from cosim.errors import SimulationError
from cosim.masters.explicit import Explicit
from cosim.results.result import Result
from cosim.results.schema import to_numpy
from cosim.system import Connection, Experiment, System

LOOPS = ("always", "never")
"""Settings of `Explicit.kernel`: fly in the kernel, fly in Python."""


def of(fmus: Mapping[str, Path], connections: Sequence[tuple], **system: Any) -> System:
    """A system of FMU files; connections are (source, target) or (source, target, timing)."""
    components = {name: str(path) for name, path in fmus.items()}
    return System(name="test", components=components, connections=[Connection(*c) for c in connections], **system)


def experiment(stop=1.0, step=0.1, loop="always", **more: Any) -> Experiment:
    """An experiment; settings of `Explicit` by their names."""
    master = {name: more.pop(name) for name in ("preset", "inputs", "extrapolation") if name in more}
    return Experiment(stop_time=stop, communication_step_size=step, master=Explicit(kernel=loop, **master), **more)


def fly(system: System, setup: Experiment | None = None, **more: Any) -> Result:
    """Fly in both loops; the tables must be equal bit by bit. Returns the kernel's result."""
    setup = setup or experiment(**more)
    kernel, python = (_flown(system, setup, loop) for loop in LOOPS)
    assert kernel.info["loop"]["name"] == "kernel" and python.info["loop"]["name"] == "python"
    assert_same(kernel, python)
    return kernel


def failure(kind: type[SimulationError], system: System, setup: Experiment | None = None, **more: Any):
    """Fly in both loops; both must end with the same error and keep the same rows. Returns the kernel's error."""
    setup = setup or experiment(**more)
    errors: list[Any] = []
    for loop in LOOPS:
        with pytest.raises(kind) as caught:
            _flown(system, setup, loop)
        errors.append(caught.value)
    assert str(errors[0]) == str(errors[1])
    results = [getattr(error, "result", None) for error in errors]
    assert (results[0] is None) == (results[1] is None)
    if results[0] is not None:
        assert_same(*results)
    return errors[0]


def assert_same(one: Result, other: Result) -> None:
    """The tables of two results are equal bit by bit, what is not a number included."""
    assert one.table.schema.equals(other.table.schema, check_metadata=True)
    for name in one.table.column_names:
        a, b = to_numpy(one.table[name]), to_numpy(other.table[name])
        assert (a.tolist() == b.tolist()) if a.dtype == object else (a.tobytes() == b.tobytes()), name


def _flown(system: System, setup: Experiment, loop: str) -> Result:
    master = setup.master or Explicit()
    return flights.simulate(system, replace(setup, master=replace(master, kernel=loop)))
