"""Users' files, imported: anew where a file, what it imports, or a data file that was read has changed since."""

import threading
from dataclasses import dataclass, field
from itertools import count
from pathlib import Path
from types import ModuleType

from fmus.export.blame import blamed
from fmus.export.reads import Reads, hold, noting
from fmus.export.source_loader import content_hash, import_from
from fmus.export.sources import sources_of


@dataclass(frozen=True)
class Imported:
    """A user's file as a module; sources: hash of it and of what it imports; reads: what its code has read so far.

    Builds add to the reads: what a function keeps in memory it reads for the first of them only.
    """

    sources: str
    module: ModuleType
    reads: Reads = field(default_factory=Reads)


_imported: dict[Path, Imported] = {}
_turns: dict[Path, threading.RLock] = {}
_editions = count()


def imported(file: Path) -> Imported:
    """Return a user's file as it is now; raises ComponentFailed where it fails to import. Threads may share it."""
    path = file.resolve()
    with _turns.setdefault(path, threading.RLock()), blamed(path.parent):
        files = sources_of(path.stem, path.parent).files
        own = {name for name, origin in files.items() if origin.is_relative_to(path.parent)}
        sources, kept = content_hash(path.parent, own), _imported.get(path)
        if kept is not None and kept.sources == sources and hold(kept.reads):
            return kept
        reads = Reads()
        with noting(reads):
            module = import_from(path.parent, own, path.stem, edition=str(next(_editions)))
        _imported[path] = Imported(sources, module, reads)
        return _imported[path]
