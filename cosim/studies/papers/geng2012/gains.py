"""Gains of geng2012 that follow from a rule: the linear gain for another vehicle than the paper's, the observer's.

Linear-quadratic (components/mathematics/regulator.py): it minimises the integral of 11.2 |e|^2 + 390 |w|^2 +
20 |eta'|^2 + |u|^2. Observer: poles placed on the nominal model.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np

from components.numbers.geng2012 import OMEGA, ZETA, F, J
from cosim.system import Value

WEIGHTS = {"e": 11.2, "eta": 0.0, "omega": 390.0, "eta_dot": 20.0}


def design(vehicle: Mapping[str, Any]) -> dict[str, Any]:
    """Return the controller's gain of x for a vehicle (J, delta, Omega, zeta; without modes: J), and its surface.

    The surface keeps its columns of e and w; those of the modes, which drop out of it on the paper's own vehicle but
    for rounding, belong to that vehicle's modes and are zero here. So do the observer's gains and its start.
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
        **{f"observer.L_{name}": np.zeros((n, 3)).tolist() for name in ("eta", "psi")},
        "observer.eta_start": [0.0] * n,
    }


def observer(poles: Any) -> dict[str, Value]:
    """Return the gains of the modal observer that give the error of its estimate the poles, 1/s, at nominal J."""
    from components.estimators.modal_observer import place_gains  # most experiments place none

    L_eta, L_psi = place_gains(J, np.transpose(F), OMEGA, ZETA, poles)
    return {"L_eta": Value(L_eta.tolist(), "kg^(1/2).m.s"), "L_psi": Value(L_psi.tolist(), "kg^(1/2).m")}


def oscillating(decays: Any) -> np.ndarray:
    """Return poles with the modes' frequencies that decay so fast, 1/s: a conjugate pair a mode."""
    poles = -np.asarray(decays) + 1j * np.array(OMEGA)
    return np.concatenate([poles, poles.conj()])
