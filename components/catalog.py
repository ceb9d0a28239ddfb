"""FMU name -> the component with its structure and start values: what builds, tests and docs iterate.

Importing this builds no CasADi function; calling an entry declares variables only.
"""

from collections.abc import Callable

from .actuators.cmg_cluster import CmgCluster
from .controllers.adaptive_tracking import AdaptiveTracking
from .controllers.prescribed_performance import PrescribedPerformance
from .environment.harmonic_torque import HarmonicTorque
from .environment.sum import Sum
from .framework import Component
from .guidance.euler_sinusoid import EulerSinusoid
from .plants.flexible_spacecraft import FlexibleSpacecraft

CATALOG: dict[str, Callable[[], Component]] = {
    "AdaptiveTracking": AdaptiveTracking,
    "CmgCluster": CmgCluster,
    "EulerSinusoid": EulerSinusoid,
    "FlexibleSpacecraft": FlexibleSpacecraft,
    "HarmonicTorque": HarmonicTorque,
    "PrescribedPerformance": PrescribedPerformance,
    "Sum": Sum,
}
