"""Where a controller reports that its own law does not hold: outputs that are zero while it does."""

import numpy as np

from cosim.results.result import Result
from cosim.studies.roles import loops

FLAGS = {  # output of a controller -> what it means where it is not zero
    "gimbal_lock": "at a pitch of 90 deg its Euler angles are singular",
    "full_turn": "near a full turn its MRP are singular",
    "barrier_time": "the error left its prescribed bounds",
}


def out_of_domain(run: Result) -> str:
    """Return since when a controller reports that its law did not hold, and what that means; "" if nowhere.

    A flag that is up between two recorded rows only is not seen.
    """
    for controller in dict.fromkeys(name for loop in loops(run) for name in loop.controllers):
        for name, meaning in FLAGS.items():
            port = f"{controller}.{name}"
            rows = np.flatnonzero(run[port] > 0) if port in run else []
            if len(rows):
                return f"out of its domain from {run.time[rows[0]]:.4g} s: {meaning} ({name})"
    return ""
