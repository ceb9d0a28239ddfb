"""zhang2018: prescribed performance adaptive attitude tracking of a flexible spacecraft.

`system` has the paper's numbers and experiments, `tracking` its error angles, `claims` and `figures` what it says.
"""

SETTLED = 0.005  # deg, the steady state that the paper claims
