"""The standard variables of a role: `ports = AttitudeController` declares them all.

Frames are in the names: B body, N inertial, R reference; x_BN_B is B relative to N in components of B. A quaternion is
a unit quaternion, scalar first, Hamilton: v_N = q_BN (x) v_B (x) q_BN*. A component may declare one of these variables
itself, e.g. as a state that is an output, with the same unit and shape. A component without ports of a role says its
`role` itself.
"""

from typing import ClassVar

from .variables import Input, Output

NO_ROTATION = (1.0, 0.0, 0.0, 0.0)  # as a quaternion


class AttitudePlant:
    """What an attitude plant takes and shows."""

    role: ClassVar[str] = "plant"

    tau_B = Input(unit="N.m", shape=(3,), doc="torque on the hub from outside, as of thrusters")
    h_B = Input(
        unit="N.m.s",
        shape=(3,),
        rate_acts=True,
        doc="angular momentum stored by the actuators, relative to the hub; minus its rate is their torque",
    )
    tau_dist_B = Input(unit="N.m", shape=(3,), doc="disturbance torque on the hub")
    q_BN = Output(unit="1", shape=(4,), doc="attitude of the body, scalar first")
    omega_BN_B = Output(unit="rad/s", shape=(3,), display_unit="deg/s", nominal=1e-2, doc="body rate")
    H_N = Output(unit="N.m.s", shape=(3,), doc="total angular momentum about the mass centre, inertial axes")
    energy = Output(unit="J", doc="kinetic and elastic energy, without that of the actuators")


class AttitudeController:
    """What a torque-commanding attitude controller takes and shows."""

    role: ClassVar[str] = "controller"

    q_BN = Input(unit="1", shape=(4,), start=NO_ROTATION, doc="attitude of the body, scalar first")
    omega_BN_B = Input(unit="rad/s", shape=(3,), display_unit="deg/s", nominal=1e-2, doc="body rate")
    q_RN = Input(unit="1", shape=(4,), start=NO_ROTATION, doc="attitude of the reference, scalar first")
    omega_RN_R = Input(unit="rad/s", shape=(3,), display_unit="deg/s", nominal=1e-2, doc="rate of the reference")
    omega_dot_RN_R = Input(unit="rad/s2", shape=(3,), nominal=1e-3, doc="inertial derivative of omega_RN, in R")
    tau_command_B = Output(unit="N.m", shape=(3,), doc="torque wanted on the hub")
    attitude_error = Output(
        unit="rad",
        shape=(3,),
        display_unit="deg",
        nominal=1e-2,
        doc="rotation vector of q_RN* (x) q_BN, short way, B axes",
    )


class ActuatorCluster:
    """What a torque-commanded actuator cluster takes and shows."""

    role: ClassVar[str] = "actuators"

    tau_command_B = Input(unit="N.m", shape=(3,), doc="torque wanted on the hub")
    tau_B = Output(
        unit="N.m", shape=(3,), step_mean=True, mean_of="h_B", doc="torque on the hub, mean over the communication step"
    )
    h_B = Output(unit="N.m.s", shape=(3,), doc="angular momentum stored, relative to the hub")


class Guidance:
    """The reference attitude and its motion."""

    role: ClassVar[str] = "guidance"

    q_RN = Output(unit="1", shape=(4,), doc="attitude of the reference, scalar first")
    omega_RN_R = Output(unit="rad/s", shape=(3,), display_unit="deg/s", nominal=1e-2, doc="rate of the reference")
    omega_dot_RN_R = Output(unit="rad/s2", shape=(3,), nominal=1e-3, doc="inertial derivative of omega_RN, in R")


class Environment:
    """A disturbance."""

    role: ClassVar[str] = "environment"

    tau_dist_B = Output(unit="N.m", shape=(3,), doc="disturbance torque on the hub")
