"""The native back end: a component as C, in an FMU that needs nothing but the C library.

CasADi writes the component's functions (model.c), this module its names, sizes and start values (model.h);
native/fmi2.c, the same for every component, includes both. The sources travel in the FMU, to be compiled elsewhere.
"""

import re
import tempfile
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from string import Formatter

import casadi as ca
import fmpy

from components.framework import Component
from components.framework.unit_vectors import ROUNDING, TYPED, lengths_said
from fmus import places
from fmus.description.annotations import COMMIT_SHOWN, INPUTS_REFUSED, SAMPLE_TIME, SOLVER_STEP
from fmus.description.description import DefaultExperiment, ModelDescription, ScalarVariable
from fmus.description.write import write
from fmus.errors import BuildError
from fmus.export.archive import guid_of, write_fmu
from fmus.export.describe import PROPOSED, describe
from fmus.export.documentation.files import documents
from fmus.export.native.functions import native_functions
from fmus.export.native.large import OPTIMISATION, in_pieces, is_large
from fmus.export.origin import build_date, origin_of
from fmus.export.regions import REGIONS, regions_of
from fmus.toolchain import HOST, SUFFIXES, compile_library, host_platform, resolve_platforms

BACKEND = "native"
RUNTIME = Path(__file__).with_name("fmi2.c")
INCLUDED = (Path(__file__).with_name("internal_step.c"),)
HEADERS = ("fmi2Functions.h", "fmi2FunctionTypes.h", "fmi2TypesPlatform.h")
FIELD = "\1"  # stands for a number in the text of a condition, as in fmi2.c


def build_native(
    component: Component,
    path: Path,
    model_name: str | None = None,
    platforms: Sequence[str] = (HOST,),
    experiment: DefaultExperiment = PROPOSED,
) -> Path:
    """Write a native FMU of the component to `path` and return it: of the same component the same bytes but the date.

    platforms: "host", "all", "linux64", "win64", "darwin64". experiment: what the FMU says that it is flown with.
    Raises BuildError, NoCompiler, CompileFailed.
    """
    name = model_name or path.stem
    if component.python_only:
        raise BuildError(
            f"{component.name} is written in plain Python, which gives no C: build it with --backend python."
        )
    wanted = resolve_platforms(platforms)
    functions = native_functions(component)
    optimisation = OPTIMISATION if is_large(component.size(component.states), functions) else None
    description = describe_native(component, name, experiment)
    sources = native_sources(component, description, functions)
    files = {f"sources/{file}": data for file, data in sources.items()}
    with tempfile.TemporaryDirectory(dir=places.workshop()) as place:
        folder = Path(place) / "sources"
        folder.mkdir()
        for file, data in sources.items():
            (folder / file).write_bytes(data)
        for platform in wanted:
            system = host_platform() if platform == HOST else platform
            library = Path(place) / system / f"{description.model_identifier}{SUFFIXES[system]}"
            compile_library(folder, RUNTIME.name, library, platform, optimisation=optimisation)
            files[f"binaries/{system}/{library.name}"] = library.read_bytes()
    xml = write(replace(description, guid=native_guid(description, sources), generation_date=build_date()))
    return write_fmu(path, {"modelDescription.xml": xml, **documents(component, description), **files})


def describe_native(
    component: Component, model_name: str, experiment: DefaultExperiment = PROPOSED
) -> ModelDescription:
    """Return what the native FMU of a component says, with an empty GUID."""
    return describe(
        component,
        model_name,
        derivatives=True,
        experiment=experiment,
        can_interpolate_inputs=True,
        max_input_derivative_order=3,
        max_output_derivative_order=0 if component.sampled else 1,
        source_files=(RUNTIME.name,),
        **origin_of(component),
    )


def native_sources(
    component: Component, description: ModelDescription, functions: Sequence[ca.Function] | None = None
) -> dict[str, bytes]:
    """Return the C sources of an FMU by file name; fmi2.c is the one to compile.

    functions: native_functions of the component, where they are made already.
    """
    functions = native_functions(component) if functions is None else functions
    code, sizes = _generated(functions, is_large(component.size(component.states), functions))
    sources = {file: (Path(fmpy.__file__).parent / "c-code" / file).read_bytes() for file in HEADERS}
    sources |= {file.name: file.read_bytes() for file in INCLUDED}
    sources |= {
        RUNTIME.name: RUNTIME.read_bytes(),
        "model.c": code,
        "model.h": _model_header(component, description, functions),
    }
    sources["model.c"] += sizes
    sources["model.h"] += f'#define MODEL_GUID "{native_guid(description, sources)}"\n'.encode()
    return sources


def native_guid(description: ModelDescription, sources: dict[str, bytes]) -> str:
    """Return the hash of the description and the sources, but for the line in model.h that holds it."""
    header = re.sub(rb"#define MODEL_GUID .*\n", b"", sources["model.h"])
    return guid_of(BACKEND, write(description), sources | {"model.h": header})


# ---- model.c -----------------------------------------------------------------------------------------------


