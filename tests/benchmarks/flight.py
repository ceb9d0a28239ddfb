"""The flight that the project is for: zhang2018-ppatc, 200 s at 1 ms, native, every 10th communication point recorded.

Budgets: less than 2 s in the loop; memory flat in the number of steps, and of the order of the rows: the most resident
memory that a process of its own ever had, for 20 s and 200 s with the same number of rows, and for ten times the rows.
For comparison, how long a fixed piece of Python takes on this machine at that moment.
"""

import os
import subprocess
import sys
import tempfile
from dataclasses import replace
from pathlib import Path
from statistics import median

import bench

ROUNDS = 5
SYSTEM = "zhang2018-ppatc"


def fly(stop: float, every: int, out: Path | None = None) -> dict[str, float]:
    """Fly; return seconds in the loop and in all, rows and columns, and this process's peak of memory, in MB."""
    import resource

    from cosim import simulate
    from cosim.cli import scenario
    from cosim.cli.library import Library

    system, experiment = scenario.load(SYSTEM)
    experiment = replace(experiment, stop_time=stop, communication_step_size=1e-3, every=every)
    result = simulate(system, experiment, locate=Library("native"), out=out)
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / (1024 if sys.platform != "darwin" else 1024**2)
    columns = len(result.table.column_names)
    return {**result.info["wall_time"], "rows": len(result), "columns": columns, "peak": peak}


def apart(stop: float, every: int) -> dict[str, float]:
    """Fly in a process of its own."""
    code = f"import flight; print(flight.fly({stop}, {every}))"
    environment = os.environ | {"PYTHONPATH": os.pathsep.join([str(Path(__file__).parent), *sys.path])}
    done = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=False)
    if done.returncode:
        raise RuntimeError(done.stderr)
    return eval(done.stdout)


def count() -> None:
    total = 0
    for i in range(1_000_000):
        total += i & 3


def memory() -> None:
    apart(0.02, 1)  # builds what is missing
    idle = apart(0.02, 1)["peak"]
    runs = {"20 s, every point": (20, 1), "200 s, every 10th": (200, 10), "200 s, every point": (200, 1)}
    peaks = {what: apart(*run) for what, run in runs.items()}
    short, long, full = peaks.values()
    more = (full["peak"] - long["peak"]) * 2**20 / (full["rows"] - long["rows"])
    bench.limits(
        "memory: the most that a process ever had",
        [
            ("a run of 20 steps", idle, "MB", None),
            *((f"{what}, {p['rows']} rows: more", p["peak"] - idle, "MB", None) for what, p in peaks.items()),
            ("10 times the steps, same rows: ratio of the peaks", long["peak"] / short["peak"], "", 1.05),
            ("a row more, by the bytes of its numbers", more / (8 * full["columns"]), "", None),
        ],
    )


def loop() -> None:
    flights, scale = [], []
    for _ in range(ROUNDS):
        scale.append(bench.clocked(count)())
        flights.append(fly(200, 10))
    loops = [f["loop"] for f in flights]
    with tempfile.TemporaryDirectory() as place:
        fly(200, 10, Path(place) / "run")
        size = (Path(place) / "run" / "result.parquet").stat().st_size / 1e6
    bench.limits(
        f"{SYSTEM}, 200 s at 1 ms, native, {ROUNDS} flights; {flights[0]['rows']} rows of {flights[0]['columns']}",
        [
            ("loop, median", median(loops), "s", 2.0),
            ("loop, least", min(loops), "s", 2.0),
            ("loop, a step, median", median(loops) / 200_000 * 1e6, "us", None),
            ("simulate() in all, median", median(f["total"] for f in flights), "s", None),
            ("the file written", size, "MB", None),
            ("a million turns of a Python loop, median", median(scale), "s", None),
        ],
    )


if __name__ == "__main__":
    memory()  # first: on Linux a process begins with the peak of the one that started it
    loop()
