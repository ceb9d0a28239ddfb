"""geng2012: integral sliding mode with a network's gain, rapid turn of a flexible spacecraft with gyros and wheels.

`system` has the paper's numbers and experiments, `gains` its arrays, `claims` and `figures` what it says.
"""

from cosim.studies.papers.geng2012.claims import CLAIMS
from cosim.studies.papers.geng2012.figures import figures
from cosim.studies.papers.geng2012.gains import designed
from cosim.studies.papers.geng2012.system import systems

__all__ = ["CLAIMS", "SETTLED", "TITLE", "designed", "figures", "systems"]

TITLE = "Geng, Wu, Ma: Neural network compensation of flexible satellite rapid maneuver (2012)"

SETTLED = 0.1  # deg, the accuracy that the paper claims
