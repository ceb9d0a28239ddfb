"""Work and precision: the error of a flight by the CPU seconds of its loop, at several steps, ours and other tools'.

Two problems, the same FMU files for all, delayed exchange (Jacobi) in the other tools:

two masses   the oscillator of tests/problems, 2 s, against its matrix exponential: the largest deviation of a
             displacement or rate, by its amplitude, at 20 instants
zhang2018    zhang2018-ppatc, its first 20 s, against plant, law, guidance and disturbance as one ODE (DOP853, rtol
             1e-12): the largest angle between the attitudes at 20 instants

Ours: held inputs, true slopes, iterated cubics, and error control at tolerances in place of steps. The FMUs integrate
with the same internal step in all of them, which limits how exact a flight can be.
"""

import sys
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import bench
import loops
import numpy as np
from apart import ROOT, Interpreters, Missing
from loop import Loop, Port
from scipy.linalg import expm
from scipy.spatial.transform import Rotation

from cosim import Connection, Experiment, Explicit, Iterated, Library, System, load, prepare
from cosim.errors import SimulationError
from cosim.flights import Prepared
from cosim.masters.error_controlled import ErrorControlled
from fmus import build

sys.path.insert(1, str(ROOT / "tests"))

from helpers import monolithic
from problems.two_mass import Mass, MassAndSpring
from published import published
from zhang2018_loop import CONNECTIONS

SAMPLES, FLIGHTS = 20, 5
INSIDE = 2.5e-4  # s, internal step of the two masses: it errs by some 3e-9
OURS: Mapping[str, Callable[[], Any]] = {
    "held inputs": lambda: Explicit(inputs="held"),
    "slopes": lambda: Explicit(inputs="smooth", extrapolation=1),
    "iterated": Iterated,
}
TOLERANCES = (1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7)
CONTROLLED = "error-controlled"
THEIRS = ("ecos", "libcosim", "OMSimulator", "fmpy, ctypes", "cofmupy")
COLOURS = dict(zip((*OURS, CONTROLLED, *THEIRS), [f"C{i}" for i in range(9)], strict=True))


@dataclass(frozen=True)
class Problem:
    """A loop, the system that it is, steps in s, and the error of rows of what is shown.

    `ours`, `theirs`: the steps of these; explicit exchanges blow up at longer ones.
    """

    title: str
    unit: str
    loop: Loop
    system: System
    experiment: Experiment
    explicit: Sequence[float]
    iterated: Sequence[float]
    error: Callable[[np.ndarray], float]

    @property
    def stop(self) -> float:
        return self.loop.steps * self.loop.step


@dataclass(frozen=True)
class Flight:
    """What was flown: a step or a tolerance, CPU seconds of the loop, and the error."""

    setting: float
    seconds: float
    error: float


def two_masses(folder: Path) -> Problem:
    parts = {"one": MassAndSpring(**{"solver.step": INSIDE}), "two": Mass(**{"solver.step": INSIDE})}
    fmus = {name: str(build(c, folder / f"{name}.fmu")) for name, c in parts.items()}
    wires: list[tuple[Port, Port]] = [(("two", "x_2"), ("one", "x_2")), (("one", "f"), ("two", "f"))]
    shown: list[Port] = [("one", "x_1"), ("one", "v_1"), ("two", "x_2"), ("two", "v_2")]
    stop = 2.0
    # unit masses between springs of 10, 100, 1000 N/m
    A = np.array([[0, 1, 0, 0], [-110, 0, 100, 0], [0, 0, 0, 1], [100, 0, -1100, 0]], float)
    exact = np.array([expm(A * t) @ [0, 100, 0, -100] for t in np.linspace(0, stop, SAMPLES + 1)[1:]])
    system = System(
        name="two_masses",
        components=dict(fmus),
        connections=[Connection("two.x_2", "one.x_2", "after_step"), Connection("one.f", "two.f")],
    )
    return Problem(
        "two masses and three springs, 2 s",
        "error by amplitude",
        Loop("two masses", fmus, wires, shown, 1e-2, round(stop / 1e-2), SAMPLES),
        system,
        Experiment(stop_time=stop, communication_step_size=1e-2),
        (5e-3, 2e-3, 1e-3, 5e-4, 2e-4, 1e-4, 2e-5),
        (2e-2, 1e-2, 5e-3, 2e-3, 1e-3, 5e-4),
        lambda rows: float(np.abs((rows - exact) / np.abs(exact).max(axis=0)).max()),
    )


def zhang2018(folder: Path) -> Problem:
    stop = 20.0
    loop = replace(loops.paper(folder, "zhang2018-ppatc", stop), samples=SAMPLES)
    t = np.linspace(0, stop, SAMPLES + 1)
    _, x, _ = monolithic(published("zhang2018-ppatc"), CONNECTIONS, stop, t, rtol=1e-12)
    exact = Rotation.from_quat(x["plant.q_BN"][1:], scalar_first=True)

    def error(rows: np.ndarray) -> float:
        found = Rotation.from_quat(rows, scalar_first=True)
        return float(np.degrees((exact.inv() * found).magnitude().max()))

    system, experiment = load("zhang2018-ppatc")
    return Problem(
        "zhang2018-ppatc, 20 s",
        "largest attitude error (deg)",
        loop,
        system,
        replace(experiment, stop_time=stop),
        (2e-3, 1e-3, 5e-4, 2e-4, 1e-4),
        (0.1, 0.05, 0.02, 0.01, 0.005, 0.002),
        error,
    )


