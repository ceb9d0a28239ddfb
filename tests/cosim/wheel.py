"""A wheel unit for tests of momentum across units: three wheels along the body axes, momentum and torque ideal.

    h_B' = -tau_command_B                                                                         (1)
    tau_B = -(h_B(t) - h_B(t - H)) / H over the last communication step H                         (2)
Source: none needed.
"""

from components.framework import ActuatorCluster, Component, Output, State


class Wheel(Component):
    ports = ActuatorCluster

    h_B = State(unit="N.m.s", shape=(3,), start=(4.0, -3.0, 2.0), output=True, doc="momentum of the wheels")
    tau_end_B = Output(unit="N.m", shape=(3,), doc="torque at the end of the step, for comparison")

    def derivatives(self, t, x, u, p):
        return {"h_B": -u.tau_command_B}  # (1)

    def step_means(self, t, x, p):
        return {"tau_B": -x.h_B}  # (2)

    def outputs(self, t, x, u, p):
        return {"tau_end_B": u.tau_command_B}
