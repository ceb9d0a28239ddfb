"""ye2016: adaptive control of a hybrid cluster of gyros and wheels with installation deviation.

`system` has the numbers and experiments, `tracking` the errors, `claims` and `figures` what the paper says.
"""

SETTLED = 0.17  # deg, the 0.003 rad that the paper claims
