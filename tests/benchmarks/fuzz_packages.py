"""Broken packages, of mutated .ssd, .ssv, .ssm and archives: each is read and wired, or refused by an error of ours.

python tests/benchmarks/fuzz_packages.py [COUNT [FIRST SEED]]
"""

import random
import re
import sys
import zipfile
from functools import cache
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))
from fuzz_descriptions import ATTRIBUTE, ELEMENT, VALUES, mutated_bytes
from fuzz_descriptions import XML as FMU

from cosim.cli.scenario import load
from cosim.errors import SimulationError
from cosim.ssp.package import extracted
from cosim.system.expand import wire
from fmus.description.read import read_description

SPACES = " ".join(
    f'xmlns:{name}="http://ssp-standard.org/SSP1/SystemStructure{rest}"'
    for name, rest in {
        "ssd": "Description",
        "ssc": "Common",
        "ssv": "ParameterValues",
        "ssm": "ParameterMapping",
    }.items()
)
HEAD = '<?xml version="1.0" encoding="UTF-8"?>\n'
PLANT = """<ssd:Component name="{0}" source="resources/M.fmu"><ssd:Connectors>
<ssd:Connector name="v[1]" kind="input"><ssc:Real unit="rad"/></ssd:Connector>
<ssd:Connector name="v[2]" kind="input"/><ssd:Connector name="y" kind="output"/>
<ssd:Connector name="n" kind="parameter"><ssc:Integer/></ssd:Connector>
</ssd:Connectors><ssd:ParameterBindings><ssd:ParameterBinding source="resources/set.ssv">
<ssd:ParameterMapping source="resources/map.ssm"/></ssd:ParameterBinding></ssd:ParameterBindings></ssd:Component>
"""
SSD = f"""{HEAD}<ssd:SystemStructureDescription version="1.0" name="s" {SPACES}>
<ssd:System name="top"><ssd:Connectors><ssd:Connector name="in" kind="input"><ssc:Real unit="deg"/></ssd:Connector>
</ssd:Connectors><ssd:ParameterBindings><ssd:ParameterBinding prefix="inner."><ssd:ParameterValues>
<ssv:ParameterSet version="1.0" name="p"><ssv:Parameters><ssv:Parameter name="b.n"><ssv:Integer value="3"/>
</ssv:Parameter><ssv:Parameter name="u"><ssv:Real value="1"/></ssv:Parameter></ssv:Parameters></ssv:ParameterSet>
</ssd:ParameterValues></ssd:ParameterBinding></ssd:ParameterBindings><ssd:Elements>{PLANT.format("a")}
<ssd:System name="inner" id="it"><ssd:Connectors><ssd:Connector name="u" kind="input"/></ssd:Connectors><ssd:Elements>
{PLANT.format("b")}</ssd:Elements><ssd:Connections><ssd:Connection startConnector="u" endElement="b"
endConnector="v[1]"><ssc:LinearTransformation factor="2" offset="1"/></ssd:Connection></ssd:Connections></ssd:System>
<ssd:Component name="again" type="application/x-ssp-definition" source="#it"/></ssd:Elements><ssd:Connections>
<ssd:Connection startElement="a" startConnector="y" endElement="inner" endConnector="u" suppressUnitConversion="true"/>
<ssd:Connection startConnector="in" endElement="a" endConnector="v[1]"/>
</ssd:Connections></ssd:System><ssd:Units><ssc:Unit name="deg"><ssc:BaseUnit rad="1" factor="0.0175"/></ssc:Unit>
<ssc:Unit name="rad"><ssc:BaseUnit rad="1"/></ssc:Unit></ssd:Units>
<ssd:DefaultExperiment startTime="0" stopTime="1"/><ssd:Annotations><ssc:Annotation type="org.adcs-cosim">
<adcs:Flight xmlns:adcs="urn:adcs-cosim:ssp" version="1"><adcs:System>{{"held": {{"a.v": [0, 1]}}, "parameters":
{{"a.n": 4, "a.mode": {{"!Value": {{"value": "on"}}}}}}, "steps": {{"a": 2}}, "hold_unconnected": true,
"isolated": ["a", "*"]}}</adcs:System>
<adcs:Experiment>{{"stop_time": {{"!Fraction": "1/1"}}, "communication_step_size": 0.1, "master": {{"!Iterated":
{{"tolerance": 1e-7}}}}, "every": 2, "record": ["*"], "events": [{{"!At": {{"time": 0.5, "values": {{"a.n": 5}}}}}}]}}
</adcs:Experiment><adcs:Signals>{{"a": {{"guid": "{{1}}", "inputs": {{"b.v": {{"file": "resources/set.ssv",
"sha256": "0", "columns": ["v[1]", "v[2]"], "interpolation": "linear"}}}}}}}}</adcs:Signals>
</adcs:Flight></ssc:Annotation></ssd:Annotations>
</ssd:SystemStructureDescription>
"""
SSV = f"""{HEAD}<ssv:ParameterSet version="1.0" name="p" {SPACES}><ssv:Parameters>
<ssv:Parameter name="x"><ssv:Real value="90" unit="deg"/></ssv:Parameter>
<ssv:Parameter name="on"><ssv:Boolean value="true"/></ssv:Parameter>
<ssv:Parameter name="mode"><ssv:Enumeration value="on"/></ssv:Parameter>
<ssv:Parameter name="label"><ssv:String value="text"/></ssv:Parameter></ssv:Parameters>
<ssv:Units><ssc:Unit name="deg"><ssc:BaseUnit rad="1" factor="0.0175"/></ssc:Unit></ssv:Units></ssv:ParameterSet>
"""
SSM = f"""{HEAD}<ssm:ParameterMapping version="1.0" {SPACES}>
<ssm:MappingEntry source="x" target="x"><ssc:LinearTransformation factor="2"/></ssm:MappingEntry>
<ssm:MappingEntry source="on" target="on"><ssc:BooleanMappingTransformation><ssc:MapEntry source="true" target="false"/>
</ssc:BooleanMappingTransformation></ssm:MappingEntry><ssm:MappingEntry source="mode" target="mode">
<ssc:EnumerationMappingTransformation><ssc:MapEntry source="on" target="off"/></ssc:EnumerationMappingTransformation>
</ssm:MappingEntry><ssm:MappingEntry source="label" target="label"/></ssm:ParameterMapping>
"""
FILES = {"SystemStructure.ssd": SSD, "resources/set.ssv": SSV, "resources/map.ssm": SSM}
PREFIXED = re.compile(ELEMENT.pattern.replace(r"(\w+)", r"([\w:]+)"), re.DOTALL)
OTHERS = [
    "a",
    "b",
    "inner",
    "in",
    "u",
    "y",
    "v[1]",
    "#it",
    "resources/M.fmu",
    "1/0",
    "[]",
    "{}",
    "2.0",
    "input",
    "output",
]


