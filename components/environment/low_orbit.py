"""Drag and solar pressure on a low orbit: force at a centre of pressure, and its torque about the mass centre.

    rho = rho_0 exp(-(|r| - R_E - h_0)/H) (1 + b r^ . s^)                                         (1)
    drag: F_N = -1/2 rho CdA |v| v                                                                (2)
    solar pressure: F_N = -F_s nu s^, nu = 1 - (1 - tanh(l/2e5 m)) (1 - tanh((d - R_E)/2e4 m))/4  (3)
        l = r . s^,  d = sqrt(|r|^2 - l^2)
    f = A_BN (drag + solar pressure + gusts),  tau = r_cp x f                                     (4)
    gusts, of amplitude spectral density a/sqrt(1 + (f/f_c)^2): sum over the lines f_i, i = 1..m, of   (5)
        density_i sqrt(2 spacing_i) cos(2 pi (f_i t + phase_i)), independent along each axis of
    the track: x along v, y opposite to the orbit normal r x v, z = x x y, to nadir on a circle   (6)

Frames: N inertial, B body; s^ unit vector to the Sun, N axes; the atmosphere does not rotate; the track is the orbit
frame LVLH on a circle. f_i are spread evenly in log f between the ends of the band; phases are a hash of seed, axis and
line, so that a run can be repeated.
Source: chosen for J. Li, H. Fan, Design of adaptive neural network controllers for LEO drag-free satellite, Computing
Technology and Automation 33(2), 2014, which names its environment only. Without rho_0, solar_force and gust_density
there is none.
Invariants: 0 <= nu <= 1; f . v < 0 without solar pressure and gusts.
Limits: an exponential atmosphere, constant CdA and centre of pressure whatever the attitude. Gusts are a
sum of sines, none below or above the band. The amplitude of a gust does not depend on the density.
"""

from typing import Any

import casadi as ca
import numpy as np

from .. import drag_free
from ..framework import (
    CalculatedParameter,
    Component,
    Condition,
    Environment,
    Input,
    Output,
    Parameter,
    not_negative,
    positive,
)
from ..framework.ports import NO_ROTATION
from ..mathematics import gravity, quaternion
from ..mathematics.noise import uniform
from ..mathematics.vectors import direction
from ..numbers import earth
from ..vehicle import quaternion_condition


