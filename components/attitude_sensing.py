"""How exact gyros and star trackers are, as the sensors have it and a filter assumes it.

    n = L w,  w a column of numbers of deviation 1,  L = cross (I - b b^T) + roll b b^T           (1)
    covariance of n: R = L L^T = cross^2 (I - b b^T) + roll^2 b b^T                               (2)

Symbols: n error of a star tracker's attitude, a small rotation vector in B; b boresight_B; cross, roll its deviations
across and about the boresight. Frames: B body axes.
Source: textbook; (1) is the square root of (2).
Limits: the three components of n across and about the boresight are independent, as they are from one sample to the
next.
"""

from typing import Any

import casadi as ca

from .framework import Component, Condition, Parameter, not_negative


class GyroNoise:
    """Random walks of a gyro, of every axis."""

    angle_random_walk = Parameter(
        unit="rad/s/Hz^(1/2)",
        shape=(3,),
        display_unit="deg/h^(1/2)",
        doc="sigma_v, deviation of the integrated rate's noise after 1 s: the rate of a sample has sigma_v / T^1/2",
    )
    rate_random_walk = Parameter(
        unit="rad/s2/Hz^(1/2)",
        shape=(3,),
        display_unit="deg/h^(3/2)",
        doc="sigma_u, deviation of the bias's walk after 1 s",
    )


class TrackerNoise:
    """Noise of a star tracker, of one measurement."""

    boresight_B = Parameter(
        unit="1", shape=(3,), start=(0.0, 0.0, 1.0), unit_length=True, doc="where the star tracker looks"
    )
    cross_noise = Parameter(
        unit="rad", display_unit="arcsec", doc="deviation of a measurement, about either axis across the boresight"
    )
    roll_noise = Parameter(unit="rad", display_unit="arcsec", doc="deviation of a measurement, about the boresight")


def deviation(p: Any) -> Any:
    """Return L of (1) of the parameters of `TrackerNoise`."""
    along = p.boresight_B @ p.boresight_B.T
    return p.cross_noise * (ca.DM.eye(3) - along) + p.roll_noise * along  # (1)


def gyro_conditions(component: Component, p: Any) -> list[Condition]:
    """Return the conditions on the parameters of `GyroNoise`."""
    return not_negative(component, p, "angle_random_walk", "rate_random_walk")
