"""This project against other tools: what a step costs, what an error costs, and Basilisk's spacecraft.

    pip install -e '.[peers]'; python tests/benchmarks/peers.py --out DIR [--parts loops work-precision basilisk]

loops           the same FMU files in a C loop, in this project's master (kernel, Python) and in other masters: two FMUs
                that cost nothing, 40 to 400 of them, two systems of the papers at their own steps, all with delayed
                exchange, with and without recording each step. CPU time of a step, by that of the C loop.
work-precision  the error of a flight by its CPU seconds, at several steps, ours and theirs: DIR/work_precision.png
basilisk        hub, four wheels, MRP feedback, RK4 at 10 ms: a step, the set-up of a further flight, the trajectories

Each contestant runs in a process of its own, in turn, its time that of the least of some parts or flights; a ratio is
the median over the rounds of its time by the other's of the same round. Tools that are not installed are left out and
named. `--python PATH` is the interpreter that has them, `--python TOOL=PATH` that of one: cofmupy wants other versions
of packages than this project.
"""

import argparse
import tempfile
from dataclasses import replace
from pathlib import Path

import bench
import loops
import spacecraft
import work_precision
from apart import Interpreters

MOST_ROWS = 500_000
"""Steps of a flight that records each of them: some tools write text."""

PARTS = ("loops", "work-precision", "basilisk")


def fly_loops(folder: Path, names: list[str], rounds: int, pythons: Interpreters) -> list[tuple[str, str, str, str]]:
    measured: dict[str, loops.Measured] = {}
    for name in names:
        loop = loops.pairs(folder, int(name)) if name.isdigit() else loops.paper(folder, name)
        for record in (False, True):
            flown = replace(loop, steps=min(loop.steps, MOST_ROWS)) if record else loop
            found = loops.measure(flown, folder, record, rounds, pythons)
            loops.show(loop, record, found)
            measured[f"{loop.name} +" if record else loop.name] = found
    loops.ratios(measured)
    return loops.verdicts(measured)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--parts", nargs="+", choices=PARTS, default=PARTS)
    parser.add_argument("--out", type=Path, default=Path("."), help="folder of the picture")
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--python", action="append", default=[], metavar="[TOOL=]PATH", help="another interpreter")
    parser.add_argument("--loops", nargs="*", default=["2", "40", "200", "400", *loops.PAPERS])
    told = parser.parse_args()
    pythons = Interpreters.told(told.python)
    verdicts: list[tuple[str, str, str, str]] = []
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        if "loops" in told.parts:
            verdicts += fly_loops(folder, told.loops, told.rounds, pythons)
        if "work-precision" in told.parts:
            told.out.mkdir(parents=True, exist_ok=True)
            work_precision.main(folder, told.out, pythons)
        if "basilisk" in told.parts:
            verdicts += spacecraft.main(folder, told.rounds, pythons)
    print()
    bench.table([("budgets", "measured", "budget", ""), *verdicts])


if __name__ == "__main__":
    main()
