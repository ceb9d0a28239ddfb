"""A quarter of a car in two units: the chassis on its suspension, the wheel on its tyre, on a road with a step.

    m_c v_c' = -F,   F = k_c s + d_c v_s (1 + (v_s / v_d)^2),   s' = v_s = v_c - v_w             (1)
    m_w v_w' = F - k_w (z_w - z_r),   z_w' = v_w                                                   (2)

The chassis takes the rate v_w of the wheel and gives the force F of its suspension, which follows v_w directly through
the damper; the wheel takes F and gives v_w, a state. F v_w is the power that goes over: a power bond.

Symbols: v_c, v_w rates of chassis and wheel, up; s extension of the suspension, z_w displacement of the wheel, z_r
height of the road, all from rest under the weight.
Source: the benchmark of S. Sadjina, L. T. Kyllingstad, S. Skjong, E. Pedersen, Energy conservation and power bonds in
co-simulations, Engineering with Computers 33, 2017 (arXiv 1602.06434), of which the abstract alone could be opened
(linear and nonlinear damping): the equations are the usual ones; masses, stiffness and linear damping are those that
the co-simulators libcosim and ecos carry as their quarter truck; v_d and the step of the road are chosen.
Invariants: m_c v_c^2 / 2 + k_c s^2 / 2 + m_w v_w^2 / 2 + k_w (z_w - z_r)^2 / 2 falls by the damper's work alone.
"""

from components.framework import Component, Input, Output, Parameter, State

LINEAR = 1e12
"""A rate so large, m/s, that the damper is linear to the last bit."""


class Chassis(Component):
    solver_step = 1e-3

    m_c = Parameter(unit="kg", start=400.0, doc="mass of the chassis")
    k_c = Parameter(unit="N/m", start=15e3, doc="stiffness of the suspension")
    d_c = Parameter(unit="N.s/m", start=1e3, doc="linear damping of the suspension")
    v_d = Parameter(unit="m/s", start=LINEAR, doc="rate at which the damping is twice that at rest")
    v_w = Input(unit="m/s", doc="rate of the wheel")
    s = State(unit="m", output=True, doc="extension of the suspension")
    v_c = State(unit="m/s", output=True, doc="rate of the chassis")
    F = Output(unit="N", doc="force of the suspension, on the wheel up, on the chassis down")

    def force(self, x, u, p):
        rate = x.v_c - u.v_w
        return p.k_c * x.s + p.d_c * rate * (1 + (rate / p.v_d) ** 2)

    def derivatives(self, t, x, u, p):
        return {"s": x.v_c - u.v_w, "v_c": -self.force(x, u, p) / p.m_c}  # (1)

    def outputs(self, t, x, u, p):
        return {"F": self.force(x, u, p)}  # (1)


class Wheel(Component):
    solver_step = 1e-3

    m_w = Parameter(unit="kg", start=40.0, doc="mass of the wheel")
    k_w = Parameter(unit="N/m", start=150e3, doc="stiffness of the tyre")
    z_r = Parameter(unit="m", start=0.1, doc="height of the road, from t = 0 on")
    F = Input(unit="N", doc="force of the suspension")
    z_w = State(unit="m", output=True, doc="displacement of the wheel")
    v_w = State(unit="m/s", output=True, doc="rate of the wheel")

    def derivatives(self, t, x, u, p):
        return {"z_w": x.v_w, "v_w": (u.F - p.k_w * (x.z_w - p.z_r)) / p.m_w}  # (2)
