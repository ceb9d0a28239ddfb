"""Broken FMUs, of mutated descriptions and archives: each is read, wired and extracted, or refused by an error of ours.

python tests/benchmarks/fuzz_descriptions.py [COUNT [FIRST SEED]]
"""

import random
import re
import tempfile
import zipfile
from pathlib import Path

from cosim.errors import SimulationError
from cosim.system import System
from cosim.system.expand import wire
from fmus.description import archive
from fmus.description.read import read_description

XML = """<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="2.0" modelName="M" guid="{1}" generationTool="by hand" numberOfEventIndicators="0">
<CoSimulation modelIdentifier="M" canHandleVariableCommunicationStepSize="true" maxOutputDerivativeOrder="1"/>
<UnitDefinitions><Unit name="rad"><BaseUnit rad="1" factor="1"/><DisplayUnit name="deg" factor="57.3"/></Unit>
</UnitDefinitions>
<TypeDefinitions><SimpleType name="Mode"><Enumeration><Item name="off" value="1"/><Item name="on" value="2"/>
</Enumeration></SimpleType><SimpleType name="Angle"><Real unit="rad" min="-3" max="3"/></SimpleType></TypeDefinitions>
<LogCategories><Category name="logAll"/></LogCategories>
<DefaultExperiment startTime="0" stopTime="1" tolerance="1e-6" stepSize="0.1"/>
<VendorAnnotations><Tool name="adcs-cosim"><Slave refresh="true"><StepMean variable="y"/></Slave></Tool>
</VendorAnnotations>
<ModelVariables>
<ScalarVariable name="v[1]" valueReference="0" causality="input"><Real declaredType="Angle" start="0"/></ScalarVariable>
<ScalarVariable name="v[2]" valueReference="1" causality="input"><Real declaredType="Angle" start="0"/></ScalarVariable>
<ScalarVariable name="y" valueReference="2" causality="output"><Real unit="rad" derivative="4"/></ScalarVariable>
<ScalarVariable name="x" valueReference="3" initial="exact"><Real start="1" nominal="2"/></ScalarVariable>
<ScalarVariable name="mode" valueReference="0" causality="parameter" variability="fixed">
<Enumeration declaredType="Mode" start="1"/></ScalarVariable>
<ScalarVariable name="n" valueReference="1" causality="parameter" variability="tunable"><Integer start="3"/>
</ScalarVariable>
<ScalarVariable name="on" valueReference="0" causality="parameter" variability="fixed"><Boolean start="true"/>
</ScalarVariable>
<ScalarVariable name="label" valueReference="0" causality="parameter" variability="fixed"><String start="a"/>
</ScalarVariable>
</ModelVariables>
<ModelStructure><Outputs><Unknown index="3" dependencies="1 2" dependenciesKind="dependent dependent"/></Outputs>
<InitialUnknowns><Unknown index="3" dependencies="1"/></InitialUnknowns></ModelStructure>
</fmiModelDescription>
"""
VALUES = [
    "",
    "0",
    "-1",
    "1e999",
    "nan",
    "INF",
    "9" * 30,
    "9" * 5000,
    "true",
    "x[9999999999]",
    "v[ 1 ]",
    "v[1",
    "../../M",
]
VALUES += [
    "2147483648",
    "a b",
    "é",
    "&lt;",
    "&amp;x;",
    "[",
    "der(x)",
    "input",
    "local",
    "independent",
    "3 3",
    "Real",
    "\n",
]
ENDS = [b"\0", b"\xff", b"PK", b"<", b">", b'"', b"&", b"/", b"99999"]


ATTRIBUTE = re.compile(r' \w+="[^"]*"')
ELEMENT = re.compile(r"<(\w+)(?: [^>]*)?/>|<(\w+)(?: [^>]*)?>(?:(?!</?\2).)*</\2>\n?", re.DOTALL)


def mutated_text(chance: random.Random, text: str = XML) -> str:
    """Change, lose or swap attributes, lose, double or move elements; of one in eight the letters too."""
    for _ in range(chance.randint(1, 3)):
        kind = chance.choice(("value",) * 5 + ("attribute", "attribute", "lost", "twice", "moved"))
        pattern = ATTRIBUTE if kind in ("value", "attribute") else ELEMENT
        found = list(pattern.finditer(text))[1:]
        if not found:
            continue
        one, other = chance.choice(found), chance.choice(found)
        name = one.group().partition("=")[0]
        value = chance.choice([*VALUES, *re.findall('"([^"]*)"', other.group())])
        new = {"value": f'{name}="{value}"', "twice": 2 * one.group(), "moved": other.group()}.get(kind, "")
        text = text[: one.start()] + new + text[one.end() :]
    if chance.randrange(8) == 0:
        at = chance.randrange(len(text))
        text = text[:at] + chance.choice('<>"&/=[]0 é\0') + text[at + chance.randint(0, 2) :]
    return text


def mutated_bytes(chance: random.Random, data: bytes) -> bytes:
    """Change, cut or add bytes, most of them near the end, where the archive's directory is."""
    for _ in range(chance.randint(1, 4)):
        at = chance.randrange(len(data)) if chance.random() < 0.5 else max(0, len(data) - chance.randint(1, 200))
        new = chance.choice([*ENDS, bytes([chance.randrange(256)])])
        data = data[:at] + new + data[at + chance.choice([0, 1, len(new), 50]) :]
    return data


def attempt(seed: int, folder: Path) -> str:
    """Return how one FMU ended, the name of the error or "read"; anything else is raised."""
    chance = random.Random(seed)
    path = folder / "a.fmu"
    broken = seed % 2
    with zipfile.ZipFile(path, "w", chance.choice([zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED])) as made:
        made.writestr("modelDescription.xml", XML if broken else mutated_text(chance))
        made.writestr("resources/more.txt", b"more " * 50)
    if broken:
        path.write_bytes(mutated_bytes(chance, path.read_bytes()))
    try:
        description = read_description(path)
        wire(System(name="s", components={"a": "M"}, held={"a.v": 0.0}), {"a": description})
        with tempfile.TemporaryDirectory(dir=folder) as out:
            archive.extract(path, Path(out))
    except SimulationError as error:
        str(error)
        return type(error).__name__
    return "read"


if __name__ == "__main__":
    from fuzz import run

    run(attempt, 2000)
