"""An FMU that brings C sources and no binary for this machine: they are compiled into its extracted folder.

The files are those that modelDescription.xml (FMI 2.0) or sources/buildDescription.xml (FMI 3.0) lists, with their own
FMI headers, else those that fmpy brings. Sources that are not C, or are not listed, are refused.
"""

from collections.abc import Iterable
from pathlib import Path

import fmpy
from fmpy.model_description import BuildConfiguration, read_build_description

from fmus.description.description import ModelDescription
from fmus.description.errors import FmuError
from fmus.errors import BuildError
from fmus.toolchain import compile_library

FLAGS = ("-std=gnu11", "-fvisibility=default", "-O1")
"""Sources count on what compilers do unless told, and with a prefix FMI's headers mark nothing as to be exported.

-O1 compiles large models in half the time that -O3 takes.
"""

LANGUAGES = ("", "C89", "C90", "C99", "C11", "C17")


def compile_sources(path: Path, folder: Path, description: ModelDescription) -> None:
    """Compile the sources of an FMU, extracted into a folder, for this machine; raises `FmuError`."""
    defines, files, includes = _listed(path, folder, description)
    sources = folder / "sources"
    for name in files:
        if not (sources / name).resolve().is_relative_to(sources.resolve()) or not (sources / name).is_file():
            raise FmuError(path, f"it lists the source {name}, which is not under its sources")
    place = fmpy.platform_tuple if description.fmi_version.startswith("3") else fmpy.platform
    output = folder / "binaries" / place / f"{description.model_identifier}{fmpy.sharedLibraryExtension}"
    include = (sources, *(sources / i for i in includes), Path(fmpy.__file__).parent / "c-code")
    first, *others = dict.fromkeys(f"./{name}" for name in files)
    try:
        compile_library(sources, first, output, include=include, more=(*FLAGS, *defines, *others))
    except BuildError as error:
        raise FmuError(
            path, f"it has no binary for {fmpy.platform}, and its sources cannot be compiled: {error}"
        ) from error


def _listed(path: Path, folder: Path, description: ModelDescription) -> tuple[list[str], list[str], list[str]]:
    """Return preprocessor definitions, sources, and folders of headers, as the FMU lists them."""
    if not description.fmi_version.startswith("3"):
        files = _compiled(description.source_files)
        if not files:
            raise FmuError(path, f"it has no binary for {fmpy.platform}, and its modelDescription.xml lists no sources")
        return [], files, []
    try:
        found: list[BuildConfiguration] = read_build_description(folder, validate=True)
    except Exception as error:  # fmpy raises whatever a damaged file leads to
        raise FmuError(path, f"its sources/buildDescription.xml is damaged: {error}") from error
    sets = [s for c in found if c.modelIdentifier == description.model_identifier for s in c.sourceFileSets]
    if not any(_compiled(s.sourceFiles) for s in sets):
        raise FmuError(path, f"it has no binary for {fmpy.platform}, and no buildDescription.xml that lists sources")
    other = next((s.language for s in sets if (s.language or "") not in LANGUAGES), None)
    if other is not None:
        raise FmuError(
            path, f"it has no binary for {fmpy.platform}, and its sources are {other}: only C is compiled here"
        )
    wanted = [d for s in sets for d in s.preprocessorDefinitions if not d.optional]
    defines = [f"-D{d.name}={d.value or ''}" for d in wanted]
    return defines, _compiled(f for s in sets for f in s.sourceFiles), [i for s in sets for i in s.includeDirectories]


def _compiled(listed: Iterable[str]) -> list[str]:
    """Return what is compiled of the files that are listed: some tools list headers too."""
    return [name for name in listed if not name.endswith(".h")]
