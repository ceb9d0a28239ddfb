"""Loops of FMUs that every tool flies, and what a communication step costs in each of them."""

import subprocess
import sys
from dataclasses import dataclass, field, replace
from pathlib import Path
from statistics import median, quantiles

import apart
import bench
import numpy as np
from apart import Interpreters, Missing

sys.path.insert(0, str(apart.FOLDER))
sys.path.append(str(apart.ROOT / "tests" / "cosim"))

from c_fmu import build, real
from loop import Loop, Port

from cosim import load
from cosim.cli.instances import read_descriptions
from cosim.cli.library import Library
from cosim.system.expand import wire

REFERENCE, OURS, REFRESHED, IN_LOOP = "C loop", "ours, kernel", "ours, refreshed", "ours, in its loop"
CONTESTANTS = {  # runner, what it is told, and how many times fewer steps it takes
    REFERENCE: ("c_loop.py", (), 1),
    OURS: ("ours_loop.py", ("kernel", "plain"), 1),
    REFRESHED: ("ours_loop.py", ("kernel", "jacobi"), 1),
    IN_LOOP: ("ours_loop.py", ("kernel", "plain", "loop"), 1),
    "ours, Python": ("ours_loop.py", ("python", "plain"), 20),
    "ecos": ("ecos_loop.py", (), 5),
    "libcosim": ("libcosim_loop.py", (), 50),
    "OMSimulator": ("omsimulator_loop.py", (), 20),
    "fmpy, ctypes": ("fmpy_loop.py", (), 20),
    "cofmupy": ("cofmupy_loop.py", (), 500),
}
OWN = {REFERENCE, OURS, REFRESHED, IN_LOOP, "ours, Python", "fmpy, ctypes"}  # run on this project and its dependencies
USUAL = 500_000
"""Steps of a flight; some are longer, so that ours is compiled for them, which others need not be."""

LEAST = 400
"""Steps of the shortest flight; ours has a tenth of them taken off."""
BUDGETS = (  # loop, contestant, by which other, at most or at least how many times
    ("2 FMUs", OURS, REFERENCE, "<=", 1.2),
    ("2 FMUs +", IN_LOOP, REFERENCE, "<=", 3.0),
    ("40 FMUs", OURS, REFERENCE, "<=", 1.3),
    ("200 FMUs", OURS, REFERENCE, "<=", 1.3),
    ("400 FMUs", OURS, REFERENCE, "<=", 1.3),
    ("zhang2018-ppatc", OURS, REFERENCE, "<=", 1.1),
    ("2 FMUs", "ecos", OURS, ">=", 20.0),
    ("2 FMUs", "libcosim", OURS, ">=", 200.0),
    ("2 FMUs", "ours, Python", "fmpy, ctypes", "<=", 2.0),
    ("2 FMUs +", "ours, Python", "fmpy, ctypes", "<=", 2.0),
    ("zhang2018-ppatc", "ours, Python", "fmpy, ctypes", "<=", 2.0),
    ("zhang2018-ppatc +", "ours, Python", "fmpy, ctypes", "<=", 2.0),
)
GROWTH = ("2 FMUs", "200 FMUs", 1.2)
PAPERS = ("zhang2018-ppatc", "geng2012-compensated")


RK4 = """
    double c = -0.5 / 100, k = -1.0 / 100, a = tau / 100;
    double k1 = rate, l1 = a + c * rate + k * angle;
    double k2 = rate + h / 2 * l1, l2 = a + c * (rate + h / 2 * l1) + k * (angle + h / 2 * k1);
    double k3 = rate + h / 2 * l2, l3 = a + c * (rate + h / 2 * l2) + k * (angle + h / 2 * k2);
    double k4 = rate + h * l3, l4 = a + c * (rate + h * l3) + k * (angle + h * k3);
    angle += h / 6 * (k1 + 2 * k2 + 2 * k3 + k4);
    rate += h / 6 * (l1 + 2 * l2 + 2 * l3 + l4);"""


