"""The gain K of ye2016: six printed eigenvalues of A_1 = A_0 - B_0 K leave it open for three inputs.

A_0 = [0, 1; 0, 0],  B_0 = [0; 1],  K = [k_1, k_2], 3 x 6
"""

from typing import Any

import numpy as np

from components.numbers.ye2016 import EIGENVALUES, K_1, K_2
from cosim.arrays import FloatArray


def diagonal(scale: float = 1.0) -> FloatArray:
    """Return K with a pair of the eigenvalues, times `scale`, an axis."""
    return np.hstack([np.diag(scale**2 * K_1), np.diag(scale * K_2)])


def placed(scale: float = 1.0) -> FloatArray:
    """Return K by scipy's place_poles, which makes the eigenvectors as orthogonal as it can, at `scale` times them."""
    from scipy.signal import place_poles  # slow to import

    A = np.block([[np.zeros((3, 3)), np.eye(3)], [np.zeros((3, 6))]])
    found: Any = place_poles(A, np.eye(6, 3, -3), scale * EIGENVALUES)  # scipy's types know no member of its result
    return found.gain_matrix
