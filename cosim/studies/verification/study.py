"""adcs verify: the same flight at h, h/2, h/4, its order and error, and on request the largest step that flies."""

import json
import math
import time
from collections.abc import Mapping, Sequence
from contextlib import nullcontext
from dataclasses import asdict, dataclass, replace
from fractions import Fraction
from pathlib import Path
from typing import Any

from cosim.errors import NotSupported
from cosim.flights import Locate, Prepared, Progress, prepare
from cosim.masters.error_controlled import ErrorControlled
from cosim.masters.exchange import name_of
from cosim.masters.explicit import Explicit
from cosim.results.folder import finite, make_folder, write_text
from cosim.results.sizes import sizes, unlike
from cosim.studies import roles
from cosim.studies.verification.convergence import Convergence, converge
from cosim.studies.verification.limit import FEWEST, INTERRUPTED, Limit, largest_step
from cosim.studies.verification.trial import Trial, fly
from cosim.system import Experiment, System
from cosim.system.wiring import Wiring
from cosim.time import Schedule, exact_seconds, in_words, written
from fmus.description.names import split_element

FILE = "verification.json"
FLIGHTS, MOST = 3, 4
"""Flights that are compared, and how many are flown where the coarsest one diverges."""

TRIAL_ROWS = 100


@dataclass(frozen=True)
class Verification:
    """Flights at h, h/2, h/4 (and h/8 where the first diverges), and the variables compared over the finest three.

    `compared`: their steps, s, the coarsest first: errors are those of the flight at the first of them.
    """

    system: str
    exchange: str
    stop_time: float
    trials: tuple[Trial, ...]
    compared: tuple[Fraction, ...]
    variables: tuple[Convergence, ...]
    limit: Limit | None = None

    @property
    def complete(self) -> bool:
        """Whether nothing was interrupted."""
        searched = self.limit is None or self.limit.remark != INTERRUPTED
        return searched and not any(trial.interrupted for trial in self.trials)

    def write(self, folder: Path) -> Path:
        """Write verification.json, steps as texts; raises `ResultUnwritable`."""
        content = {
            "system": self.system,
            "exchange": self.exchange,
            "stop_time": self.stop_time,
            "flights": [_plain(t) for t in self.trials],
            "compared": [written(step) for step in self.compared],
            "variables": [{k: finite(v) for k, v in asdict(v).items()} for v in self.variables],
            "limit": None if self.limit is None else _plain(self.limit),
        }
        make_folder(folder)
        write_text(folder / FILE, json.dumps(content, indent=2, allow_nan=False) + "\n")
        return folder / FILE


def verify(
    system: System | Prepared,
    experiment: Experiment,
    *,
    locate: Locate | None = None,
    parameters: Mapping[str, Any] | None = None,
    search: float | None = None,
    progress: Progress | None = None,
) -> Verification:
    """Fly an experiment at its step and at finer ones, and compare what its plants show, else all connected outputs.

    `search`: look for the largest step that flies too, for so many seconds of wall time. `locate`, `parameters`,
    `progress`: as in `prepare` and `Prepared.fly`. Ctrl-C ends it with what was flown. Raises what `Prepared.fly`
    raises before the first step at the experiment's own step, and `NotSupported` where there is nothing to compare.
    """
    if search is not None and not search > 0:
        raise NotSupported(f"a search of {search:g} s", "Give it some time: search=60.0, --limit-time 60s.")
    master = experiment.master if experiment.master is not None else Explicit()
    if isinstance(master, ErrorControlled):
        what = "ErrorControlled chooses its own steps, of which the communication step tells nothing"
        raise NotSupported(what, "Choose --master explicit or iterated (Explicit(), Iterated()).")
    with nullcontext(system) if isinstance(system, Prepared) else prepare(system, locate) as prepared:
        names = compared(prepared.wiring)
        setup = replace(experiment, record=names)
        trials = _refined(prepared, setup, parameters, progress)
        good = [trial for trial in trials if trial.finished][-FLIGHTS:]
        runs = [trial.result for trial in good if trial.result is not None]
        schedule = _schedule(setup, good[-1].step if good else trials[0].step)
        tolerance = float(getattr(master, "tolerance", 0.0))
        variables = converge(runs, names, schedule.steps, tolerance) if len(runs) > 1 else []
        found = Verification(
            prepared.system.name,
            name_of(master),
            float(experiment.stop_time),
            tuple(trials),
            tuple(trial.step for trial in good),
            tuple(variables),
        )
        if search is None or not found.complete:
            return found
        return replace(found, limit=_limit(prepared, setup, parameters, trials, search, progress))


