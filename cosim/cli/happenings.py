"""What happens in a flight by its experiment, events and faults: checked before it, and told."""

from collections.abc import Sequence

from cosim.errors import WiringErrors
from cosim.system import Experiment, System
from cosim.system.events import resolve
from cosim.system.feeds import uncovered
from cosim.system.onsets import Onsets, times
from cosim.system.wiring import Wiring
from cosim.time import Schedule


def refuse(system: System, experiment: Experiment, wiring: Wiring) -> None:
    """Raise `WiringErrors` for events, faults and signals that could not fly."""
    schedule = Schedule.of(
        experiment.start_time,
        experiment.stop_time,
        experiment.communication_step_size,
        experiment.every,
        [*(event.time for event in experiment.events), *times(experiment, system.name)],
    )
    changes, mistakes = resolve(wiring, system, schedule, experiment.events)
    mistakes += Onsets(wiring, system, schedule, experiment.faults, changes).mistakes
    mistakes += [mistake for feed in wiring.feeds.values() for mistake in uncovered(feed, schedule)]
    if mistakes:
        raise WiringErrors(system.name, mistakes)


def lines(experiment: Experiment) -> Sequence[str]:
    """Return a line for each event and each fault."""
    events = [f"event: {event.words()}" for event in experiment.events]
    return [*events, *(f"fault: {fault.words()}" for fault in experiment.faults)]
