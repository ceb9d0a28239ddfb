"""The same FMU files in this project's master, in a C loop and in other masters: one table of ratios a loop.

Loops: two FMUs that cost nothing, 40 and 200 of them, and two systems of the papers with delayed exchange at their own
steps. Each contestant runs in a process of its own, in turn, with and without recording each step; figures are CPU time
a communication step (ours: of a flight less one of a tenth of its steps), and its ratio to the C loop of the same
round. What a tool gives at the end is compared with the C loop's. Tools that are not installed are left out and named.

    pip install -e '.[peers]'; python tests/benchmarks/peers.py [--rounds 5] [--python cofmupy=OTHER/bin/python]

cofmupy wants other versions of packages than Basilisk: give it an environment of its own with --python.
"""

import argparse
import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Mapping
from pathlib import Path
from statistics import median

import bench
from parts import Controller, Plant

FOLDER = Path(__file__).parent / "peers"
sys.path.insert(0, str(FOLDER))

from loop import Loop  # noqa: E402 (the folder is not a package: its runners are scripts for other environments)

from cosim import load  # noqa: E402
from cosim.cli.instances import read_descriptions  # noqa: E402
from cosim.cli.library import Library  # noqa: E402
from cosim.system.expand import wire  # noqa: E402
from fmus import build  # noqa: E402

CONTESTANTS = {  # runner and what it is told
    "C loop": ("c_loop.py",),
    "ours, kernel": ("ours_loop.py", "kernel"),
    "ours, Python": ("ours_loop.py", "python"),
    "ecos": ("ecos_loop.py",),
    "libcosim": ("libcosim_loop.py",),
    "fmpy, ctypes": ("fmpy_loop.py",),
    "cofmupy": ("cofmupy_loop.py",),
}
SLOW = {"ours, Python": 20, "libcosim": 10, "fmpy, ctypes": 5, "cofmupy": 100, "ecos": 2}  # so many steps fewer
BUDGETS = {"ours, kernel": 1.2}
PAPERS = ("zhang2018-ppatc", "geng2012-compensated")


def pairs(folder: Path, count: int) -> Loop:
    """`count` FMUs: plants and controllers of parts.py, each plant held by its controller."""
    files = {c.name: str(build(c, folder / f"{c.name}.fmu")) for c in (Plant(), Controller())}
    fmus = {f"{kind.lower()}{i}": files[kind] for i in range(count // 2) for kind in ("Plant", "Controller")}
    wires = [
        wire
        for i in range(count // 2)
        for wire in (
            ((f"plant{i}", "angle"), (f"controller{i}", "angle")),
            ((f"plant{i}", "rate"), (f"controller{i}", "rate")),
            ((f"controller{i}", "tau"), (f"plant{i}", "tau")),
        )
    ]
    return Loop(f"{count} FMUs", fmus, wires, [("plant0", "angle"), ("plant0", "rate")], 0.01, 400_000 // count)


def paper(folder: Path, name: str) -> Loop:
    """A paper's system from FMUs with its parameters as start values; 20 s."""
    system, experiment = load(name)
    subprocess.run([sys.executable, "-m", "cosim", "build", name, "-o", str(folder)], check=True, stdout=sys.stderr)
    wiring = wire(system, read_descriptions(system, Library("native")))
    fmus = {instance: str(folder / f"{name}_{instance}.fmu") for instance in system.components}
    wires = [(tuple(link.source), tuple(link.target)) for link in wiring.links]
    shown = [("plant", f"q_BN[{i}]") for i in range(1, 5)]
    step = experiment.communication_step_size
    return Loop(name, fmus, wires, shown, step, round(20.0 / step))


def runs(loop: Loop, folder: Path, record: bool, pythons: Mapping[str, str]) -> Iterator[tuple[str, dict]]:
    """Give each contestant's figures, or {"missing": why}."""
    for name, (runner, *told) in CONTESTANTS.items():
        steps = max(loop.steps // SLOW.get(name, 1), 200)
        shorter = Loop(loop.name, loop.fmus, loop.wires, loop.shown, loop.step, steps)
        described = folder / "loop.json"
        shorter.write(described)
        command = [pythons.get(name, sys.executable), str(FOLDER / runner), str(described), str(int(record)), *told]
        paths = [str(FOLDER), str(FOLDER.parents[2])]
        environment = os.environ | {"PYTHONPATH": os.pathsep.join(paths)}
        done = subprocess.run(command, env=environment, capture_output=True, text=True, cwd=folder)
        lines = [line for line in done.stdout.splitlines() if line.startswith('{"us"')]
        said = done.stderr.strip().splitlines() or [f"status {done.returncode}"]
        yield name, json.loads(lines[-1]) | {"steps": steps} if lines else {"missing": said[-1]}


def table(loop: Loop, folder: Path, record: bool, rounds: int, pythons: Mapping[str, str]) -> None:
    times: dict[str, list[float]] = {}
    ends: dict[str, dict] = {}
    missing: dict[str, str] = {}
    for _ in range(rounds):
        for name, figures in runs(loop, folder, record, pythons):
            if "missing" in figures:
                missing[name] = figures["missing"]
            else:
                times.setdefault(name, []).append(figures["us"])
                ends[name] = figures
    rows = [("", "median us", "least us", "ratio", "budget", "off from the C loop")]
    for name, own in times.items():
        ratio = median(a / b for a, b in zip(own, times["C loop"], strict=True))
        budget = BUDGETS.get(name) if not record else None
        off = "shorter flight"
        if ends[name]["steps"] == ends["C loop"]["steps"]:
            off = f"{max(abs(a - b) for a, b in zip(ends[name]['end'], ends['C loop']['end'], strict=True)):.1e}"
        limit = "" if budget is None else f"<= {budget}"
        rows.append((name, f"{median(own):.4g}", f"{min(own):.4g}", f"{ratio:.2f}", limit, off))
    print(f"\n{loop.name}, {loop.step * 1e3:g} ms, {'every step recorded' if record else 'nothing recorded'}")
    bench.table(rows)
    for name, why in missing.items():
        print(f"without {name}: {why}")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--python", action="append", default=[], metavar="TOOL=PATH", help="another interpreter")
    parser.add_argument("--loops", nargs="*", default=["2", "40", "200", *PAPERS])
    told = parser.parse_args()
    pythons = dict(entry.split("=", 1) for entry in told.python)
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        for name in told.loops:
            loop = pairs(folder, int(name)) if name.isdigit() else paper(folder, name)
            for record in (False, True):
                table(loop, folder, record, told.rounds, pythons)


if __name__ == "__main__":
    main()