def _generated(functions: Sequence[ca.Function], large: bool) -> tuple[bytes, bytes]:
    """Return the C code of functions, and the sizes of their arguments, results and work vectors."""
    options = {"with_header": True, "casadi_int": "int"} | ({"avoid_stack": True} if large else {})
    generator = ca.CodeGenerator("model.c", options)
    for function in functions:
        generator.add(function)
    with tempfile.TemporaryDirectory(dir=places.workshop()) as place:
        generator.generate(f"{place}/")
        code = (Path(place) / "model.c").read_bytes()
        header = (Path(place) / "model.h").read_bytes()
    names = "|".join(f.name() for f in functions) or "-"
    sizes = re.findall(rf"^#define (?:{names})_SZ_\w+ \d+$".encode(), header, re.MULTILINE)
    if large:
        code = in_pieces(code.decode()).encode()
    return code, b"".join(line + b"\n" for line in sizes)


# ---- model.h -----------------------------------------------------------------------------------------------


def _model_header(part: Component, description: ModelDescription, functions: Sequence[ca.Function]) -> bytes:
    conditions = part.functions.conditions
    sizes = {f"N{region.upper()}": regions_of(part, derivatives=True).size[region] for region in REGIONS}
    sizes["NE"] = part.size(part.exact_outputs)
    sizes["NM"] = len(description.step_means)
    kept = {f.name(): f.size1_out(0) for f in functions if f.name() in ("fixed", "held")}
    sizes["NK"], sizes["NG"] = kept.get("fixed", 0), kept.get("held", 0)
    sizes["N_CONDITIONS"] = len(conditions)
    sizes["N_SHOWN"] = sum(len(c.shown) for c in conditions)
    takes = any(f.name() == "outputs" and f.size1_in("g") for f in functions)
    variables = description.variables
    lines = [
        f"/* Generated from the component {part.name}. */",
        f"#define MODEL_NAME {_quoted(description.model_name)}",
    ]
    lines += [f"#define {name} {size}" for name, size in sizes.items()]
    lines += [f"#define SAMPLED {int(part.sampled)}", f"#define OUTPUTS_HELD {int(takes)}"]
    lines.append(f"#define CHECKS_INPUTS {int(any(part.functions.conditions_of_inputs))}")
    lines.append(f"#define INPUTS_REFUSED {_quoted(INPUTS_REFUSED)}")
    for macro, name in (("SOLVER_STEP", SOLVER_STEP), ("SAMPLE_TIME", SAMPLE_TIME), ("COMMIT_SHOWN", COMMIT_SHOWN)):
        lines.append(f"#define {macro} {variables[name].value_reference if name in variables else 0}")
    rows = [f"    {{{_quoted(v.name)}, {(v.start or 0.0)!r}, {_flags(v)}}}," for v in variables.values()]
    lines += ["static const Variable variables[] = {", *rows, '    {"", 0.0, 0}};']
    if said := lengths_said((*part.states, *part.parameters)):
        texts = ", ".join(_quoted(what) for what in said)
        lines.append(f"enum {{ N_UNIT_VECTORS = {len(said)}, N_UNIT_STATES = {len(lengths_said(part.states))} }};")
        lines += [f"#define UNIT_ROUNDING {ROUNDING!r}", f"#define UNIT_TYPED {TYPED!r}"]
        lines.append(f"static const char *const unit_vectors[] = {{{texts}}};")
    if conditions:
        texts = [f"    {_quoted(_pattern(part, c.text, len(c.shown)))}," for c in conditions]
        lines += ["static const char *const conditions[] = {", *texts, "};"]
        kinds = zip(part.functions.lasting_conditions, part.functions.conditions_of_inputs, strict=True)
        of = ", ".join("OF_PARAMETERS" if lasts else "OF_INPUTS" if moves else "OF_STATES" for lasts, moves in kinds)
        lines.append(f"static const unsigned char condition_of[] = {{{of}}};")
    return ("\n".join(lines) + "\n").encode()


def _flags(variable: ScalarVariable) -> str:
    """Return when a variable may be set and whether it is an output, in the words of fmi2.c."""
    flags: list[str] = []
    if variable.start is not None:
        flags.append("SET_BEFORE")
    if variable.causality == "input" or (variable.causality == "parameter" and variable.variability == "tunable"):
        flags.append("SET_BETWEEN")
    if variable.causality == "output":
        flags.append("OUTPUT")
    return " | ".join(flags) or "0"


def _pattern(part: Component, text: str, shown: int) -> str:
    """Return the text of a condition with FIELD in the place of every number."""
    pieces = list(Formatter().parse(text))
    if sum(field is not None for _, field, _, _ in pieces) != shown:
        raise BuildError(
            f"{part.name}: check: {text!r} has not one {{}} for each of the {shown} numbers that it shows."
        )
    return "".join(literal + (FIELD if field is not None else "") for literal, field, _, _ in pieces)


def _quoted(text: str) -> str:
    """Return a C string literal; what is not plain ASCII as octal escapes."""
    return '"' + "".join(chr(b) if 32 <= b < 127 and b not in b'"\\?' else f"\\{b:03o}" for b in text.encode()) + '"'