def timed(prepared: Prepared, experiment: Experiment) -> tuple[float, Any]:
    """The CPU seconds of the loop of a flight, and what it recorded.

    The least of several flights' loops by the clock, or of their CPU with their set-up: neither is less than that.
    """
    least, result = np.inf, None
    for _ in range(FLIGHTS):
        began = time.process_time()
        result = prepared.fly(experiment, advise=False)
        least = min(least, time.process_time() - began, result.info["wall_time"]["loop"])
    return least, result


def fly_ours(problem: Problem) -> dict[str, list[Flight]]:
    """Fly all exchanges of ours; those that end early, or away from all that is exact, are left out."""
    found: dict[str, list[Flight]] = {name: [] for name in (*OURS, CONTROLLED)}
    record = [f"{instance}.{variable}" for instance, variable in problem.loop.shown]
    sample = problem.stop / SAMPLES
    setups = [
        (
            name,
            step,
            replace(problem.experiment, communication_step_size=step, every=round(sample / step), master=make()),
        )
        for name, make in OURS.items()
        for step in (problem.iterated if name == "iterated" else problem.explicit)
    ]
    setups += [
        (
            CONTROLLED,
            tolerance,
            replace(problem.experiment, communication_step_size=sample, every=1, master=ErrorControlled(tolerance)),
        )
        for tolerance in TOLERANCES
    ]
    with prepare(problem.system, Library("native")) as prepared:
        for name, setting, experiment in setups:
            try:
                seconds, result = timed(prepared, replace(experiment, record=record))
            except SimulationError as error:
                print(f"{problem.title}: ours, {name} at {setting:g}: {str(error).splitlines()[0]}")
                continue
            rows = np.column_stack([result[column][1:] for column in record])
            found[name].append(Flight(setting, seconds, problem.error(rows)))
    return found


def fly_theirs(problem: Problem, folder: Path, pythons: Interpreters) -> dict[str, list[Flight]]:
    found: dict[str, list[Flight]] = {}
    for name in THEIRS:
        for step in problem.explicit:
            loop = replace(problem.loop, step=step, steps=round(problem.stop / step))
            try:
                figures = [loops.fly(loop, name, folder, pythons) for _ in range(2)]
            except Missing as why:
                print(f"{problem.title}: without {name} at {step:g} s: {why}")
                break
            error = problem.error(np.array(figures[0]["rows"]))
            found.setdefault(name, []).append(Flight(step, min(f["seconds"] for f in figures), error))
    return found


def show(problem: Problem, flown: Mapping[str, Sequence[Flight]]) -> None:
    print(f"\n{problem.title}: {problem.unit}")
    rows = [("", "step or tolerance", "CPU s", "error")]
    for name, flights in flown.items():
        rows += [(name, f"{f.setting:g}", f"{f.seconds:.3g}", f"{f.error:.2g}") for f in flights]
    bench.table(rows)


def draw(problems: Sequence[Problem], flown: Sequence[Mapping[str, Sequence[Flight]]], path: Path) -> None:
    """One picture a problem, side by side, log by log: ours full lines, theirs dashed."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot as plt

    figure, axes = plt.subplots(1, len(problems), figsize=(6.2 * len(problems), 5.6), layout="constrained")
    for axis, problem, found in zip(axes, problems, flown, strict=True):
        for name, flights in found.items():
            good = [f for f in flights if np.isfinite(f.error) and f.error > 0]
            ours = name not in THEIRS
            axis.loglog(
                [f.seconds for f in good],
                [f.error for f in good],
                color=COLOURS[name],
                linestyle="-" if ours else "--",
                marker="o" if ours else "s",
                markersize=5,
                label=f"ours, {name}" if ours else name,
            )
        axis.set(title=problem.title, xlabel="CPU time of the loop (s)", ylabel=problem.unit)
        axis.grid(True, which="major", alpha=0.4)
    handles = {label: h for axis in axes for h, label in zip(*axis.get_legend_handles_labels(), strict=True)}
    figure.legend(handles.values(), handles.keys(), loc="outside lower center", ncols=4)
    figure.savefig(path, dpi=150)
    plt.close(figure)


def main(folder: Path, out: Path, pythons: Interpreters) -> None:
    """Fly both problems and draw them to `out`/work_precision.png."""
    problems = [two_masses(folder), zhang2018(folder)]
    flown = [fly_ours(problem) | fly_theirs(problem, folder, pythons) for problem in problems]
    for problem, found in zip(problems, flown, strict=True):
        show(problem, found)
    path = out / "work_precision.png"
    draw(problems, flown, path)
    print(f"wrote {path}")
