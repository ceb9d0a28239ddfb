"""FMUs of a loop, instantiated and initialized by hand on fmpy, for loops that are written by hand."""

from dataclasses import dataclass

from fmpy import extract, read_model_description
from fmpy.fmi2 import FMU2Slave
from loop import Loop, Port


@dataclass
class Unit:
    """An instance. Its outputs stand at `first` and on in the vector of all; `sources`: where its inputs come from."""

    slave: FMU2Slave
    references: dict[str, int]
    inputs: list[int]
    sources: list[int]
    outputs: list[int]
    first: int


def initialized(loop: Loop) -> tuple[list[Unit], list[Port]]:
    """Return the instances after initialization, and the ports of the vector of outputs."""
    wanted = dict.fromkeys([source for source, _ in loop.wires] + loop.shown)
    ports = [port for name in loop.fmus for port in wanted if port[0] == name]
    units: dict[str, Unit] = {}
    folders = {path: extract(path) for path in set(loop.fmus.values())}  # one library a file, however many instances
    for name, path in loop.fmus.items():
        description = read_model_description(path)
        slave = FMU2Slave(
            guid=description.guid,
            unzipDirectory=folders[path],
            modelIdentifier=description.coSimulation.modelIdentifier,
            instanceName=name,
        )
        slave.instantiate()
        slave.setupExperiment(startTime=0.0)
        slave.enterInitializationMode()
        references = {v.name: v.valueReference for v in description.modelVariables}
        own = [(source, variable) for source, (target, variable) in loop.wires if target == name]
        outputs = [references[variable] for instance, variable in ports if instance == name]
        units[name] = Unit(
            slave,
            references,
            [references[variable] for _, variable in own],
            [ports.index(source) for source, _ in own],
            outputs,
            next((i for i, port in enumerate(ports) if port[0] == name), 0),
        )
    for _ in units:  # as often as there are units: outputs have come through all of them, whatever their order
        for (source, output), (target, variable) in loop.wires:
            a, b = units[source], units[target]
            b.slave.setReal([b.references[variable]], a.slave.getReal([a.references[output]]))
    for unit in units.values():
        unit.slave.exitInitializationMode()
    return list(units.values()), ports
