"""Which exchange to take when: error, cost and the largest step of each, on the loops of the five papers.

    python tests/benchmarks/exchange.py [SYSTEM ...] [--stop T] [--search T] [--steps h,h,...]

Every system is flown whole by each exchange at its own step (or at those given), h, h/2 and h/4 (`adcs verify`), which
gives the order; the error is the largest angle between plant.q_BN (drag-free: plant.q_SN) and the reference, over all
rows. The reference is the most exact exchange at FINER a step; how well it is known is its difference to that at twice
this step. The largest step is searched for some time (--search). The table is Markdown.
"""

import argparse
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from fractions import Fraction

import bench
import numpy as np

from cosim import prepare
from cosim.cli.library import Library
from cosim.flights import Prepared
from cosim.masters.explicit import Explicit
from cosim.masters.iterated import Iterated
from cosim.results.result import Result
from cosim.studies import papers
from cosim.studies.markdown import write_table
from cosim.studies.verification import Verification, verify
from cosim.studies.verification.convergence import angle, is_attitude
from cosim.system import Experiment, System
from cosim.time import exact_seconds, in_words, parse_seconds

SYSTEMS = (
    "zhang2018-ppatc", "xiao2011-l2gain", "xiao2011-pid", "ye2016-adaptive", "li2014-nn", "geng2012-compensated",
)  # fmt: skip
FINER = 4
HEAD = (
    "system", "exchange", "step", "error (deg)", "order", "CPU (s)", "evaluations a step", "flies up to", "diverges at",
)  # fmt: skip


@dataclass(frozen=True)
class Exchange:
    """A master, and whether the smooth connections of a system are held at the end's value instead."""

    master: object
    held: bool = False

    def of(self, system: System) -> System:
        """Return the system as this exchange flies it."""
        links = [replace(c, timing="after_step") if c.timing == "smooth" else c for c in system.connections]
        return replace(system, connections=links) if self.held else system


EXCHANGES: Mapping[str, Exchange] = {
    "held": Exchange(Explicit(), held=True),
    "explicit slopes": Exchange(Explicit(inputs="smooth", extrapolation=1)),
    "iterated ramp": Exchange(Iterated(inputs="ramp")),
    "iterated smooth": Exchange(Iterated(inputs="smooth")),
}
BEST = "iterated smooth"


def attitude(run: Result) -> str:
    """The name of the first plant's attitude."""
    return next(name for name in run.names if is_attitude(name, run[name].shape))


def largest_angle(run: Result, reference: Result) -> float:
    """The largest angle between two flights, deg, on the rows that both have."""
    name = attitude(reference)
    shared = np.intersect1d(run.time, reference.time)
    one, other = (r[name][np.searchsorted(r.time, shared)] for r in (run, reference))
    return float(np.degrees(angle(one, other)).max())


def reference(prepared: Prepared, experiment: Experiment, step: Fraction) -> tuple[Result, float]:
    """The reference, and its difference to the flight at twice its step, deg."""
    fine, twice = (
        prepared.fly(
            replace(experiment, communication_step_size=step / n, every=experiment.every * n, record=("plant.*",))
        )
        for n in (FINER, FINER // 2)
    )
    return fine, largest_angle(twice, fine)


def rows(name: str, options: argparse.Namespace) -> Iterator[tuple[str, ...]]:
    """The rows of one system."""
    system, experiment = papers.scenario(name)
    own = exact_seconds(experiment.communication_step_size, "the step")
    given = options.steps.split(",") if options.steps else []
    steps = [exact_seconds(parse_seconds(s, "--steps"), "--steps") for s in given] or [own]
    if options.stop:
        experiment = replace(experiment, stop_time=parse_seconds(options.stop, "--stop"))
    interval = own * experiment.every  # of the rows; a step that does not fit has the rows at common multiples
    locate = Library("native")
    with prepare(EXCHANGES[BEST].of(system), locate) as prepared:
        exact, known = reference(prepared, replace(experiment, master=EXCHANGES[BEST].master), min(own, *steps))
    print(f"{name}: the reference is known to {known:.1e} deg", flush=True)
    for word, exchange in EXCHANGES.items():
        with prepare(exchange.of(system), locate) as prepared:
            for step in steps:
                every = max(1, int(interval / step))
                setup = replace(experiment, master=exchange.master, communication_step_size=step, every=every)
                found = verify(prepared, setup, search=float(parse_seconds(options.search, "--search")))
                yield name, word, in_words(step), *figures(found, exact)


def figures(found: Verification, exact: Result) -> tuple[str, ...]:
    """Error, order, cost and limits of an exchange at a step."""
    first, limit = found.trials[0], found.limit
    error = f"{largest_angle(first.result, exact):.1e}" if first.finished else "diverges"
    order = next(
        (f"{v.order:.2f}" if v.order is not None else v.remark for v in found.variables if v.unit == "deg"), ""
    )
    flies, fails = (
        "" if limit is None or step is None else in_words(step)
        for step in ((limit.flies, limit.fails) if limit else (None, None))
    )
    remark = f"{fails}, {limit.remark}".strip(", ") if limit and limit.remark else fails
    return error, order, f"{first.cpu:.2f}", f"{first.evaluations:.2f}", flies, remark


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("systems", nargs="*", default=SYSTEMS)
    parser.add_argument("--stop", help="stop time, instead of the whole flight")
    parser.add_argument("--search", default="30s", help="wall time of each search for the largest step")
    parser.add_argument("--steps", default="", help="steps, instead of the experiment's own: 1ms,10ms")
    options = parser.parse_args()
    table = [row for name in options.systems for row in rows(name, options)]
    print("\n" + write_table(HEAD, table))


if __name__ == "__main__":
    assert bench  # it finds the packages
    main()
