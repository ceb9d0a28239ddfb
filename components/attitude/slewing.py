"""What a digital actuator makes of a command, and what a limiter leaves of it.

    y = clip(command, lower, upper), then moved from the last value by at most rate T             (1)
    quantised: q floor(y/q + 1/2); q = 0: y                                                       (2)

Source: none needed. Elementwise, all columns.
Limits: rate = 0: no limit of the rate. (2) rounds halves up; a command of less than q/2 is lost.
"""

from typing import Any

import casadi as ca


def slewed(command: Any, last: Any, lower: Any, upper: Any, rate: Any, period: Any) -> Any:
    """Return the command within its limits, no farther than the rate allows from the last one."""
    wanted = ca.fmax(lower, ca.fmin(upper, command))
    step = rate * period
    near = ca.fmax(last - step, ca.fmin(last + step, wanted))
    return ca.if_else(rate > 0, near, wanted)  # (1)


def quantised(y: Any, quantum: Any) -> Any:
    """Return y rounded to a whole number of quanta."""
    some = quantum > 0
    return ca.if_else(some, quantum * ca.floor(y / ca.if_else(some, quantum, 1) + 0.5), y)  # (2)
