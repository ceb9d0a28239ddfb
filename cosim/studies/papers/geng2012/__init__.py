"""geng2012: integral sliding mode with a network's gain, rapid turn of a flexible spacecraft with gyros and wheels.

`system` has the paper's numbers and experiments, `gains` its arrays, `claims` and `figures` what it says.
"""

TITLE = "Geng, Wu, Ma: Neural network compensation of flexible satellite rapid maneuver (2012)"

SETTLED = 0.1  # deg, the accuracy that the paper claims
