"""li2014: adaptive neural backstepping of a drag-free satellite in low orbit.

`system` has the paper's numbers and experiments, `design` the model that the law is designed on, `spectrum` and
`lyapunov` what is measured, `claims` and `figures` what it says.
"""

SETTLED = 0.001  # deg, a hundredth of its initial angles and less
