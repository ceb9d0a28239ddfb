"""The files of a package as a zip archive of which the same content makes the same bytes."""

import hashlib
import os
import re
import shutil
import threading
import time
import zipfile
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path

from cosim.ssp.errors import SspError
from fmus import places

FIRST_DAY = (1980, 1, 1, 0, 0, 0)
"""The first that a zip archive knows: the date of every file, unless SOURCE_DATE_EPOCH says one."""


def epoch() -> int | None:
    """Return the date that SOURCE_DATE_EPOCH says, seconds since 1970, None where it says none."""
    text = os.environ.get("SOURCE_DATE_EPOCH", "")
    return int(text) if re.fullmatch(r"\d{1,10}", text) else None


def file_name(name: str) -> str:
    """Return a name as every file system and URI takes it."""
    return re.sub(r"[^A-Za-z0-9_.-]", "_", name)


def names_of(fmus: Mapping[str, Path]) -> dict[str, str]:
    """Return instance -> the name of its FMU in the archive; equal FMUs are one file."""
    found: dict[str, str] = {}
    taken: dict[str, str] = {}
    for instance, path in fmus.items():
        with path.open("rb") as file:
            digest = hashlib.file_digest(file, "sha256").hexdigest()
        name = f"resources/{file_name(path.stem)}.fmu"
        if taken.get(name.lower(), digest) != digest:
            name = f"resources/{file_name(path.stem)}-{file_name(instance)}.fmu"
        taken[name.lower()] = digest
        found[instance] = name
    return found


def write_archive(path: Path, texts: Mapping[str, bytes], files: Mapping[str, Path]) -> Path:
    """Write texts and files, each by its name in the archive; it appears whole or not at all. Raises `SspError`."""
    said = epoch()
    date = FIRST_DAY if said is None else max(FIRST_DAY, time.gmtime(said)[:6])
    part = path.with_name(f".{path.name}.{os.getpid()}-{threading.get_ident()}")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with zipfile.ZipFile(part, "w") as archive:
            for name, text in texts.items():
                archive.writestr(_entry(name, date, zipfile.ZIP_DEFLATED), text)
            for name, file in files.items():
                entry = _entry(name, date, zipfile.ZIP_STORED)  # an FMU is compressed as it is
                entry.file_size = file.stat().st_size
                with file.open("rb") as source, archive.open(entry, "w") as target:
                    shutil.copyfileobj(source, target)
        places.keep(part, path)
    except OSError as error:
        with suppress(OSError):
            part.unlink(missing_ok=True)
        raise SspError(str(path), [f"it cannot be written: {error.strerror or error}"]) from error
    return path


def _entry(name: str, date: tuple[int, ...], method: int) -> zipfile.ZipInfo:
    entry = zipfile.ZipInfo(name, date)  # pyright: ignore[reportArgumentType]
    entry.compress_type, entry.external_attr, entry.create_system = method, 0o644 << 16, 3
    return entry
