"""The one place that knows which slave flies which FMU."""

from pathlib import Path

from cosim.slaves.shelf import SHELF
from cosim.slaves.slave import Slave


def open_fmu(name: str, path: Path) -> Slave:
    """Return an instance of an FMU file, not yet instantiated; raises `FmuError`."""
    description = SHELF.description(path)
    if description.fmi_version == "1.0":
        if description.model_exchange:
            from cosim.slaves.model_exchange import ModelExchange1

            return ModelExchange1(name, path)
        from cosim.slaves.fmi1 import Fmi1Slave

        return Fmi1Slave(name, path)
    if description.model_exchange:
        from cosim.slaves.model_exchange import ModelExchange2, ModelExchange3

        return (ModelExchange3 if description.fmi_version.startswith("3") else ModelExchange2)(name, path)
    if description.fmi_version.startswith("3"):
        from cosim.slaves.fmi3 import Fmi3Slave

        return Fmi3Slave(name, path)
    from cosim.slaves.fmi2 import FmuSlave

    return FmuSlave(name, path)


def open_isolated(name: str, path: Path) -> Slave:
    """Return an instance of an FMU file in a process of its own; raises `FmuError`."""
    from cosim.slaves.isolation.isolated import Isolated

    return Isolated(name, path)
