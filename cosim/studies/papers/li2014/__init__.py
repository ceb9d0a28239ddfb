"""li2014: adaptive neural backstepping of a drag-free satellite in low orbit.

`system` has the paper's numbers and experiments, `spectrum` what is measured, `claims` and `figures` what it says.
"""

from cosim.studies.papers.li2014.claims import CLAIMS
from cosim.studies.papers.li2014.figures import figures
from cosim.studies.papers.li2014.system import systems

__all__ = ["CLAIMS", "SETTLED", "TITLE", "figures", "systems"]

TITLE = "Li, Fan: Design of adaptive neural network controllers for LEO drag-free satellite (2014)"

SETTLED = 0.001  # deg, a hundredth of its initial angles and less
