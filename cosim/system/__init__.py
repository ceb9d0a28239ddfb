"""A system on paper: what flies, how it is wired, with which values; and that checked against the FMUs."""

from cosim.system.component import Component
from cosim.system.fault import Fault
from cosim.system.signal import Signal
from cosim.system.system import At, Connection, Experiment, System
from cosim.system.timing import TIMINGS, Timing
from cosim.system.value import Value

__all__ = ["TIMINGS", "At", "Component", "Connection", "Experiment", "Fault", "Signal", "System", "Timing", "Value"]
