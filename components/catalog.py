"""FMU name -> the component with its structure and start values: what builds, tests and docs iterate.

Plain data until an entry is asked for: importing this imports no component and no CasADi, asking for an entry imports
its module, calling it declares variables only.
"""

from collections.abc import Callable, Iterator, Mapping
from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from .framework import Component

MODULES = {
    "AdaptiveL2Gain": "components.controllers.adaptive_l2_gain",
    "AdaptiveL2GainTracking": "components.controllers.adaptive_l2_gain_tracking",
    "AdaptiveTracking": "components.controllers.adaptive_tracking",
    "AttitudeStep": "components.guidance.attitude_step",
    "BodyRateSinusoid": "components.guidance.body_rate_sinusoid",
    "CmgCluster": "components.actuators.cmg_cluster",
    "CmgSteering": "components.actuators.cmg_steering",
    "Delay": "components.filters.delay",
    "DragFreeBackstepping": "components.controllers.drag_free_backstepping",
    "DragFreeDesignModel": "components.plants.drag_free_design_model",
    "DragFreeSatellite": "components.plants.drag_free_satellite",
    "ElectrostaticSensor": "components.estimators.electrostatic_sensor",
    "ElectrostaticSuspension": "components.actuators.electrostatic_suspension",
    "EulerSinusoid": "components.guidance.euler_sinusoid",
    "FlexibleSpacecraft": "components.plants.flexible_spacecraft",
    "GravityGradient": "components.environment.gravity_gradient",
    "Gyro": "components.estimators.gyro",
    "HarmonicTorque": "components.environment.harmonic_torque",
    "HybridAdaptive": "components.controllers.hybrid_adaptive",
    "IntegralSlidingMode": "components.controllers.integral_sliding_mode",
    "LinearQuadraticRegulator": "components.controllers.linear_quadratic_regulator",
    "LowOrbit": "components.environment.low_orbit",
    "LowPass": "components.filters.low_pass",
    "MEKF": "components.estimators.mekf",
    "ModalObserver": "components.estimators.modal_observer",
    "Notch": "components.filters.notch",
    "OrbitFrame": "components.guidance.orbit_frame",
    "OrbitFrameFromState": "components.guidance.orbit_frame_from_state",
    "OrbitFrameSinusoid": "components.guidance.orbit_frame_sinusoid",
    "PID": "components.controllers.pid",
    "PrescribedPerformance": "components.controllers.prescribed_performance",
    "Quantiser": "components.filters.quantiser",
    "QuaternionFeedback": "components.controllers.quaternion_feedback",
    "RateLimiter": "components.filters.rate_limiter",
    "ReactionWheels": "components.actuators.reaction_wheels",
    "Saturation": "components.filters.saturation",
    "Slew": "components.guidance.slew",
    "StarTracker": "components.estimators.star_tracker",
    "StarTrackerGyro": "components.estimators.star_tracker_gyro",
    "Sum": "components.environment.sum",
    "Thrusters": "components.actuators.thrusters",
    "VscmgSpacecraft": "components.plants.vscmg_spacecraft",
    "WeightedSteering": "components.actuators.weighted_steering",
}
"""Name of a component, which is that of its class -> its module."""


class Catalog(Mapping[str, "Callable[[], Component]"]):
    """The entries, each imported when it is asked for."""

    def __getitem__(self, name: str) -> "Callable[[], Component]":
        """Return the component's class."""
        return getattr(import_module(MODULES[name]), name)

    def __contains__(self, name: object) -> bool:
        """Whether there is such a component; imports none."""
        return name in MODULES

    def __iter__(self) -> Iterator[str]:
        """Iterate over the names, in alphabetical order."""
        return iter(MODULES)

    def __len__(self) -> int:
        """Return how many there are."""
        return len(MODULES)


CATALOG = Catalog()
