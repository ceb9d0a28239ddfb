"""What a user writes into files of his own: controllers and systems, for tests of the command line."""

PD_PYTHON = '''
"""PD attitude control in plain Python."""
import numpy as np
from components.framework import AttitudeController, Parameter, PythonComponent


class PD(PythonComponent):
    ports = AttitudeController
    kp = Parameter(unit="N.m", start=40.0, doc="stiffness")
    breaks = Parameter(unit="s", start=1e9, doc="time from which on it raises")

    def outputs(self, t, x, u, p):
        if t > p.breaks:
            raise ValueError(f"no law after {p.breaks} s")
        q, r = u.q_BN, u.q_RN
        v = r[0] * q[1:] - q[0] * r[1:] - np.cross(r[1:], q[1:])
        return {"tau_command_B": -2 * p.kp * v - 250.0 * (u.omega_BN_B - u.omega_RN_R), "attitude_error": 2 * v}
'''

PD_EQUATIONS = '''
"""PD attitude control as equations: tau = -kp e - kd (omega_BN_B - omega_RN_R)."""
from components.mathematics import quaternion
from components.framework import AttitudeController, Component, Parameter


class PD(Component):
    ports = AttitudeController
    kp = Parameter(unit="N.m/rad", start=40.0, doc="stiffness")

    def outputs(self, t, x, u, p):
        error = quaternion.rotation_vector(quaternion.error(u.q_BN, u.q_RN))
        return {"tau_command_B": -p.kp * error - 250.0 * (u.omega_BN_B - u.omega_RN_R), "attitude_error": error}
'''

RUNAWAY = '''
"""x' = x^2 is infinite at 1 s; y = sqrt(0.5 - t) is no number after 0.5 s."""
import casadi as ca
from components.framework import Component, Output, State


class Runaway(Component):
    x = State(unit="1/s", start=1.0, output=True, doc="what grows")

    def derivatives(self, t, x, u, p):
        return {"x": x.x**2}


class Root(Component):
    y = Output(unit="1", doc="what ends")

    def outputs(self, t, x, u, p):
        return {"y": ca.sqrt(0.5 - t)}
'''

ALONE = '''
from cosim.masters.explicit import Explicit
from cosim.system import Experiment, System


def system():
    """One unit that needs nothing."""
    return System(name="alone", components={{"unit": {unit!r}}}), Experiment(
        stop_time={stop}, communication_step_size=0.001, master=Explicit(kernel={kernel!r})
    )
'''

TARGET = '''
from cosim.masters.explicit import Explicit
from cosim.studies.papers import scenario
import dataclasses


def system():
    """zhang2018-ppatc with the loop in Python."""
    system, experiment = scenario("zhang2018-ppatc")
    return system, dataclasses.replace(experiment, master=Explicit(inputs="smooth", extrapolation=1, kernel="never"))
'''

WIRED = """
from cosim.system import Connection, Experiment, System


def system():
    return System(
        name="wired",
        components={{"guidance": "EulerSinusoid", "env": "HarmonicTorque", "env2": "HarmonicTorque",
                     "plant": "FlexibleSpacecraft:modes=1"}},
        connections=[Connection(*c) for c in {connections}],
        held={held},
    ), Experiment(stop_time=1, communication_step_size=0.1)
"""

TORQUE, HELD = ("env.tau_dist_B", "plant.tau_dist_B"), {"plant.h_B": [0, 0, 0], "plant.tau_B": [0, 0, 0]}
