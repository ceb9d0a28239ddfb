"""li2014: adaptive neural backstepping of a drag-free satellite in low orbit.

`system` has the paper's numbers and experiments, `spectrum` what is measured, `claims` and `figures` what it says.
"""

TITLE = "Li, Fan: Design of adaptive neural network controllers for LEO drag-free satellite (2014)"

SETTLED = 0.001  # deg, a hundredth of its initial angles and less
