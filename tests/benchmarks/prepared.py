"""Short flights of one prepared system: 10 steps of zhang2018-ppatc, 1,000 times, from one thread and from four.

Budget: 5 ms of CPU a flight without a result folder, memory and file descriptors flat after the first hundred. Each
flight gives the bits of a fresh `simulate`. For comparison: `simulate`, which reads, wires and loads every time.
"""

import gc
import os
import resource
import threading
import time
from dataclasses import replace

import bench

FLIGHTS, THREADS = 1000, 4


def descriptors() -> int:
    return len(os.listdir("/proc/self/fd")) if os.path.isdir("/proc/self/fd") else 0


def resident() -> float:
    """Peak of memory so far, MB."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


def main() -> None:
    import cosim

    system, experiment = cosim.load("zhang2018-ppatc")
    short = replace(experiment, stop_time=0.01, every=1)
    fresh = cosim.simulate(system, short).table
    began, count = time.process_time(), 20
    for _ in range(count):
        cosim.simulate(system, short)
    alone = (time.process_time() - began) / count
    rows = []
    with cosim.prepare(system) as prepared:

        def fly(flights: int) -> None:
            for _ in range(flights):
                assert prepared.fly(short).table.equals(fresh)

        for threads in (1, THREADS):
            fly(100)
            gc.collect()
            memory, files, began = resident(), descriptors(), time.process_time()
            crews = [threading.Thread(target=fly, args=(FLIGHTS // threads,)) for _ in range(threads)]
            if threads == 1:
                fly(FLIGHTS)
            else:
                for crew in crews:
                    crew.start()
                for crew in crews:
                    crew.join()
            cpu = (time.process_time() - began) / FLIGHTS * 1e3
            rows += [
                (f"a flight, CPU, {threads} thread{'s' if threads > 1 else ''}", cpu, "ms", 5.0),
                ("memory that they took more", resident() - memory, "MB", 2.0 if threads == 1 else None),
                ("file descriptors more", descriptors() - files, "", 0 if threads == 1 else None),
            ]
    rows.append(("simulate() in its place, CPU", alone * 1e3, "ms", None))
    bench.limits(f"{FLIGHTS} flights of 10 steps of a prepared zhang2018-ppatc", rows)


if __name__ == "__main__":
    main()
