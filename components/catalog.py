"""FMU name -> the component with its structure and start values: what builds, tests and docs iterate.

Importing this builds no CasADi function; calling an entry declares variables only.
"""

from collections.abc import Callable

from .actuators.cmg_cluster import CmgCluster
from .actuators.cmg_steering import CmgSteering
from .actuators.electrostatic_suspension import ElectrostaticSuspension
from .actuators.reaction_wheels import ReactionWheels
from .actuators.thrusters import Thrusters
from .actuators.weighted_steering import WeightedSteering
from .controllers.adaptive_l2_gain import AdaptiveL2Gain
from .controllers.adaptive_tracking import AdaptiveTracking
from .controllers.drag_free_backstepping import DragFreeBackstepping
from .controllers.hybrid_adaptive import HybridAdaptive
from .controllers.integral_sliding_mode import IntegralSlidingMode
from .controllers.pid import PID
from .controllers.prescribed_performance import PrescribedPerformance
from .environment.gravity_gradient import GravityGradient
from .environment.harmonic_torque import HarmonicTorque
from .environment.low_orbit import LowOrbit
from .environment.sum import Sum
from .estimators.electrostatic_sensor import ElectrostaticSensor
from .estimators.modal_observer import ModalObserver
from .estimators.star_tracker_gyro import StarTrackerGyro
from .framework import Component
from .guidance.attitude_step import AttitudeStep
from .guidance.body_rate_sinusoid import BodyRateSinusoid
from .guidance.euler_sinusoid import EulerSinusoid
from .guidance.orbit_frame import OrbitFrame
from .guidance.orbit_frame_from_state import OrbitFrameFromState
from .guidance.slew import Slew
from .plants.drag_free_satellite import DragFreeSatellite
from .plants.flexible_spacecraft import FlexibleSpacecraft

CATALOG: dict[str, Callable[[], Component]] = {
    "AdaptiveL2Gain": AdaptiveL2Gain,
    "AdaptiveTracking": AdaptiveTracking,
    "AttitudeStep": AttitudeStep,
    "BodyRateSinusoid": BodyRateSinusoid,
    "CmgCluster": CmgCluster,
    "CmgSteering": CmgSteering,
    "DragFreeBackstepping": DragFreeBackstepping,
    "DragFreeSatellite": DragFreeSatellite,
    "ElectrostaticSensor": ElectrostaticSensor,
    "ElectrostaticSuspension": ElectrostaticSuspension,
    "EulerSinusoid": EulerSinusoid,
    "FlexibleSpacecraft": FlexibleSpacecraft,
    "GravityGradient": GravityGradient,
    "HarmonicTorque": HarmonicTorque,
    "HybridAdaptive": HybridAdaptive,
    "IntegralSlidingMode": IntegralSlidingMode,
    "LowOrbit": LowOrbit,
    "ModalObserver": ModalObserver,
    "OrbitFrame": OrbitFrame,
    "OrbitFrameFromState": OrbitFrameFromState,
    "PID": PID,
    "PrescribedPerformance": PrescribedPerformance,
    "ReactionWheels": ReactionWheels,
    "Slew": Slew,
    "StarTrackerGyro": StarTrackerGyro,
    "Sum": Sum,
    "Thrusters": Thrusters,
    "WeightedSteering": WeightedSteering,
}
