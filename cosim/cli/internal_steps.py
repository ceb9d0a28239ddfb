"""The internal steps of a system's FMUs, for `adcs show`: what they take in the first communication step."""

from dataclasses import replace

from cosim.cli.instances import Locate
from cosim.errors import SimulationError
from cosim.flights import prepare
from cosim.system import Experiment, System
from cosim.system.wiring import Port, Wiring
from cosim.time import exact_seconds
from fmus.description.annotations import SOLVER_STEP, STEP_TAKEN


def internal_steps(system: System, experiment: Experiment, locate: Locate, wiring: Wiring) -> list[str]:
    """Return a line an instance that integrates inside, by flying one step of each.

    A system that does not get that far shows what is set.
    """
    having = [name for name, fmu in wiring.descriptions.items() if STEP_TAKEN in fmu.variables and fmu.refresh]
    if not having:
        return []
    longest = max(wiring.period(name) for name in wiring.descriptions)
    start = exact_seconds(experiment.start_time, "start_time")
    step = exact_seconds(experiment.communication_step_size, "communication_step_size")
    first = replace(experiment, stop_time=start + longest * step, every=1, stop_when="", events=(), faults=())
    try:
        taken = prepare(system, locate).fly(first, advise=False).info["internal_steps"]
    except (SimulationError, OSError) as error:
        reason = str(error).partition("\n")[0]
        return [f"  {name}: {_asked(name, wiring)}; not flown: {reason}" for name in having]
    return [f"  {name}: {taken[name]:.6g} s ({_asked(name, wiring)})" for name in having if name in taken]


def _asked(name: str, wiring: Wiring) -> str:
    start = wiring.descriptions[name].variables[SOLVER_STEP].start
    value = wiring.settings.get(Port(name, SOLVER_STEP), start)
    return "automatic" if value == 0 else f"solver.step = {value:g} s"
