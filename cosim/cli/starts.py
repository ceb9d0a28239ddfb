"""What FMUs for other tools say of the start and the experiment of the system that they are of.

Many tools exchange nothing in initialization mode: connected inputs have as start values what is connected to them.
"""

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING

from cosim.cli.library import Library
from cosim.errors import SimulationError
from cosim.flights import simulate
from cosim.masters.explicit import Explicit
from cosim.system import Experiment, System
from cosim.system.wiring import Port, Wiring
from cosim.time import exact_seconds
from fmus.description.description import DefaultExperiment, Scalar

if TYPE_CHECKING:
    from cosim.results.result import Result


def started(system: System, experiment: Experiment, locate: Library) -> "Result":
    """Return a flight of one step, whose first row is the start; the step itself may fail.

    Raises `SimulationError` where the system does not start.
    """
    start, step = (
        exact_seconds(seconds, name)
        for seconds, name in (
            (experiment.start_time, "start_time"),
            (experiment.communication_step_size, "communication_step_size"),
        )
    )
    brief = replace(experiment, stop_time=start + step, master=Explicit(), record=("*",), stop_when="", every=1)
    brief = replace(brief, events=(), faults=())  # of later times
    try:
        return simulate(system, brief, locate=locate, advise=False)
    except SimulationError as error:
        if error.result is None or not len(error.result):
            raise
        return error.result


def of_inputs(wiring: Wiring, result: "Result") -> Mapping[Port, Scalar]:
    """Return the values of the connected inputs in the first row."""
    recorded = set(result.table.column_names)
    found = (link.target for link in wiring.links if str(link.target) in recorded)
    return {target: result.table.column(str(target))[0].as_py() for target in found}


def unknown(error: SimulationError) -> str:
    """Say that the inputs have none."""
    return f"connected inputs have no start values in it, for the system does not start here: {error}"


def default_experiment(experiment: Experiment, steps: int) -> DefaultExperiment:
    """Return what the FMU of an instance that steps every so many communication steps proposes."""
    step = float(experiment.communication_step_size) * steps
    start, stop = float(experiment.start_time), float(experiment.stop_time)
    return DefaultExperiment(start=start, stop=stop, tolerance=experiment.tolerance, step_size=step)
