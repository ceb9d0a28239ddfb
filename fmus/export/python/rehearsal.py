"""A python FMU before it is packed: its script runs as on a host, to see which data files the component needs.

Those beside the component's source are packed at the same place, so that `Path(__file__).with_name("table.csv")` is the
file's name on the target too. What is read under another name would be missing there, and is refused.
"""

import importlib.util
import os
import sys
import tempfile
from collections.abc import Iterable, Mapping
from pathlib import Path

from fmus import places
from fmus.errors import BuildError, ComponentFailed
from fmus.export.reads import Reads, noting
from fmus.export.source_loader import told

REHEARSED = "rehearsed"
"""A file that keeps the modules of a rehearsal apart from those of the FMU."""


def with_data_files(
    name: str, folder: Path, script: str, resources: Mapping[str, bytes], read: Iterable[str]
) -> dict[str, bytes]:
    """Return the resources of a python FMU (path -> content) with the data files that its component needs.

    name: the component's. folder: that of its source. script: file among the resources to run. read: what its code read
    so far, of which the FMU may need less. Raises BuildError.
    """
    known = [path for path in (Path(os.path.abspath(file)) for file in read) if path.suffix != ".py"]
    beside = (path for path in known if path.is_relative_to(folder) and path.is_file())
    data = {f"source/{path.relative_to(folder).as_posix()}": path.read_bytes() for path in beside}
    with tempfile.TemporaryDirectory(dir=places.workshop()) as temporary:
        place = Path(temporary).resolve()
        for relative, content in {**resources, **data, f"source/{REHEARSED}": str(place).encode()}.items():
            path = place / relative
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(content)
        failure, needed = _run(place / script)
        inside: set[str] = set()
        for path in (Path(os.path.abspath(file)) for file in needed):
            relative = path.relative_to(place).as_posix() if path.is_relative_to(place) else ""
            if relative.startswith("source/"):
                inside.add(relative)
            elif relative not in resources and path.suffix != ".py":
                _refuse_existing(name, folder, folder.parent / relative if relative else path)
    if failure is not None:
        for path in (path for path in known if not path.is_relative_to(folder)):  # missed by what looks before it opens
            _refuse_existing(name, folder, path)
        text = told(failure, place / "source") or str(failure)
        raise ComponentFailed(text.replace(str(place / "source"), str(folder))) from failure
    return {**resources, **{relative: data[relative] for relative in sorted(inside & set(data))}}


def _refuse_existing(name: str, folder: Path, file: Path) -> None:
    """Refuse a file that an FMU cannot carry, if it is there."""
    if file.is_file():
        raise BuildError(
            f"{name} reads {file}, which would be missing where its python FMU goes: an FMU carries what lies in "
            f"{folder} and is named from there. Put it there and read Path(__file__).with_name({file.name!r})."
        )


def _run(script: Path) -> tuple[Exception | None, Reads]:
    """Instantiate the slave of a script; return what it raised, and what the component read."""
    reads = Reads()
    spec = importlib.util.spec_from_file_location(script.stem, script)
    if spec is None or spec.loader is None:
        raise ImportError(f"{script} is no module")
    module = importlib.util.module_from_spec(spec)
    try:
        with noting(reads):
            spec.loader.exec_module(module)
            module.ComponentSlave(instance_name=script.stem, resources=str(script.parent)).runtime.release()
    except Exception as error:
        return error, reads
    finally:
        for name, loaded in list(sys.modules.items()):
            if Path(getattr(loaded, "__file__", None) or "").is_relative_to(script.parent / "source"):
                del sys.modules[name]
    return None, reads
