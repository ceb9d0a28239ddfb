"""Small packages, written where a test needs them: FMUs of a few lines of C, descriptions as one would type them."""

import zipfile
from dataclasses import replace
from pathlib import Path

import pytest

from cosim import load, simulate
from cosim.ssp.errors import SspError

from ..c_fmu import boolean, build, enumeration, integer, real, string

NAMESPACES = (
    'xmlns:ssd="http://ssp-standard.org/SSP1/SystemStructureDescription" '
    'xmlns:ssc="http://ssp-standard.org/SSP1/SystemStructureCommon" '
    'xmlns:ssv="http://ssp-standard.org/SSP1/SystemStructureParameterValues" '
    'xmlns:ssm="http://ssp-standard.org/SSP1/SystemStructureParameterMapping"'
)
HEAD = '<?xml version="1.0" encoding="UTF-8"?>\n'
DEGREE = "0.017453292519943295"
UNITS = (
    f'<Unit name="rad"><BaseUnit rad="1"/></Unit><Unit name="deg"><BaseUnit rad="1" factor="{DEGREE}"/></Unit>'
    '<Unit name="s"><BaseUnit s="1"/></Unit>'
)
SSP_UNITS = UNITS.replace("<", "<ssc:").replace("<ssc:/", "</ssc:")
"""The same in SSP's words."""
ITEMS = {"off": 1, "slow": 2, "fast": 5}


def line(folder: Path, name: str = "Line", unit: str = "", **capabilities) -> Path:
    """An FMU with y = k u + c at once, x' = y from x = x0, and a parameter of every type, each as an output too."""
    variables = [
        real("u", "input", unit=unit),
        real("y", depends="u", unit=unit),
        real("x"),
        real("k", "parameter", start=1.0),
        real("c", "parameter", start=0.0, unit=unit),
        integer("n", "parameter", start=3),
        boolean("on", "parameter", start=False),
        enumeration("mode", "parameter", start=1, items=ITEMS),
        string("label", "parameter", start="none"),
        integer("n_out"),
        boolean("on_out"),
        enumeration("mode_out", items=ITEMS),
        string("label_out"),
    ]
    outputs = "y = k * u + c; x = m->state[0]; n_out = n; on_out = on; mode_out = mode; strcpy(label_out, label);"
    units = UNITS if unit else ""
    return build(
        folder, name, variables, outputs=outputs, step="m->state[0] += h * (k * u + c);", units=units, **capabilities
    )


@pytest.fixture(scope="session")
def fmus(tmp_path_factory) -> dict[str, Path]:
    """Line without units, Angle in rad, Degrees in deg."""
    folder = tmp_path_factory.mktemp("ssp-fmus")
    units = {"Line": "", "Angle": "rad", "Degrees": "deg"}
    return {name: line(folder, name, unit) for name, unit in units.items()}


CONNECTORS = '<ssd:Connector name="u" kind="input"/><ssd:Connector name="y" kind="output"/>'


def component(name: str, fmu: str = "Line", *, connectors: str = CONNECTORS, inside: str = "", more: str = "") -> str:
    """A component of resources/FMU.fmu."""
    connected = f"<ssd:Connectors>{connectors}</ssd:Connectors>" if connectors else ""
    source = f'source="resources/{fmu}.fmu"' if "source=" not in more else ""
    return f'<ssd:Component name="{name}" {source} {more}>{connected}{inside}</ssd:Component>'


def connection(start: str, end: str, inside: str = "", more: str = "") -> str:
    """A connection of "a.y" and "b.u"; a name without a dot is a connector of the system."""
    ends = ""
    for side, text in (("start", start), ("end", end)):
        element, _, connector = text.rpartition(".")
        ends += f' {side}Element="{element}"' if element else ""
        ends += f' {side}Connector="{connector}"'
    return f"<ssd:Connection{ends} {more}>{inside}</ssd:Connection>"


def system(
    name: str, elements: str, connections: str = "", *, connectors: str = "", bindings: str = "", more=""
) -> str:
    """A system; with `bindings` as in `values`."""
    parts = f"<ssd:Connectors>{connectors}</ssd:Connectors>" if connectors else ""
    parts += bindings + f"<ssd:Elements>{elements}</ssd:Elements>"
    parts += f"<ssd:Connections>{connections}</ssd:Connections>" if connections else ""
    return f'<ssd:System name="{name}" {more}>{parts}</ssd:System>'


def parameter(name: str, value: object, kind: str = "Real", more: str = "") -> str:
    """One parameter of a set."""
    return f'<ssv:Parameter name="{name}"><ssv:{kind} value="{value}" {more}/></ssv:Parameter>'


def parameter_set(*parameters: str, more: str = "", version: str = "1.0", namespaces: str = "") -> str:
    """A parameter set; `more`: elements after the parameters."""
    inside = f"<ssv:Parameters>{''.join(parameters)}</ssv:Parameters>{more}"
    return f'<ssv:ParameterSet version="{version}" name="set" {namespaces}>{inside}</ssv:ParameterSet>'


def bindings(*each: str) -> str:
    """The bindings of an element."""
    return f"<ssd:ParameterBindings>{''.join(each)}</ssd:ParameterBindings>"


def inline(given: str, mapping: str = "", more: str = "") -> str:
    """A binding of a parameter set within."""
    mapped = f"<ssd:ParameterMapping>{mapping}</ssd:ParameterMapping>" if mapping else ""
    inside = f"<ssd:ParameterValues>{given}</ssd:ParameterValues>{mapped}"
    return f"<ssd:ParameterBinding {more}>{inside}</ssd:ParameterBinding>"


def values(**given: object) -> str:
    """Bindings of one inline set of Reals."""
    return bindings(inline(parameter_set(*(parameter(name, value) for name, value in given.items()))))


def structure(
    top: str, *, version: str = "1.0", experiment: str = '<ssd:DefaultExperiment stopTime="1"/>', units=""
) -> str:
    """A whole description."""
    defined = f"<ssd:Units>{units}</ssd:Units>" if units else ""
    return (
        f'{HEAD}<ssd:SystemStructureDescription version="{version}" name="made" {NAMESPACES}>'
        f"{top}{defined}{experiment}</ssd:SystemStructureDescription>"
    )


def package(path: Path, ssd: str, fmus: dict[str, Path], files: dict[str, str | bytes] | None = None) -> Path:
    """Write a package of a description, FMUs in resources/, and further files by name."""
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("SystemStructure.ssd", ssd)
        for name, file in fmus.items():
            archive.write(file, f"resources/{name}.fmu")
        for name, content in (files or {}).items():
            archive.writestr(name, content)
    return path


def start(path: Path, *names: str):
    """Values of a package's variables at the start, after a flight of one step."""
    system, experiment = load(path, stop=1.0, step=0.5)
    result = simulate(system, experiment)
    found = [result.table.column(name)[0].as_py() for name in names]
    return found[0] if len(names) == 1 else found


def refused(path: Path) -> str:
    """What reading a package that is refused says."""
    with pytest.raises(SspError) as caught:
        load(path)
    return str(caught.value)


def same(system, other):
    """Whether systems are equal but for where their FMUs lie."""
    return replace(other, components=system.components) == system


def edited(path, old, new, member="SystemStructure.ssd"):
    """Change a text in a package, as another tool would."""
    with zipfile.ZipFile(path) as archive:
        files = {name: archive.read(name) for name in archive.namelist()}
    text = files[member].decode()
    assert old in text
    files[member] = text.replace(old, new).encode()
    with zipfile.ZipFile(path, "w") as archive:
        for name, data in files.items():
            archive.writestr(name, data)
    return path
