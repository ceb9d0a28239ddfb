"""Co-simulation of attitude-control systems: FMI 2.0 FMUs wired by an explicit master, recorded, judged.

What a script needs is here by its name, and loaded when it is first used:
System, Connection, Experiment, Value, Explicit, Result. The function that flies them is cosim.flights.simulate.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from cosim.masters.explicit import Explicit
    from cosim.results.result import Result
    from cosim.system.system import Connection, Experiment, System, Value

__all__ = ["Connection", "Experiment", "Explicit", "Result", "System", "Value"]

_HOMES = {
    "Connection": "cosim.system.system",
    "Experiment": "cosim.system.system",
    "Explicit": "cosim.masters.explicit",
    "Result": "cosim.results.result",
    "System": "cosim.system.system",
    "Value": "cosim.system.system",
}


def __getattr__(name: str) -> Any:
    """Load a public name from its module."""
    if name in _HOMES:
        return getattr(import_module(_HOMES[name]), name)
    raise AttributeError(f"module 'cosim' has no attribute {name!r}. It offers: {', '.join(__all__)}.")
