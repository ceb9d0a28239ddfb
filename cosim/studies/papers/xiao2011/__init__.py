"""xiao2011: adaptive L2-gain attitude tracking of a flexible spacecraft with limited torque, and PID beside it.

`system` has the paper's numbers and experiments, `tracking` its angles and settling times, `gain` the linearised L2
gain, `claims` and `figures` what it says.
"""

SETTLED = 0.01  # deg, 5 % of the initial angles of case S
