"""One FMU in this project and in fmpy, with one `Setup`; each returns columns by the names of elements.

fmpy's own loop sums up its times (t0 + n h in doubles); with `exact` it is told those of this project instead, which
tells what is due to the last bit of a time from what is not.
"""

import re
import shutil
from collections.abc import Callable, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

import fmpy
import numpy as np
from fmpy.build import build_platform_binary
from fmpy.simulation import instantiate_fmu, simulate_fmu
from setup import Setup, described

from cosim import Experiment, System
from cosim.errors import SimulationError
from cosim.flights import simulate
from cosim.slaves.opening import open_fmu
from fmus.description.names import canonical
from fmus.description.read import read_description

Columns = Mapping[str, np.ndarray]

LONGEST = 400
"""How much of an error's words is kept."""


def ours(path: Path, told: Setup) -> Columns:
    """Fly an FMU alone, its inputs held at their start values; what is recorded up to the end that it asks for."""
    about = read_description(path)
    named = [name for name in told.record if canonical(name) in about.groups or canonical(name) in about.variables]
    system = System(name="survey", components={"a": str(path)}, hold_unconnected=True)
    experiment = Experiment(
        start_time=told.start,
        stop_time=told.stop,
        communication_step_size=told.step,
        tolerance=told.tolerance,
        announce_stop_time=True,
        record=[f"a.{name}" for name in named] or ["*"],
    )
    result = simulate(system, experiment)
    table = result.table
    columns = {name.removeprefix("a."): table[name].to_pylist() for name in table.column_names}
    return {name: np.array(v, dtype=None if isinstance(v[0], str) else float) for name, v in columns.items()}


def opened(path: Path) -> None:
    """Load an FMU, to hear why it cannot be."""
    open_fmu("a", path)


def by_fmpy(path: Path, told: Setup, *, exact: bool = False, inputs: bool = False, validate: bool = True) -> Columns:
    """Fly an FMU in fmpy's loop; `exact`: at this project's times, `inputs`: with its inputs set at each step."""
    about = described(path, validate=validate)
    folder = fmpy.extract(str(path))
    if fmpy.platform not in fmpy.supported_platforms(str(path)):
        Path(folder, "build").mkdir()
        build_platform_binary(folder, build_dir=Path(folder, "build"), generator="Unix Makefiles")
    kind = "CoSimulation" if about.coSimulation is not None else "ModelExchange"
    slave = instantiate_fmu(folder, about, kind)
    if exact and kind == "CoSimulation":
        slave.doStep = _at(told, slave.doStep)
    found = simulate_fmu(
        folder,
        validate=validate,
        start_time=told.start,
        stop_time=told.stop,
        output_interval=told.step,
        relative_tolerance=told.tolerance,
        record_events=False,
        model_description=about,
        fmu_instance=slave,
        output=list(told.record),
        input=_held(path) if inputs else None,
    )
    with suppress(Exception):
        slave.freeInstance()
    shutil.rmtree(folder, ignore_errors=True)
    return {name: values for key in found.dtype.names for name, values in _elements(key, np.asarray(found[key]))}


def _at(told: Setup, step: Callable[..., Any]) -> Callable[..., Any]:
    """fmpy's `doStep`, at the times of the setup."""
    times, ends = iter(told.times), iter(told.times[1:])

    def do_step(currentCommunicationPoint: float, communicationStepSize: float, **more: Any) -> Any:
        t = next(times)
        return step(currentCommunicationPoint=t, communicationStepSize=next(ends) - t, **more)

    return do_step


def _held(path: Path) -> np.ndarray | None:
    """The start values of an FMU's inputs, as fmpy takes signals."""
    kinds: dict[str, Any] = {"Real": float, "Integer": np.int32, "Enumeration": np.int32, "Boolean": np.bool_}
    held = [v for v in read_description(path).inputs if v.type in kinds]
    if not held:
        return None
    row = (0.0, *(v.start if v.start is not None else 0 for v in held))
    return np.array([row], dtype=[("time", float), *((v.name, kinds[v.type]) for v in held)])


def _elements(name: str, values: np.ndarray) -> list[tuple[str, np.ndarray]]:
    """Columns of an array of FMI 3.0, element by element, indices from 1."""
    if values.ndim == 1:
        return [(name, values.astype(float))]
    places = np.ndindex(values.shape[1:])
    return [(f"{name}[{','.join(str(i + 1) for i in at)}]", values[:, *at].astype(float)) for at in places]


def words(error: BaseException) -> str:
    """What an error says, in one line; of a run that ended early, how far it came."""
    result = getattr(error, "result", None)
    reached = f" (at {result.time[-1]:g} s)" if isinstance(error, SimulationError) and result is not None else ""
    said = re.sub(r"/\S*/", "", " ".join(str(error).split()))  # no folders
    return f"{type(error).__name__}: {said[:LONGEST]}{reached}"
