"""Random faults, events, timings, rates and masters: both loops fly to one table, and so does a run that goes on.

python tests/benchmarks/fuzz_faults.py [COUNT [FIRST SEED]]
"""

import random
import shutil
from dataclasses import replace
from fractions import Fraction
from pathlib import Path
from typing import Any

from cosim import (
    At,
    Connection,
    ErrorControlled,
    Experiment,
    Explicit,
    Fault,
    Iterated,
    Library,
    System,
    prepare,
    resume,
)
from cosim.errors import NotSupported, WiringErrors
from tests.cosim import both
from tests.cosim.oscillator import Damper, Mass, SampledDamper
from tests.cosim.passing import Level, Passer

STOP = 2.0
EARLY = 1.2
"""A stop time, s, at which no slow component is within a step, and a row is due."""
TIMES = [0.0, 0.1, 0.2, 0.4, 0.5, 0.8, 1.0, 1.2, 1.6, 0.333, Fraction(1, 3), 0.777]
VALUES: dict[Any, Any] = {
    "bias": 0.3, "scale": -1.5, "stuck": 0.2, "dropout": None, "delay": 3, "noise": 0.1, "quantisation": 0.25,
}  # fmt: skip
MASTERS = [
    Explicit(),
    Explicit("jacobi"),
    Explicit("gauss_seidel"),
    Explicit("plain"),
    Explicit(inputs="smooth", extrapolation=1),
    Iterated("ramp"),
    Iterated(),
    ErrorControlled(1e-5),
]


class Cut(Exception):
    """Ends a run at a checkpoint."""


def a_system(chance: random.Random) -> System:
    """An oscillator of two units, maybe with two that pass values on, in any order."""
    first = chance.choice(["at_point", "after_step", "midpoint", "ramp", "smooth"])
    second = chance.choice(["at_point", "after_step"]) if first == "at_point" else "at_point"
    components: dict[str, Any] = {"mass": Mass, "damper": chance.choice([Damper, Damper, SampledDamper])}
    connections = [Connection("mass.v", "damper.v", first), Connection("damper.f", "mass.f", second)]
    if chance.random() < 0.5:
        components |= {"passer": Passer, "level": Level}
        for source, target in (("mass.v", "passer.now"), ("level.y", "passer.later")):
            connections.append(Connection(source, target, chance.choice(["at_point", "after_step"])))
    names = chance.sample([*components], len(components))
    return System(
        name="random",
        components={name: components[name] for name in names},
        connections=connections,
        steps={chance.choice(names): chance.choice([2, 4])} if chance.random() < 0.25 else {},
    )


def a_fault(chance: random.Random, system: System, latest: float) -> Fault:
    """One that begins before the latest time and ends by it, or not at all."""
    possible = [time for time in TIMES if time < latest]
    begin, end = chance.choice(possible), chance.choice([None, latest, *possible])
    times: dict[str, Any] = {"start": begin, "until": end if end is not None and end > begin else None}
    kind = chance.choice([*VALUES, "parameter", "freeze"])
    if kind == "parameter":
        return Fault(kind, chance.choice(["damper.c", "mass.k"]), chance.choice([0.9, 2.0]), **times)
    if kind == "freeze":
        return Fault(kind, chance.choice([*system.components]), **times)
    place = chance.choice([end for c in system.connections for end in (c.source, c.target)])
    return Fault(kind, place, VALUES[kind], seed=chance.randrange(5), **times)


def attempt(seed: int, folder: Path) -> str:
    """Fly in both loops; fly in one of them, cut it, go on; fly to an earlier stop time, and go on."""
    chance = random.Random(seed)
    system, master, out = a_system(chance), chance.choice(MASTERS), folder / str(seed)
    latest = chance.choice([EARLY, STOP])
    setup = Experiment(
        stop_time=STOP,
        communication_step_size=0.1,
        every=chance.choice([1, 3, 4]),
        faults=[a_fault(chance, system, latest) for _ in range(chance.randint(1, 4))],
        events=[At(chance.choice([0.2, 0.33, 0.6]), {"mass.k": 3.0})] if chance.random() < 0.5 else [],
    )
    try:
        with prepare(system, Library("native")) as prepared:
            loops = [replace(setup, master=replace(master, kernel=loop)) for loop in both.LOOPS]
            straight, other = (prepared.fly(loop) for loop in loops)
            both.assert_same(straight, other)
            cut, flown = chance.choice(TIMES), chance.choice(loops)

            def progress(t: float, _stop: float) -> None:
                if t >= cut:
                    raise Cut

            try:
                prepared.fly(flown, out=out, checkpoint=chance.choice([0.1, 0.25, 0.7]), progress=progress)
            except Cut:
                both.assert_same(straight, resume(out, locate=Library("native")))
            if latest > EARLY:
                return "cut"
            prepared.fly(replace(flown, stop_time=EARLY), out=out, overwrite=True, checkpoint=0.25)
            both.assert_same(straight, resume(out, stop_time=STOP, locate=Library("native")))
            return "extended"
    except (WiringErrors, NotSupported):  # contradictions, and what a master cannot
        return "refused"
    finally:
        shutil.rmtree(out, ignore_errors=True)


if __name__ == "__main__":
    from fuzz import run

    run(attempt, 300)
