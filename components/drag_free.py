"""The drag-free satellite: parameters that its plant and controller share, and where a flight starts.

Frames: N inertial, S satellite and cage, T test mass.
Source: H. Li, L. Fan, Design of adaptive neural network controllers for LEO drag-free satellite, Computing Technology
and Automation 33(2), 2014: masses, inertias, springs and dampers. D and D_r are printed in N/m^2 and N/rad, meant are
N s/m and N m s/rad. Orbit, arm of the cage and attitudes are chosen: circular, 260 km, 96.7 deg, right ascension 30
deg, argument of latitude 20 deg; angles 3-2-1 of (0.5, -0.3, 0.4) deg and (1, -0.5, 0.8) deg.
"""

import casadi as ca
import numpy as np

from .framework import Parameter
from .mathematics import euler
from .numbers import li2014
from .numbers.earth import EARTH_RADIUS, MU

DEGREE = np.pi / 180

J = Parameter(unit="kg.m2", shape=(3, 3), start=li2014.I_SC * np.eye(3), doc="inertia of the satellite")
m_sc = Parameter(unit="kg", start=li2014.M_SC, doc="mass of the satellite without the test mass")
m_tm = Parameter(unit="kg", start=li2014.M_TM, doc="mass of the test mass")
I_tm = Parameter(unit="kg.m2", start=li2014.I_TM, doc="inertia of the test mass, a cube, about any axis")
K = Parameter(unit="N/m", start=li2014.K, doc="stiffness between test mass and satellite; negative: it pushes away")
D = Parameter(unit="N.s/m", start=li2014.D, doc="damping between test mass and satellite")
K_r = Parameter(unit="N.m/rad", start=li2014.K_R, doc="rotational stiffness between test mass and satellite")
D_r = Parameter(unit="N.m.s/rad", start=li2014.D_R, doc="rotational damping between test mass and satellite")


def _orbit() -> tuple[np.ndarray, np.ndarray]:
    node, tilt, u = (DEGREE * a for a in (li2014.NODE, li2014.INCLINATION, li2014.LATITUDE))
    radius = EARTH_RADIUS + li2014.ALTITUDE
    to_node = np.array([np.cos(node), np.sin(node), 0])
    across = np.array([-np.sin(node) * np.cos(tilt), np.cos(node) * np.cos(tilt), np.sin(tilt)])
    r = np.cos(u) * to_node + np.sin(u) * across
    v = -np.sin(u) * to_node + np.cos(u) * across
    return radius * r, np.sqrt(MU / radius) * v


START_R_N, START_V_N = _orbit()
START_Q_SN = euler.quaternion_from_321(DEGREE * ca.DM(li2014.PHI_SC)).full().ravel()
START_Q_TS = euler.quaternion_from_321(DEGREE * ca.DM(li2014.PHI_REL)).full().ravel()
START_R_REL = 1e-3 * np.array(li2014.R_REL)
