"""What a communication step of two FMI 3.0 FMUs costs in the kernel and in the Python loop, and with FMI 2.0 FMUs.

python tests/benchmarks/foreign.py [STEPS [ROUNDS]]

STEPS of the Python loop; the kernel takes a hundred times as many.
Two small FMUs that cost next to nothing, in a loop; rounds are interleaved, CPU time, the median counts, and so do the
differences of a long and a short flight: set-up is not in them.
"""

import re
import statistics
import sys
import tempfile
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2]))

from cosim import Connection, Experiment, Explicit, System, prepare
from tests.cosim import arrays_fmu, c_fmu
from tests.cosim.c_fmu import real

STEP = 1e-3


def systems(folder: Path) -> dict[str, System]:
    """Return two loops of two FMUs: of FMI 3.0, arrays of three, and of FMI 2.0, scalars."""
    wide = re.compile(r'<(UInt32|Int64|UInt64) name="(\w+_in|\w+_out|count)"[^>]*/>\n?')
    outputs = re.compile(r'<Output valueReference="(?:29|33|35|31|16)"[^>]*/>')
    three = arrays_fmu.build(folder, "", lambda text: outputs.sub("", wide.sub("", text)))
    variables = [real("u", "input"), real("x")]
    two = c_fmu.build(folder, "Two", variables, outputs="x = m->state[0];", step="m->state[0] += h * u;")
    ends = [Connection("a.x", "b.u"), Connection("b.x", "a.u")]
    return {
        name: System(name="loop", components={"a": str(path), "b": str(path)}, connections=ends, hold_unconnected=True)
        for name, path in {"FMI 3.0": three, "FMI 2.0": two}.items()
    }


def main(steps: int = 1000, rounds: int = 5) -> None:
    """Print the median costs per step, us, and the ratios of the loops."""
    with tempfile.TemporaryDirectory() as folder:
        prepared = {name: prepare(system) for name, system in systems(Path(folder)).items()}
        costs: dict[tuple[str, str], list[float]] = {}
        for _ in range(rounds):
            for name, ready in prepared.items():
                for kernel in ("always", "never"):
                    times: list[float] = []
                    size = steps if kernel == "never" else 100 * steps
                    for n in (size, 2 * size):
                        experiment = Experiment(
                            stop_time=n * STEP, communication_step_size=STEP, every=n, master=Explicit(kernel=kernel)
                        )
                        begun = time.process_time()
                        ready.fly(experiment)
                        times.append(time.process_time() - begun)
                    costs.setdefault((name, kernel), []).append((times[1] - times[0]) / size * 1e6)
        medians = {key: statistics.median(found) for key, found in costs.items()}
        for name in prepared:
            kernel, python = medians[name, "always"], medians[name, "never"]
            print(f"{name}: kernel {kernel:.2f} us, Python {python:.1f} us a step, ratio {python / kernel:.0f}")
            prepared[name].close()


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
