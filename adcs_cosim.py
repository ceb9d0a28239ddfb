"""The command `adcs`: it sees that the packages found are ours, then runs. It stands alone, to be found first."""

import faulthandler
import importlib.util
import sys
from pathlib import Path

PACKAGES = ("components", "fmus", "cosim")
HOME = Path(__file__).resolve().parent


class StrangerFound(ImportError):
    """A package of one of our names that is not ours, and that Python found first."""


def refuse_strangers() -> None:
    """Raise `StrangerFound`, with one sentence, if Python finds a package of one of our names elsewhere.

    A mere folder of that name, as `fmus` for FMUs, is passed over: an installation for development would be found
    after it.
    """
    for name in PACKAGES:
        spec = importlib.util.find_spec(name)
        if spec is not None and spec.origin is not None:
            found = Path(spec.origin).resolve()
            if not found.is_relative_to(HOME / name):
                where = found.parent if found.name == "__init__.py" else found
                raise StrangerFound(
                    f"adcs-cosim needs its own package {name!r} ({HOME / name}), but Python finds {where}: rename that "
                    "one, or start elsewhere."
                )
        else:
            _import_ours(name)


def _import_ours(name: str) -> None:
    place = HOME / name
    spec = importlib.util.spec_from_file_location(name, place / "__init__.py", submodule_search_locations=[str(place)])
    if spec is None or spec.loader is None or not place.is_dir():
        raise StrangerFound(
            f"adcs-cosim needs its own package {name!r}, but there is none in {HOME}: install it again."
        )
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    spec.loader.exec_module(module)


def main() -> None:
    """Run `adcs`; exit status 2 where it cannot be run."""
    try:
        refuse_strangers()
    except StrangerFound as error:
        print(f"{type(error).__name__}: {error}", file=sys.stderr)
        raise SystemExit(2) from error
    if sys.stderr is not None:
        faulthandler.enable()  # what an FMU, or a library, was doing in Python when it ended the process
    from cosim.cli import completion
    from cosim.cli.commands import app

    completion.begin()
    app()