class LowOrbit(Component):
    ports = Environment
    lines: int = 120  # structural: spectral lines of the gusts

    rho_0 = Parameter(unit="kg/m3", doc="density of the air at the altitude h_0")
    h_0 = Parameter(unit="m", start=500e3, doc="altitude of rho_0")
    scale_height = Parameter(unit="m", start=60e3, doc="H, height over which the density falls by e")
    bulge = Parameter(unit="1", doc="b, density of day and night around the mean")
    CdA = Parameter(unit="m2", start=4.0, doc="drag coefficient times area")
    solar_force = Parameter(unit="N", doc="F_s, force of the sunlight")
    sun_N = Parameter(unit="1", shape=(3,), start=(0, 0, 1), unit_length=True, doc="unit vector to the Sun")
    r_cp = Parameter(unit="m", shape=(3,), doc="centre of pressure, B axes")
    earth_radius = Parameter(unit="m", start=earth.EARTH_RADIUS, doc="radius of the Earth")
    terminator_width = Parameter(unit="m", start=2e5, doc="width of the change from day to night along the Sun's line")
    penumbra_width = Parameter(unit="m", start=2e4, doc="width of the penumbra across the Sun's line")
    gust_density = Parameter(
        unit="N/Hz^(1/2)",
        shape=(3,),
        doc="spectral density of the gusts below gust_corner: along the track, lateral (6)",
    )
    gust_corner = Parameter(unit="1/s", start=0.01, doc="corner frequency f_c of the gusts (Hz)")
    gust_band = Parameter(unit="1/s", shape=(2,), start=(1e-3, 0.1), doc="lowest and highest frequency (Hz)")
    seed = Parameter(unit="1", start=1.0, doc="seed of the gusts' phases, a whole number")
    gust_frequency = CalculatedParameter(unit="1/s", shape=("lines",), doc="frequencies of the gusts (Hz)")
    gust_amplitude = CalculatedParameter(unit="N", shape=(3, "lines"), doc="amplitudes of the gusts")
    gust_phase = CalculatedParameter(unit="1", shape=(3, "lines"), doc="phases of the gusts, in turns")

    r_N = Input(unit="m", shape=(3,), start=drag_free.START_R_N, doc="position")
    v_N = Input(unit="m/s", shape=(3,), start=drag_free.START_V_N, doc="velocity")
    q_BN = Input(unit="1", shape=(4,), start=NO_ROTATION, doc="attitude of the body, scalar first")
    f_dist_B = Output(unit="N", shape=(3,), nominal=1e-2, doc="disturbing force on the body")
    drag_B = Output(unit="N", shape=(3,), nominal=1e-2, doc="drag without gusts")
    sunlight = Output(unit="1", doc="nu, part of the Sun that is seen")

    def calculate(self, p: Any) -> dict[str, Any]:
        edges = p.gust_band[0] * (p.gust_band[1] / p.gust_band[0]) ** ca.DM(np.linspace(0, 1, self.lines + 1))
        f = ca.sqrt(edges[1:] * edges[:-1]) if self.lines else ca.SX(0, 1)
        spacing = edges[1:] - edges[:-1] if self.lines else ca.SX(0, 1)
        shape = ca.sqrt(2 * spacing) / ca.sqrt(1 + (f / p.gust_corner) ** 2)
        phase = [[uniform(i, p.seed, axis) for i in range(self.lines)] for axis in range(3)]
        return {
            "gust_frequency": f,
            "gust_amplitude": p.gust_density @ shape.T,
            "gust_phase": ca.vertcat(*(ca.horzcat(*row) for row in phase)) if self.lines else ca.SX(3, 0),
        }

    def outputs(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        r, l = ca.norm_2(u.r_N), ca.dot(u.r_N, p.sun_N)
        density = p.rho_0 * ca.exp(-(r - p.earth_radius - p.h_0) / p.scale_height) * (1 + p.bulge * l / r)  # (1)
        drag = -density * p.CdA * ca.norm_2(u.v_N) * u.v_N / 2  # (2)
        d = ca.sqrt(ca.fmax(r**2 - l**2, 0))
        night, behind = 1 - ca.tanh(l / p.terminator_width), 1 - ca.tanh((d - p.earth_radius) / p.penumbra_width)
        nu = 1 - night * behind / 4  # (3)
        A = quaternion.dcm(u.q_BN)
        turns = ca.repmat(p.gust_frequency.T * t, 3, 1) + p.gust_phase
        gusts = _track(u.r_N, u.v_N) @ ca.sum2(p.gust_amplitude * ca.cos(2 * ca.pi * turns))  # (5)
        drag_B = A @ drag
        force = drag_B + A @ (gusts - p.solar_force * nu * p.sun_N)  # (4)
        return {
            "f_dist_B": force,
            "tau_dist_B": ca.cross(p.r_cp, force),  # (4)
            "drag_B": drag_B,
            "sunlight": nu,
        }

    def check(self, t: Any, x: Any, u: Any, p: Any) -> list[Condition]:
        low, high = p.gust_band[0], p.gust_band[1]
        bulge = "bulge = {}: the night's density 1 - b is that of a gas for 0 <= b <= 1 only."
        band = "gust_band is {} to {} Hz: 0 < lowest < highest is needed."
        return [
            gravity.plane_condition(u.r_N, u.v_N),
            gravity.surface_condition(u.r_N, p.earth_radius),
            quaternion_condition("q_BN", u.q_BN),
            *positive(self, p, "scale_height", "earth_radius", "terminator_width", "penumbra_width", "gust_corner"),
            *not_negative(self, p, "rho_0", "CdA", "solar_force", "gust_density"),
            Condition(ca.logic_and(p.bulge >= 0, p.bulge <= 1), bulge, (p.bulge,)),
            Condition(ca.fmin(low, high - low), band, (low, high)),
        ]


def _track(r_N: Any, v_N: Any) -> Any:
    """Return the axes of the track in N, as columns."""
    x, y = direction(v_N), -direction(ca.cross(r_N, v_N))
    return ca.horzcat(x, y, ca.cross(x, y))  # (6)
