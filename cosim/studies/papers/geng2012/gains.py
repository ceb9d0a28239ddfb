"""The rule by which geng2012's linear gain is designed, for another vehicle than the paper's.

Linear-quadratic (components/mathematics/regulator.py): it minimises the integral of 11.2 |e|^2 + 390 |w|^2 +
20 |eta'|^2 + |u|^2.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np

WEIGHTS = {"e": 11.2, "eta": 0.0, "omega": 390.0, "eta_dot": 20.0}


def design(vehicle: Mapping[str, Any]) -> dict[str, Any]:
    """Return the controller's gain of x for a vehicle (J, delta, Omega, zeta; without modes: J), and its surface.

    The surface keeps its columns of e and w; those of the modes, which drop out of it on the paper's own vehicle but
    for rounding, belong to that vehicle's modes and are zero here.
    """
    from components.mathematics.regulator import regulator  # the paper's own vehicle needs no design

    J, delta, Omega, zeta = (
        np.asarray(getattr(value, "value", value), float)
        for value in (vehicle.get(name, []) for name in ("J", "delta", "Omega", "zeta"))
    )
    n = Omega.size
    gain = regulator(J, delta.reshape(n, 3), Omega, zeta, WEIGHTS)
    return {
        **{f"controller.G_{name}": part.tolist() for name, part in gain.items()},
        **{f"controller.D_{name}": np.zeros((3, n)).tolist() for name in ("eta", "eta_dot")},
    }
