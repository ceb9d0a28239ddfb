"""The drag-free satellite: parameters that its plant and controller share beside J, and where it starts.

Frames: N inertial, S satellite and cage, T test mass. The start values are no paper's: components/numbers/neutral.py;
the test mass rests in the middle of its cage, which is at the mass centre of a satellite on a circle in the equator.
"""

import numpy as np

from .framework import Parameter
from .numbers import neutral

m_sc = Parameter(unit="kg", start=neutral.M_SC, shared=True, doc="mass of the satellite without the test mass")
m_tm = Parameter(unit="kg", start=neutral.M_TM, shared=True, doc="mass of the test mass")
I_tm = Parameter(unit="kg.m2", start=neutral.I_TM, shared=True, doc="inertia of the test mass, a cube, about any axis")
K = Parameter(unit="N/m", shared=True, doc="stiffness between test mass and satellite; negative: it pushes away")
D = Parameter(unit="N.s/m", shared=True, doc="damping between test mass and satellite")
K_r = Parameter(unit="N.m/rad", shared=True, doc="rotational stiffness between test mass and satellite")
D_r = Parameter(unit="N.m.s/rad", shared=True, doc="rotational damping between test mass and satellite")

START_R_N = np.array([neutral.ORBIT_RADIUS, 0.0, 0.0])  # m
START_V_N = np.array([0.0, neutral.ORBIT_SPEED, 0.0])  # m/s
