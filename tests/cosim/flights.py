"""A few fakes, connected and flown, in one call."""

from cosim import simulate
from cosim.masters.explicit import Explicit
from cosim.results.result import Result
from cosim.system import Connection, Experiment, System


def run(
    slaves,
    connections,
    stop=1.0,
    step=0.1,
    *,
    master=None,
    held=None,
    steps=None,
    out=None,
    overwrite=False,
    **experiment,
) -> Result:
    """Simulate fakes; connections are (source, target) or (source, target, timing)."""
    system = System(
        name="test",
        components=dict.fromkeys((s.name for s in slaves), "fake"),
        connections=[Connection(*c) for c in connections],
        held=held or {},
        steps=steps or {},
    )
    setup = Experiment(
        stop_time=stop, communication_step_size=step, master=master or Explicit(kernel="never"), **experiment
    )
    return simulate(system, setup, slaves={s.name: s for s in slaves}, out=out, overwrite=overwrite)
