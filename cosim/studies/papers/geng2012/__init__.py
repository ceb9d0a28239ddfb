"""geng2012: integral sliding mode with a network's gain, rapid turn of a flexible spacecraft with gyros and wheels.

`system` has the paper's numbers and experiments, `gains` its arrays, `claims` and `figures` what it says.
"""

SETTLED = 0.1  # deg, the accuracy that the paper claims