def mutated(text: str, chance: random.Random) -> str:
    """Change, lose or swap attributes, lose, double or move elements; of some a letter, or a number of the JSON."""
    for _ in range(chance.randint(1, 3)):
        kind = chance.choice(("value",) * 5 + ("attribute", "lost", "twice", "moved", "number"))
        pattern = {"value": ATTRIBUTE, "attribute": ATTRIBUTE, "number": re.compile(r'(?<=: )[^,{}"]+')}.get(
            kind, PREFIXED
        )
        found = list(pattern.finditer(text))[1:]
        if not found:
            continue
        one, other = chance.choice(found), chance.choice(found)
        name = one.group().partition("=")[0]
        value = chance.choice([*VALUES, *OTHERS, *re.findall('"([^"]*)"', other.group())])
        new = {"value": f'{name}="{value}"', "attribute": f'{name}="{value}"', "twice": 2 * one.group()}
        new |= {"moved": other.group(), "number": chance.choice(["null", "-1", '"x"', "[[1]]", "{}", "1e999", "NaN"])}
        text = text[: one.start()] + new.get(kind, "") + text[one.end() :]
    if chance.randrange(8) == 0:
        at = chance.randrange(len(text))
        text = text[:at] + chance.choice('<>"&/=[]0 é\0') + text[at + chance.randint(0, 2) :]
    return text


@cache
def _fmu(folder: Path) -> bytes:
    path = folder / "M.fmu"
    with zipfile.ZipFile(path, "w") as made:
        made.writestr("modelDescription.xml", FMU)
    return path.read_bytes()


def attempt(seed: int, folder: Path) -> str:
    """Return how one package ended, the name of the error or "read"; anything else is raised."""
    chance = random.Random(seed)
    path = folder / "a.ssp"
    broken = seed % 4 == 3
    one = chance.choice(list(FILES)) if not broken else ""
    plain = chance.randrange(2)  # half of them without our annotation
    with zipfile.ZipFile(path, "w", chance.choice([zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED])) as made:
        for name, text in FILES.items():
            text = re.sub("<ssd:Annotations>.*</ssd:Annotations>", "", text, flags=re.DOTALL) if plain else text
            made.writestr(name, mutated(text, chance) if name == one else text)
        made.writestr("resources/M.fmu", _fmu(folder))
    if broken:
        path.write_bytes(mutated_bytes(chance, path.read_bytes()))
    try:
        system, _ = load(path)
        wire(system, {name: read_description(extracted(str(fmu))) for name, fmu in system.components.items()})
    except SimulationError as error:
        str(error)
        return type(error).__name__
    return "read"


if __name__ == "__main__":
    from fuzz import run

    run(attempt, 2000)
