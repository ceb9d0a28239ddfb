"""Two masses between two walls, a spring in between: a linear oscillator in two units that exchange force and position.

    m_1 x_1'' = -k_1 x_1 - f,   f = k (x_1 - x_2)      unit 1: one mass, its wall's spring and the spring between  (1)
    m_2 x_2'' = -k_2 x_2 + f                           unit 2: the other mass and its wall's spring               (2)

Unit 1 takes x_2 and gives f, which follows x_2 directly; unit 2 takes f and gives x_2, a state.

Symbols: x_1, x_2 displacements from rest, v_1, v_2 rates; f force on mass 2.
Source: Newton's law; the numbers are those of the oscillator by which couplings of co-simulation are compared.
Invariants: m_1 v_1^2 / 2 + m_2 v_2^2 / 2 + k_1 x_1^2 / 2 + k_2 x_2^2 / 2 + k (x_1 - x_2)^2 / 2, for the sum of both.
"""

from components.framework import Component, Input, Output, Parameter, State


class MassAndSpring(Component):
    m_1 = Parameter(unit="kg", start=1.0, doc="mass 1")
    k_1 = Parameter(unit="N/m", start=10.0, doc="spring from mass 1 to its wall")
    k = Parameter(unit="N/m", start=100.0, doc="spring between the masses")
    x_2 = Input(unit="m", doc="displacement of mass 2")
    x_1 = State(unit="m", output=True, doc="displacement of mass 1")
    v_1 = State(unit="m/s", start=100.0, output=True, doc="rate of mass 1")
    f = Output(unit="N", doc="force on mass 2")

    def derivatives(self, t, x, u, p):
        return {"x_1": x.v_1, "v_1": (-p.k_1 * x.x_1 - p.k * (x.x_1 - u.x_2)) / p.m_1}  # (1)

    def outputs(self, t, x, u, p):
        return {"f": p.k * (x.x_1 - u.x_2)}  # (1)


class Mass(Component):
    m_2 = Parameter(unit="kg", start=1.0, doc="mass 2")
    k_2 = Parameter(unit="N/m", start=1000.0, doc="spring from mass 2 to its wall")
    f = Input(unit="N", doc="force on mass 2")
    x_2 = State(unit="m", output=True, doc="displacement of mass 2")
    v_2 = State(unit="m/s", start=-100.0, output=True, doc="rate of mass 2")

    def derivatives(self, t, x, u, p):
        return {"x_2": x.v_2, "v_2": (-p.k_2 * x.x_2 + u.f) / p.m_2}  # (2)
