"""The torque on a body: what comes in as one, and what comes in as the momentum of clusters.

    tau = tau_B of the plant + sum of tau_B of the clusters whose h_B it takes                            (1)

A plant takes the momentum of a cluster, minus its rate is the torque; the cluster shows the mean of that over each
step. A plant that takes this mean itself, a plant of another tool, has it in its own tau_B.
"""

import numpy as np

from cosim.arrays import FloatArray
from cosim.results.result import Result
from cosim.studies.metrics.rows import series
from cosim.studies.roles import Loop
from fmus.description.names import split_port


def torque(run: Result, loop: Loop) -> FloatArray | None:
    """Return the torque on the body of a loop, N m, body axes, shape (n, 3); None where none was recorded."""
    given = series(run, f"{loop.plant}.tau_B")
    parts = [] if given is None else [given]
    for cluster in loop.actuators:
        stored = series(run, f"{cluster}.tau_B")
        if stored is not None and not _has(run, loop.plant, cluster, given):
            parts.append(stored)
    return sum(parts[1:], parts[0]) if parts else None  # (1)


def _has(run: Result, plant: str, cluster: str, given: FloatArray | None) -> bool:
    """Whether the plant's own tau_B has a cluster's; without connections: whether it has anything."""
    connections = run.info.get("connections")
    if connections is None:
        return given is not None and bool(np.any(given))
    return split_port(connections.get(f"{plant}.tau_B", {}).get("source", "."))[0] == cluster
