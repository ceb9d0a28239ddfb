"""The python back end: a pythonfmu FMU that carries the component's own source, to be opened and edited.

pythonfmu gives the wrapper binaries and Fmi2Slave; modelDescription.xml is ours. resources/ holds

    source/             the component's module, what it imports and the data files beside it that it reads, our runtime
    component.json      which class, its structure and start values
    interface.json      what modelDescription.xml says, to be compared with the source when the FMU is instantiated
    adcs_slave_*.py     the pythonfmu script (python/slave.py), its name hashed from its content
    pythonfmu/          so that the FMU needs only numpy and casadi on the target
"""

import hashlib
import json
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pythonfmu

from components.framework import Component
from fmus.description.description import DefaultExperiment, ModelDescription
from fmus.description.write import write
from fmus.errors import BuildError
from fmus.export.archive import guid_of, write_fmu
from fmus.export.describe import PROPOSED, describe, summary
from fmus.export.documentation.files import documents
from fmus.export.imports import imported
from fmus.export.origin import build_date, origin_of
from fmus.export.python.rehearsal import with_data_files
from fmus.export.reads import Reads, noting
from fmus.export.sources import OURS, Sources, content, sources_of, users_file

BACKEND = "python"
SLAVE = Path(__file__).with_name("slave.py")
TRAVELLERS = ("fmus.export.describe", "fmus.export.python.runtime", "fmus.export.source_loader")
REQUIREMENTS = "numpy>=1.26\ncasadi>=3.7,<3.9\n"


def _source(component: Component) -> tuple[Component, Sources, Reads]:
    """Return a component as its file defines it now, the source files, and what its code has read so far."""
    cls = type(component)
    if cls.__module__.partition(".")[0] in OURS:
        return component, sources_of(cls.__module__), Reads()
    file = users_file(cls)
    if file is None:
        raise BuildError(
            f"{cls.__name__} was defined interactively: put the class into a file, so that an FMU can carry it."
        )
    found = imported(file)
    if not hasattr(found.module, cls.__name__):
        raise BuildError(f"{file} has no {cls.__name__} outside of functions and classes, where its FMU looks for it.")
    with noting(found.reads):
        return getattr(found.module, cls.__name__)(**component.given), sources_of(file.stem, file.parent), found.reads


def _plain(value: Any) -> Any:
    return np.asarray(value).tolist()


def build_python(
    component: Component, path: Path, model_name: str | None = None, experiment: DefaultExperiment = PROPOSED
) -> Path:
    """Write a python FMU of the component to `path` and return it; experiment: what it says that it is flown with."""
    name = model_name or path.stem
    component, sources, reads = _source(component)
    files = dict(sources.files)
    for module in TRAVELLERS:
        files |= sources_of(module).files
    settings = {
        "model_name": name,
        "module": sources.module,
        "class": type(component).__name__,
        "values": {key: _plain(value) for key, value in component.given.items()},
    }
    with noting(reads):
        description = describe_python(component, name, experiment)
    script = SLAVE.read_bytes()
    script_name = f"adcs_slave_{hashlib.sha256(script).hexdigest()[:12]}"
    resources: dict[str, bytes] = {f"source/{relative}": content(file) for relative, file in files.items()}
    resources["component.json"] = json.dumps(settings, indent=1).encode()
    resources["interface.json"] = json.dumps(summary(description)).encode()
    resources["requirements.txt"] = REQUIREMENTS.encode()
    resources["slavemodule.txt"] = script_name.encode()
    resources[f"{script_name}.py"] = script
    own = users_file(type(component))
    if own is not None:
        resources = with_data_files(component.name, own.parent, f"{script_name}.py", resources, reads)
    package = _pythonfmu()
    for file in sorted(package.glob("*.py")):
        resources[f"pythonfmu/{file.name}"] = file.read_bytes()
    archive = {f"resources/{relative}": data for relative, data in resources.items()}
    for binary in sorted((package / "resources" / "binaries").rglob("*.*")):
        archive[f"binaries/{binary.parent.name}/{description.model_identifier}{binary.suffix}"] = binary.read_bytes()
    guid = guid_of(BACKEND, write(description), archive)
    xml = write(replace(description, guid=guid, generation_date=build_date()))
    return write_fmu(path, {"modelDescription.xml": xml, **documents(component, description), **archive})


def _pythonfmu() -> Path:
    """Return the folder of pythonfmu as installed: an FMU that flew in this process may have brought a copy."""
    found = [Path(str(pythonfmu.__file__)).parent, *(Path(entry, "pythonfmu") for entry in sys.path)]
    for folder in found:
        if (folder / "resources" / "binaries").is_dir():
            return folder
    raise BuildError("the package pythonfmu is not installed with its binaries: pip install pythonfmu.")


def describe_python(
    component: Component, model_name: str, experiment: DefaultExperiment = PROPOSED
) -> ModelDescription:
    """Return what the python FMU of a component says, with an empty GUID."""
    origin = origin_of(component)
    return describe(
        component, model_name, derivatives=False, experiment=experiment, needs_execution_tool=True, **origin
    )
