"""Write an FMU so that the same content gives the same bytes."""

import hashlib
import os
import threading
import zipfile
from collections.abc import Mapping
from pathlib import Path

from fmus import places

EPOCH = (1980, 1, 1, 0, 0, 0)


def guid_of(backend: str, description: bytes, files: Mapping[str, bytes]) -> str:
    """Return a GUID that is a hash of the back end, modelDescription.xml without its GUID, and every file."""
    digest = hashlib.sha256(f"{backend}\0".encode() + description)
    for name in sorted(files):
        digest.update(f"{name}\0{len(files[name])}\0".encode() + files[name])
    h = digest.hexdigest()
    return f"{{{h[:8]}-{h[8:12]}-{h[12:16]}-{h[16:20]}-{h[20:32]}}}"


def write_fmu(path: Path, files: Mapping[str, bytes]) -> Path:
    """Write the files (POSIX paths) with fixed dates and modes; the FMU appears whole or not at all."""
    path.parent.mkdir(parents=True, exist_ok=True)
    part = path.with_name(f".{path.name}.{os.getpid()}-{threading.get_ident()}")
    with zipfile.ZipFile(part, "w") as archive:
        for name, data in files.items():
            entry = zipfile.ZipInfo(name, EPOCH)
            entry.compress_type, entry.external_attr = zipfile.ZIP_DEFLATED, 0o644 << 16
            archive.writestr(entry, data)
    places.keep(part, path)
    return path
