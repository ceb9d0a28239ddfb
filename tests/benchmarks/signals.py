"""What a signal costs: zhang2018-ppatc, its disturbance from its FMU, held, and from a signal of 2,000 samples.

200 s at 1 ms in the kernel, nothing recorded but the last row; CPU time. Budget: a signal costs at most what the FMU
costs that it takes the place of, plus a tenth of the flight.
"""

import time
from dataclasses import replace

import bench
import numpy as np

from cosim import Signal, load, prepare

ROUNDS, STOP = 5, 200.0


def main() -> None:
    system, experiment = load("zhang2018-ppatc")
    experiment = replace(experiment, stop_time=STOP, every=round(STOP / experiment.communication_step_size))
    wired = [c for c in system.connections if c.target != "plant.tau_dist_B"]
    bare = replace(
        system,
        components={n: c for n, c in system.components.items() if n != "environment"},
        connections=wired,
        parameters={n: v for n, v in system.parameters.items() if not n.startswith("environment.")},
    )
    t = np.linspace(0.0, STOP, 2_000)
    gust = Signal((t, 1e-3 * np.sin(0.1 * np.outer(t, [1, 2, 3]))), interpolation="cubic")
    variants = {
        "from an FMU": system,
        "held": replace(bare, held=dict(system.held) | {"plant.tau_dist_B": [0, 0, 0]}),
        "from a signal": replace(bare, inputs={"plant.tau_dist_B": gust}),
    }
    with (
        prepare(variants["from an FMU"]) as fmu,
        prepare(variants["held"]) as held,
        prepare(variants["from a signal"]) as signal,
    ):
        flights = {
            name: bench.clocked(lambda p=prepared: p.fly(experiment), round(STOP * 1000), time.process_time)
            for name, prepared in zip(variants, (fmu, held, signal), strict=True)
        }
        times = bench.rounds(flights, ROUNDS)
    bench.compare("a communication step", times, "from an FMU", {"from a signal": 1.1})


if __name__ == "__main__":
    main()