def pairs(folder: Path, count: int) -> Loop:
    """`count` FMUs that cost nothing: bodies on a spring, each held by a PD law that answers a step later."""
    place = folder / str(count)
    place.mkdir()
    body = build(place, "Body", [real("tau", "input"), real("angle", start=0.1), real("rate", start=0.0)], step=RK4)
    seen = [real("angle", "input"), real("rate", "input")]
    law = build(place, "Law", [*seen, real("tau", start=0.0)], step="tau = -4.0 * angle - 28.0 * rate;")
    fmus = {f"{kind}{i}": str(path) for i in range(count // 2) for kind, path in (("body", body), ("law", law))}
    wires: list[tuple[Port, Port]] = []
    for i in range(count // 2):
        wires += [((f"body{i}", name), (f"law{i}", name)) for name in ("angle", "rate")]
        wires.append(((f"law{i}", "tau"), (f"body{i}", "tau")))
    # 500 s at most: the loop decays with .14 1/s, and numbers below 1e-308 would slow it down
    steps = {2: 8_000_000, 40: 1_500_000}.get(count, 1_000_000 // count)
    step = min(1e-3, 500 / steps)
    return Loop(f"{count} FMUs", fmus, wires, [("body0", "angle"), ("body0", "rate")], step, steps)


def paper(folder: Path, name: str, stop: float = 20.0) -> Loop:
    """A paper's system from FMUs with its parameters as start values, at its own step."""
    system, experiment = load(name)
    subprocess.run([sys.executable, "-m", "cosim", "build", name, "-o", str(folder)], check=True, stdout=sys.stderr)
    wiring = wire(system, read_descriptions(system, Library("native")))
    fmus = {instance: str(folder / f"{name}_{instance}.fmu") for instance in system.components}
    wires = [(tuple(link.source), tuple(link.target)) for link in wiring.links]
    shown: list[Port] = [("plant", f"q_BN[{i}]") for i in range(1, 5)]
    step = float(experiment.communication_step_size)
    return Loop(name, fmus, wires, shown, step, round(stop / step))


def fly(loop: Loop, name: str, folder: Path, pythons: Interpreters, record: bool = False) -> dict:
    """Give the figures of a contestant. Raises `Missing`."""
    runner, told, _ = CONTESTANTS[name]
    described = folder / "loop.json"
    loop.write(described)
    python = sys.executable if name in OWN else pythons.of(name)
    return apart.run(python, runner, [str(described), str(int(record)), *told], folder)


@dataclass
class Measured:
    """Microseconds a step, a figure a round, and how far an end is off from that of the C loop, by its size."""

    times: dict[str, list[float]] = field(default_factory=dict)
    off: dict[str, float] = field(default_factory=dict)
    missing: dict[str, str] = field(default_factory=dict)

    def ratio(self, name: str, other: str = REFERENCE) -> float | None:
        if name not in self.times or other not in self.times:
            return None
        return bench.ratio(self.times[name], self.times[other])


def measure(loop: Loop, folder: Path, record: bool, rounds: int, pythons: Interpreters) -> Measured:
    """Fly every contestant once a round, in turn."""
    found, ends = Measured(), {}
    for _ in range(rounds):
        for name, (_, _, fewer) in CONTESTANTS.items():
            if name in found.missing:
                continue
            spared = max(loop.steps // USUAL, 1) if fewer > 1 else 1
            own = replace(loop, steps=max(loop.steps // fewer // spared, LEAST))
            try:
                figures = fly(own, name, folder, pythons, record)
            except Missing as why:
                found.missing[name] = str(why)
                continue
            if own.steps not in ends:
                ends[own.steps] = fly(own, REFERENCE, folder, pythons)["rows"][-1]
            found.times.setdefault(name, []).append(figures["us"])
            same = ends[own.steps]
            found.off[name] = max(map(abs, np.subtract(figures["rows"][-1], same))) / max(map(abs, same))
    return found


def show(loop: Loop, record: bool, found: Measured) -> None:
    """Print the table of one loop."""
    base = found.times[REFERENCE]
    low, _, high = quantiles(base, n=4) if len(base) > 1 else (base[0], base[0], base[0])
    print(f"\n{loop.name}, {loop.step * 1e3:g} ms, {'every step recorded' if record else 'nothing recorded'}")
    print(f"{len(base)} rounds; quartiles of the C loop: {low:.4g} to {high:.4g} us")
    rows = [("", "median us", "least us", "ratio", "least ratio", "off by its size")]
    for name, own in found.times.items():
        numbers = f"{median(own):.4g}", f"{min(own):.4g}", f"{found.ratio(name):.2f}", f"{min(own) / min(base):.2f}"
        rows.append((name, *numbers, f"{found.off[name]:.1e}"))
    bench.table(rows)
    for name, why in found.missing.items():
        print(f"without {name}: {why}")


def ratios(measured: dict[str, Measured]) -> None:
    """Print the one table: contestants down, loops across, ratios to the C loop of the same round."""
    print("\ncommunication step, CPU, by that of the C loop; +: every step recorded")
    rows = [("", *measured)]
    for name in CONTESTANTS:
        found = [m.ratio(name) for m in measured.values()]
        if any(r is not None for r in found):
            rows.append((name, *("" if r is None else f"{r:.3g}" for r in found)))
    bench.table(rows)


def verdicts(measured: dict[str, Measured]) -> list[tuple[str, str, str, str]]:
    """Return the budgets that these loops have: what, measured, budget, verdict."""
    found = [
        (f"{name} by {other}: {title}", measured[title].ratio(name, other), sense, limit)
        for title, name, other, sense, limit in BUDGETS
        if title in measured
    ]
    few, many, limit = GROWTH
    if {few, many} <= set(measured):
        more = measured[many].ratio(OURS) / measured[few].ratio(OURS)
        found.append((f"{OURS} by {REFERENCE}: {many} by {few}", more, "<=", limit))
    return [bench.verdict(*row) for row in found if row[1] is not None]
