"""Systems by name: a paper's experiment, or a function of a user's own file."""

import importlib.util
import os
import re
import sys
import traceback
from dataclasses import replace
from pathlib import Path
from types import ModuleType

from cosim.cli import functions
from cosim.cli.functions import NoScenario, ScenarioError
from cosim.ssp.package import is_package, is_packed
from cosim.studies import papers
from cosim.system import Experiment, System
from cosim.system.reference import Reference, is_fmu
from cosim.time import Seconds
from fmus.description.names import did_you_mean_file
from fmus.description.read import read_description
from fmus.export.build import is_component

__all__ = ["NoScenario", "Scenario", "ScenarioError", "load"]

Scenario = tuple[System, Experiment]


def load(name: str | Path, stop: Seconds | None = None, step: Seconds | None = None) -> Scenario:
    """Return the system and experiment of NAME, FILE.py[:function], FILE.ssp or FILE.fmu, which flies alone.

    The function returns (System, Experiment); it need not be named if it is the only one that needs no argument or is
    called `system`. It is given values as FILE.py:function(kp=5), Python's literals. FMU references of the file
    (FILE.py:Class, FILE.fmu) are relative to the file's folder. `stop`: the stop time of an FMU alone or of a package,
    s, instead of its own; `step`: the step of a package.
    """
    reference = os.path.expanduser(name)
    if is_fmu(reference):
        return _alone(Path(reference), stop)
    if is_package(reference):
        return _package(Path(reference), stop, step)
    if is_component(reference):
        advice = f"Look at it with adcs show {reference}, put it into one with --use INSTANCE={reference}."
        raise ScenarioError(f"{reference} is a component, needed is a system. {advice}")
    head, separator, called = reference.partition(".py:")
    if not separator and not reference.endswith(".py"):
        return papers.scenario(reference)
    path = Path(f"{head}.py" if separator else reference)
    if not os.path.isfile(path):
        raise ScenarioError(f"there is no file {path}.{did_you_mean_file(path)}")
    call = functions.parse(called, path)
    function, make = functions.find(_module(path), path, call)
    arguments = functions.bound(function, make, call, path)
    try:
        made = make(*arguments.args, **arguments.kwargs)
    except Exception as error:
        raise ScenarioError(f"{path}:{function} fails: {_told(error, path)}") from error
    if not (
        isinstance(made, tuple) and len(made) == 2 and isinstance(made[0], System) and isinstance(made[1], Experiment)
    ):
        raise ScenarioError(f"{path}:{function} returns {type(made).__name__}, needed is (System, Experiment).")
    system, experiment = made
    components = {instance: _beside(path.parent, r) for instance, r in system.components.items()}
    source = {"function": f"{path}:{function}", "arguments": dict(arguments.arguments)}
    return replace(system, components=components, source=source), experiment


def _alone(path: Path, stop: Seconds | None) -> Scenario:
    """Return a system of one FMU, its inputs held at their start values, flown as its DefaultExperiment says.

    Where that names no step, a thousand are taken. Raises `FmuError`, `ScenarioError` where it names no stop time.
    """
    description = read_description(path)
    proposed = description.default_experiment
    name = re.sub(r"\W", "_", path.stem)
    start = proposed.start or 0.0
    stop = proposed.stop if stop is None else stop
    if stop is None or stop <= start:
        after = f" after its start time {start:g} s" if stop is not None else ""
        raise ScenarioError(f"{path} has no stop time{after} in its DefaultExperiment. Give it one: --stop 10.")
    step = proposed.step_size or (stop - start) / 1000
    system = System(name=name, components={name: str(path)}, hold_unconnected=True)
    return system, Experiment(stop_time=stop, communication_step_size=step, start_time=start)


def _package(path: Path, stop: Seconds | None, step: Seconds | None) -> Scenario:
    """Return what a .ssp file holds; masters and what they need take longer to import than a name to look up."""
    from cosim.masters.error_controlled import ErrorControlled
    from cosim.masters.explicit import Explicit
    from cosim.masters.iterated import Iterated
    from cosim.ssp.read import read

    return read(path, {master.__name__: master for master in (Explicit, Iterated, ErrorControlled)}, stop, step)


def _module(path: Path) -> ModuleType:
    """Import a user's file; modules beside it can be imported from it."""
    spec = importlib.util.spec_from_file_location(f"scenario_{path.stem}", path)
    if spec is None or spec.loader is None:
        raise ScenarioError(f"{path} is no Python file.")
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module  # as an import does: a class finds its file there
    sys.path.insert(0, str(path.resolve().parent))
    try:
        spec.loader.exec_module(module)
    except Exception as error:
        raise ScenarioError(f"{path} cannot be run: {_told(error, path)}") from error
    finally:
        sys.path.pop(0)
    return module


def _told(error: Exception, file: Path) -> str:
    """Return an exception as "Type: text (file.py, line 3)", the last line in the file's folder that it passed."""
    folder, place = file.resolve().parent, ""
    for frame in traceback.extract_tb(error.__traceback__):
        path = Path(frame.filename).resolve()
        if path.is_relative_to(folder):
            place = f" ({path.relative_to(folder).as_posix()}, line {frame.lineno})"
    return f"{type(error).__name__}: {error}{place if not isinstance(error, SyntaxError) else ''}"


def _beside(folder: Path, reference: Reference) -> Reference:
    """Return a reference to a file relative to the scenario's folder as one that works from here."""
    if isinstance(reference, type):
        return reference
    if is_packed(reference):
        file, separator, rest = reference.partition("#")
        there = folder / file
        return f"{there}#{rest}" if not Path(file).is_absolute() and there.is_file() else reference
    head, separator, rest = reference.partition(".py:")
    file = Path(f"{head}.py" if separator or reference.endswith(".py") else head)
    if is_fmu(reference) or reference.endswith(".py") or separator:
        there = folder / (reference if not separator else file)
        if not file.is_absolute() and there.is_file():
            return f"{there}:{rest}" if separator else str(there)
    return reference
