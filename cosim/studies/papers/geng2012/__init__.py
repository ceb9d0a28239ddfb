"""geng2012: integral sliding mode with a network's gain, rapid turn of a flexible spacecraft with gyros and wheels.

system.py    the experiments, loop.py what they have in common, gains.py gains that follow from a rule
claims.py    the claims with their readings, measures.py what decides them, surface.py what drives the surface
figures.py   the figures, clusters.py those with a column a cluster
"""

SETTLED = 0.1  # deg, the accuracy that the paper claims
