"""Units for tests of momentum across units: three wheels along the body axes, momentum and torque ideal, and a body.

    h_B' = -tau_command_B                                                                         (1)
    tau_B = -(h_B(t) - h_B(t - H)) / H over the last communication step H                         (2)
Source: none needed.
"""

import casadi as ca
import numpy as np

from components.framework import ActuatorCluster, Component, Input, Output, Parameter, State
from components.mathematics import quaternion


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


class TorqueBody(Component):
    """A rigid body as another tool could have it: J w' = tau - w x (J w + h), H_N = q (x) (J w + h) (x) q*."""

    J = Parameter(unit="kg.m2", shape=(3, 3), start=np.diag([300.0, 200.0, 250.0]), doc="inertia")
    tau_B = Input(unit="N.m", shape=(3,), doc="torque on the body")
    h_B = Input(unit="N.m.s", shape=(3,), doc="momentum of the wheels, relative to the body")
    q_BN = State(unit="1", shape=(4,), start=(1, 0, 0, 0), output=True, doc="attitude")
    omega_BN_B = State(unit="rad/s", shape=(3,), output=True, doc="rate")
    H_N = Output(unit="N.m.s", shape=(3,), doc="total angular momentum, inertial axes")

    def derivatives(self, t, x, u, p):
        w = x.omega_BN_B
        return {
            "q_BN": quaternion.rate(x.q_BN, w),
            "omega_BN_B": ca.solve(p.J, u.tau_B - ca.cross(w, p.J @ w + u.h_B)),
        }

    def outputs(self, t, x, u, p):
        return {"H_N": quaternion.rotate(x.q_BN, p.J @ x.omega_BN_B + u.h_B)}
