"""Who made an FMU's component, and when the FMU was built: attributes of modelDescription.xml."""

import os
import sys
import time
from functools import cache
from importlib.metadata import Distribution, PackageNotFoundError, distribution
from pathlib import Path

from components.framework import Component
from fmus.errors import BuildError
from fmus.export.sources import OURS

ATTRIBUTES = ("author", "version", "license", "copyright")
DISTRIBUTION = "adcs-cosim"


def origin_of(component: Component) -> dict[str, str]:
    """Return author, version, license and copyright, as far as they are known.

    Of ours as the distribution says, of a user's module as its __author__, __version__, __license__, __copyright__ do.
    """
    module = type(component).__module__
    if module.partition(".")[0] in OURS:
        return _ours()
    said = vars(sys.modules[module])
    return {name: str(said[f"__{name}__"]) for name in ATTRIBUTES if said.get(f"__{name}__")}


@cache
def _ours() -> dict[str, str]:
    try:
        found = distribution(DISTRIBUTION)
    except PackageNotFoundError:  # a folder on the path, not installed
        return {}
    keys = {"author": ("Author", "Author-email"), "version": ("Version",), "license": ("License-Expression", "License")}
    said = {name: next((found.metadata[k] for k in of if k in found.metadata), "") for name, of in keys.items()}
    return {name: text for name, text in {**said, "copyright": _copyright(found)}.items() if text}


def _copyright(found: Distribution) -> str:
    """Return the line of the licence that says whose it is."""
    for file in found.files or ():
        path = Path(str(file.locate()))
        if path.name == "LICENSE" and path.is_file():
            text = path.read_text(encoding="utf-8")
            return next((line.strip() for line in text.splitlines() if line.startswith("Copyright")), "")
    return ""


def build_date() -> str:
    """Return the time of the build, UTC, as FMI writes it; $SOURCE_DATE_EPOCH (seconds since 1970) wins."""
    chosen = os.environ.get("SOURCE_DATE_EPOCH")
    try:
        seconds = time.time() if chosen is None else int(chosen)
        return time.strftime("%Y-%m-%dT%H:%M:%SZ", time.gmtime(seconds))
    except (ValueError, OverflowError, OSError) as error:
        text = f"SOURCE_DATE_EPOCH is {chosen!r}, which is no number of seconds since 1970. Set it to one, or unset it."
        raise BuildError(text) from error
