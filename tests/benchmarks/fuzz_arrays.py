"""Broken descriptions of FMI 3.0: each is read, wired, and laid out for calls, or refused by an error of ours.

python tests/benchmarks/fuzz_arrays.py [COUNT [FIRST SEED]]
"""

import random
from pathlib import Path

from cosim.errors import SimulationError
from cosim.slaves.elements import Elements
from cosim.system import System
from cosim.system.expand import wire
from fmus.description.read import parse_description

if __package__:
    from .fuzz_descriptions import mutated_text
else:
    from fuzz_descriptions import mutated_text

XML = """<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="3.0" modelName="M" instantiationToken="{1}" generationTool="by hand">
<CoSimulation modelIdentifier="M" canHandleVariableCommunicationStepSize="true" maxOutputDerivativeOrder="1"/>
<UnitDefinitions><Unit name="rad"><BaseUnit rad="1" factor="1"/><DisplayUnit name="deg" factor="57.3"/></Unit>
</UnitDefinitions>
<TypeDefinitions><EnumerationType name="Mode"><Item name="off" value="1"/><Item name="on" value="2"/></EnumerationType>
<Float64Type name="Angle" unit="rad" min="-3" max="3"/></TypeDefinitions>
<LogCategories><Category name="logAll"/></LogCategories>
<DefaultExperiment startTime="0" stopTime="1" tolerance="1e-6" stepSize="0.1"/>
<ModelVariables>
<UInt64 name="n" valueReference="1" causality="structuralParameter" start="3" min="0" max="5"/>
<Float64 name="v" valueReference="2" causality="input" declaredType="Angle" start="0 0 0">
<Dimension valueReference="1"/></Float64>
<Float64 name="A" valueReference="3" causality="parameter" variability="tunable" start="1 2 3 4 5 6">
<Dimension start="2"/><Dimension valueReference="1"/></Float64>
<Float32 name="y" valueReference="4" causality="output" unit="rad"><Dimension start="2"/><Alias name="z"/></Float32>
<Float64 name="x" valueReference="5" initial="exact" start="1" nominal="2"/>
<Float64 name="der(x)" valueReference="6" derivative="5"/>
<Enumeration name="mode" valueReference="7" causality="parameter" declaredType="Mode" start="1"/>
<Int8 name="i" valueReference="8" causality="parameter" start="-3"/>
<Boolean name="on" valueReference="9" causality="parameter" start="true"/>
<String name="label" valueReference="10" causality="parameter"><Start value="a"/></String>
<Binary name="blob" valueReference="11" causality="output"/>
<Clock name="tick" valueReference="12" causality="input" intervalVariability="triggered"/>
</ModelVariables>
<ModelStructure><Output valueReference="4" dependencies="2 5" dependenciesKind="dependent dependent"/>
<ContinuousStateDerivative valueReference="6" dependencies="2"/><InitialUnknown valueReference="4" dependencies="2"/>
</ModelStructure>
</fmiModelDescription>
"""


def attempt(seed: int, folder: Path) -> str:
    """Return how one description ended, the name of the error or "read"; anything else is raised."""
    chance = random.Random(seed)
    text = mutated_text(chance, XML)
    try:
        description = parse_description(text.encode("utf-8", "replace"), folder / "a.fmu")
        wire(System(name="s", components={"a": "M"}, held={"a.v": 0.0}), {"a": description})
    except SimulationError as error:
        str(error)
        return type(error).__name__
    elements = Elements(description)
    elements.calls(tuple(v.value_reference for v in description.variables.values()))
    return "read"


if __name__ == "__main__":
    from fuzz import run

    run(attempt, 2000)
