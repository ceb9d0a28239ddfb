"""Unit quaternions of angles as people write them; scalar first, v_N = q_BN (x) v_B (x) q_BN*.

    euler("321", [30, 20, 10])    from N about axis 3 by 30 deg, then about the new axis 2 by 20, then 1 by 10
    axis_angle([0, 0, 1], 30)     about an axis, which has the same components in N and B

Source: scipy's Rotation does the mathematics, of intrinsic (capital) sequences.
"""

from collections.abc import Sequence
from typing import Any, Literal

import numpy as np

SEQUENCES = ("121", "123", "131", "132", "212", "213", "231", "232", "312", "313", "321", "323")
"""Axes of the three rotations; no two neighbours are one axis."""

Angle = Literal["deg", "rad"]


def euler(sequence: str, angles: Sequence[float], unit: Angle = "deg") -> list[float]:
    """Return q_BN of three rotations, each about an axis of the frame that the ones before have turned.

    Raises ValueError for a sequence that is none, and for other than three finite angles.
    """
    if sequence not in SEQUENCES:
        raise ValueError(f"euler{sequence} is no sequence of Euler angles. There are {', '.join(SEQUENCES)}")
    if len(angles) != 3 or not np.isfinite(angles).all():
        raise ValueError(f"euler{sequence} takes three finite angles, there are {len(angles)}: {list(angles)}")
    from scipy.spatial.transform import Rotation

    names = "".join("XYZ"[int(axis) - 1] for axis in sequence)
    return _scalar_first(Rotation.from_euler(names, list(angles), degrees=unit == "deg"))


def axis_angle(axis: Sequence[float], angle: float, unit: Angle = "deg") -> list[float]:
    """Return q_BN of one rotation about an axis of any length; raises ValueError for an axis that is none."""
    length = float(np.linalg.norm(axis)) if len(axis) == 3 else 0.0
    if not (0 < length < np.inf) or not np.isfinite(angle):
        raise ValueError(f"axis takes three numbers, not all 0, and an angle; given are {list(axis)} and {angle}")
    from scipy.spatial.transform import Rotation

    size = np.radians(angle) if unit == "deg" else angle
    return _scalar_first(Rotation.from_rotvec(np.asarray(axis, dtype=np.float64) / length * size))


def _scalar_first(rotation: Any) -> list[float]:
    """Return a rotation's quaternion, its scalar not negative, where that is not 0."""
    quaternion: np.ndarray = rotation.as_quat(scalar_first=True)
    return (quaternion if quaternion[0] >= 0 else -quaternion).tolist()
