"""ye2016: adaptive control of a hybrid cluster of gyros and wheels with installation deviation.

`system` has the numbers and experiments, `tracking` the errors, `claims` and `figures` what the paper says.
"""

from cosim.studies.papers.ye2016.claims import CLAIMS
from cosim.studies.papers.ye2016.figures import figures
from cosim.studies.papers.ye2016.system import systems

__all__ = ["CLAIMS", "SETTLED", "TITLE", "figures", "systems"]

TITLE = "Ye, Sun, Liu: An adaptive control algorithm for hybrid actuator with installation deviation (2016)"

SETTLED = 0.17  # deg, the 0.003 rad that the paper claims
