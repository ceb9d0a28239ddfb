"""Steps of the error-controlled master against those of one size, for the same error over a whole flight.

geng2012-compensated, 100 s, iterated smooth: the largest error of plant.q_BN at full seconds against a flight at
.25 ms, as it falls with the number of steps; for each tolerance, how many steps of one size give that error
(interpolated between flights, log by log). Goal: half as many. Evaluations are those of both solutions of a step.

                 steps    q_BN     of one size          2026-11-26, two cores that others used too
    1e-3           563   1.9e-6        4100
    1e-4          1093   3.6e-7       13000
    1e-5          2247   4.3e-8       36000
"""

from dataclasses import replace

import numpy as np

from cosim import Library, load, prepare
from cosim.masters.error_controlled import ErrorControlled
from cosim.masters.iterated import Iterated

SYSTEM = "geng2012-compensated"
SIZES = (0.1, 0.05, 0.02, 0.01, 0.005, 0.002, 0.001)  # s
TOLERANCES = (1e-3, 1e-4, 1e-5)
REFERENCE = 0.25e-3  # s


def main() -> None:
    system, experiment = load(SYSTEM)
    with prepare(system, Library("native")) as prepared:

        def fly(step, master):
            setup = replace(experiment, communication_step_size=step, every=round(1 / step), master=master)
            return prepared.fly(setup, record=["plant.q_BN"])

        truth = fly(REFERENCE, Iterated(tolerance=1e-11))["plant.q_BN"]

        def error(run):
            return float(np.abs(run["plant.q_BN"] - truth).max())

        print(f"{'':>14}  steps  evaluations     q_BN")
        fixed = []
        for step in SIZES:
            run = fly(step, Iterated())
            fixed.append((round(float(experiment.stop_time) / step), error(run)))
            print(f"{step:12g} s {fixed[-1][0]:7d} {run.info['loop']['evaluations']:12d} {fixed[-1][1]:8.1e}")
        counts, errors = np.log(np.array(fixed).T)
        for tolerance in TOLERANCES:
            run = fly(1.0, ErrorControlled(tolerance))
            loop = run.info["loop"]
            equal = np.exp(np.interp(-np.log(error(run)), -errors, counts))
            line = f"{tolerance:14g} {loop['steps']['accepted']:7d} {loop['evaluations']:12d} {error(run):8.1e}"
            print(f"{line}  as {equal:.0f} of one size: {loop['steps']['accepted'] / equal:.3f}")


if __name__ == "__main__":
    main()