def compared(wiring: Wiring) -> list[str]:
    """Return the arrays and scalars that are compared: the plants' outputs, without a plant the connected ones."""
    role = roles.of_descriptions(wiring.descriptions)
    plants = [name for name in wiring.components if role.get(name) == "plant"]
    if plants:
        names = [f"{plant}.{base}" for plant in plants for base in _real_outputs(wiring, plant)]
    else:
        connected = [f"{k.source.component}.{split_element(k.source.variable)[0]}" for k in wiring.links]
        real = {f"{name}.{base}" for name in wiring.components for base in _real_outputs(wiring, name)}
        names = [name for name in dict.fromkeys(connected) if name in real]
    if not names:
        raise NotSupported("nothing to compare: no plant, and no connected output that is a Real", "Connect one.")
    return names


def _real_outputs(wiring: Wiring, component: str) -> list[str]:
    description = wiring.descriptions[component]
    return [
        base
        for base, group in description.groups.items()
        if description.variables[group.elements[0]].causality == "output"
        and description.variables[group.elements[0]].type == "Real"
    ]


def _refined(
    prepared: Prepared, setup: Experiment, parameters: Mapping[str, Any] | None, progress: Progress | None
) -> list[Trial]:
    """Return flights at h, h/2, ... until three have come to their end, four at most; all record the same rows."""
    first = exact_seconds(setup.communication_step_size, "communication_step_size")
    trials: list[Trial] = []
    for n in range(MOST):
        trials.append(fly(prepared, replace(setup, every=setup.every * 2**n), first / 2**n, parameters, progress))
        if n > 0:
            trials[-2] = _judged(trials[-2], trials[-1])
        if n == 0 and trials[0].result is None and trials[0].failure is not None:
            raise trials[0].failure  # what cannot be flown as it is
        if trials[-1].interrupted or sum(trial.finished for trial in trials) == FLIGHTS:
            break
    return trials


def _limit(
    prepared: Prepared,
    setup: Experiment,
    parameters: Mapping[str, Any] | None,
    trials: Sequence[Trial],
    search: float,
    progress: Progress | None,
) -> Limit:
    """Search the largest step that flies, by comparing with the finest flight that another one agrees with."""
    good = [trial for trial in trials if trial.finished]
    if len(good) < 2:
        return Limit(None, None, "", "no two flights agree in size to compare with: begin at a shorter step", 0)
    deadline = time.monotonic() + search
    span = exact_seconds(setup.stop_time, "stop_time") - exact_seconds(setup.start_time, "start_time")

    def attempt(step: Fraction) -> Trial:
        every = max(1, math.ceil(span / step / TRIAL_ROWS))
        trial = fly(prepared, replace(setup, every=every), step, parameters, progress, deadline)
        return _judged(trial, good[-1])

    coarser = [trial for trial in trials if trial.step > good[0].step and trial.result is not None]
    return largest_step(attempt, good[0].step, coarser[-1] if coarser else None, span / FEWEST)


def _judged(trial: Trial, finer: Trial) -> Trial:
    """Return a flight as one that did not finish where it differs in size from one at a shorter step that did."""
    if not (trial.finished and finer.finished and trial.result is not None and finer.result is not None):
        return trial
    own, others = sizes(trial.result), sizes(finer.result)
    name = unlike(own, others)
    if not name:
        return trial
    words = f"diverges: {name} reaches {own[name]:.3g}, at {in_words(finer.step)} {others[name]:.3g}"
    return replace(trial, finished=False, ended=words)


def _schedule(setup: Experiment, step: Fraction) -> Schedule:
    return Schedule.of(setup.start_time, setup.stop_time, step, setup.every)


def _plain(thing: Trial | Limit) -> dict[str, Any]:
    """Return fields ready for JSON, without the result."""
    values = {k: v for k, v in vars(thing).items() if k not in ("result", "failure")}
    return {k: written(v) if isinstance(v, Fraction) else finite(v) for k, v in values.items()}
