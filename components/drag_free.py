"""The drag-free satellite: parameters that its plants and controller share beside J, where it starts, its networks.

    h of a network, an axis: Gaussian nodes in (x1/s1, x2/s2)                                     (11)

Frames: N inertial, S satellite and cage, T test mass. The start values are no paper's: components/numbers/neutral.py;
the test mass rests in the middle of its cage, which is at the mass centre of a satellite on a circle in the equator.
"""

from typing import Any

import casadi as ca
import numpy as np

from .framework import Component, Condition, Parameter, positive
from .mathematics.rbf import gaussian
from .numbers import neutral

printed_signs = Parameter(unit="1", doc="1: a, b of loop 3 are +K_r/I_tm, +D_r/I_tm as printed, 0: those of (5)")

START_R_N = np.array([neutral.ORBIT_RADIUS, 0.0, 0.0])  # m
START_V_N = np.array([0.0, neutral.ORBIT_SPEED, 0.0])  # m/s


class FreeMass:
    """Satellite and test mass with what acts between them, as plants and controller know them, beside J."""

    m_sc = Parameter(unit="kg", start=neutral.M_SC, shared=True, doc="mass of the satellite without the test mass")
    m_tm = Parameter(unit="kg", start=neutral.M_TM, shared=True, doc="mass of the test mass")
    I_tm = Parameter(unit="kg.m2", start=neutral.I_TM, shared=True, doc="inertia of the test mass, any axis")
    K = Parameter(unit="N/m", shared=True, doc="stiffness between test mass and satellite; negative: it pushes away")
    D = Parameter(unit="N.s/m", shared=True, doc="damping between test mass and satellite")
    K_r = Parameter(unit="N.m/rad", shared=True, doc="rotational stiffness between test mass and satellite")
    D_r = Parameter(unit="N.m.s/rad", shared=True, doc="rotational damping between test mass and satellite")


def grid(component: Any) -> np.ndarray:
    """Return a square grid over -1..1, as far as the nodes go."""
    side = max(1, int(np.ceil(np.sqrt(component.nodes))))
    line = np.linspace(-1, 1, side) if side > 1 else np.zeros(1)
    return np.array(np.meshgrid(line, line, indexing="ij")).reshape(2, -1)[:, : component.nodes]


class Networks:
    """The nodes of the three networks, those of the loops r_rel, satellite, test mass; a component has `nodes`."""

    centres = Parameter(unit="1", shape=(2, "nodes"), start=grid, doc="centres in (x1, x2), a column a node, scaled")
    width = Parameter(unit="1", start=0.5, doc="width of the nodes, scaled")
    scale_r = Parameter(unit="m", start=1e-3, display_unit="mm", doc="s1 of loop 1")
    scale_v = Parameter(unit="m/s", start=1e-3, doc="s2 of loop 1")
    scale_angle = Parameter(unit="rad", shape=(2,), start=2e-2, doc="s1 of loops 2 and 3")
    scale_rate = Parameter(unit="rad/s", shape=(2,), start=2e-2, doc="s2 of loops 2 and 3")


def node_values(p: Any, loop: int, x1: Any, x2: Any) -> list[Any]:
    """Return h of each axis of loop 0, 1 or 2, a column each."""
    s1, s2 = (p.scale_r, p.scale_v) if loop == 0 else (p.scale_angle[loop - 1], p.scale_rate[loop - 1])
    return [gaussian((ca.vertcat(x1[i] / s1, x2[i] / s2), p.centres, p.width)) for i in range(3)]  # (11)


def network_conditions(component: Component, p: Any) -> list[Condition]:
    """Return the conditions on the parameters of `Networks`."""
    return positive(component, p, "width", "scale_r", "scale_v", "scale_angle", "scale_rate")
