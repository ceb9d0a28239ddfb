"""Time series as a native FMU: table.c, the same for every table, and the samples as C beside it.

It has outputs only. What they are between samples says table.c; at a jump of a `previous` series they have the new
value. The FMU needs nothing but the C library, and flies in every tool that takes FMI 2.0 for co-simulation.

Limits: the samples are compiled, which takes a million of them some ten seconds; `LARGEST` are taken.
"""

import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import fmpy
import numpy as np
from numpy.typing import NDArray

from fmus import places
from fmus.description.annotations import TOOL
from fmus.description.description import ModelDescription, ScalarVariable
from fmus.description.units import Unit
from fmus.description.write import write
from fmus.errors import BuildError
from fmus.export.archive import guid_of, write_fmu
from fmus.export.native.native_fmu import HEADERS
from fmus.export.origin import build_date
from fmus.toolchain import HOST, SUFFIXES, compile_library, host_platform, resolve_platforms

SOURCE = Path(__file__).with_name("table.c")

LARGEST = 2_000_000
"""Numbers that a table may have."""

KINDS = {"Real": "REAL", "Integer": "INTEGER", "Enumeration": "INTEGER", "Boolean": "BOOLEAN"}


@dataclass(frozen=True)
class Output:
    """An output, with its name, type, unit, items; knots in s, shape (n,), and what table.c takes between them.

    `degree` 0 and 1: a value for each knot, shape (n,); 3: coefficients of each piece, shape (n - 1, 4).
    """

    variable: ScalarVariable
    degree: int
    time: NDArray[np.float64]
    numbers: NDArray[np.float64]


def build_table(
    path: Path,
    outputs: Sequence[Output],
    units: Mapping[str, Unit],
    platforms: Sequence[str] = (HOST,),
    description: str = "",
) -> Path:
    """Write the FMU; raises `BuildError`, of which `NoCompiler` is a kind."""
    said = _describe(path.stem, outputs, units, description)
    sources = {name: (Path(fmpy.__file__).parent / "c-code" / name).read_bytes() for name in HEADERS}
    sources |= {SOURCE.name: SOURCE.read_bytes(), "table.h": _header(outputs)}
    guid = guid_of("table", write(said), sources)
    sources["table.h"] += f'#define TABLE_GUID "{guid}"\n'.encode()
    files = {f"sources/{name}": data for name, data in sources.items()}
    with tempfile.TemporaryDirectory(dir=places.workshop()) as place:
        folder = Path(place) / "sources"
        folder.mkdir()
        for name, data in sources.items():
            (folder / name).write_bytes(data)
        for platform in resolve_platforms(platforms):
            system = host_platform() if platform == HOST else platform
            library = Path(place) / system / f"{said.model_identifier}{SUFFIXES[system]}"
            compile_library(folder, SOURCE.name, library, platform)
            files[f"binaries/{system}/{library.name}"] = library.read_bytes()
    xml = write(replace(said, guid=guid, generation_date=build_date()))
    return write_fmu(path, {"modelDescription.xml": xml, **files})


def _describe(name: str, outputs: Sequence[Output], units: Mapping[str, Unit], description: str) -> ModelDescription:
    """Return what the FMU says, with an empty GUID."""
    variables: dict[str, ScalarVariable] = {}
    for i, output in enumerate(outputs):
        moving = output.degree > 0
        variables[output.variable.name] = replace(
            output.variable,
            value_reference=i,
            causality="output",
            variability="continuous" if moving else "discrete",
            initial="calculated",
            start=None,
        )
    used = {v.unit: units[v.unit] for v in variables.values() if v.unit is not None and v.unit in units}
    return ModelDescription(
        model_name=name,
        model_identifier=name,
        guid="",
        variables=variables,
        dependencies=dict.fromkeys(variables, ()),
        initial_unknowns=dict.fromkeys(variables, ()),
        units=used,
        max_output_derivative_order=1,
        can_get_and_set_state=True,
        can_serialize_state=True,
        source_files=(SOURCE.name,),
        generation_tool=TOOL,
        description=description,
    )


def _header(outputs: Sequence[Output]) -> bytes:
    """Return table.h but for its last line; an array that several outputs have stands there once."""
    size = sum(output.numbers.size + output.time.size for output in outputs)
    if size > LARGEST:
        problem = f"its time series have {size} numbers, at most {LARGEST} are compiled into an FMU"
        raise BuildError(f"{problem}. Give signals fewer samples.")
    lines = ["/* Generated from time series. */", "#define D static const double"]
    names: dict[bytes, str] = {}
    rows: list[str] = []
    for output in outputs:
        arrays: list[str] = []
        for array in (output.time, output.numbers):
            key = array.tobytes()
            if key not in names:
                names[key] = f"a{len(names)}"
                lines.append(f"D {names[key]}[] = {{{','.join(map(repr, array.ravel().tolist()))}}};")
            arrays.append(names[key])
        kind = KINDS[output.variable.type]
        rows.append(f"    {{{kind}, {output.degree}, {len(output.time)}, {arrays[0]}, {arrays[1]}}},")
    lines += [f"enum {{ N_CHANNELS = {len(outputs)} }};", "static const Channel channels[] = {", *rows, "};"]
    return ("\n".join(lines) + "\n").encode()
