"""The command `adcs`: it sees that the packages found are ours, then runs. It stands alone, to be found first."""

import importlib.util
import sys
from pathlib import Path

PACKAGES = ("components", "fmus", "cosim")


class StrangerFound(ImportError):
    """A package of one of our names that is not ours: a user's own folder that Python found first."""


def refuse_strangers() -> None:
    """Raise `StrangerFound`, with one sentence, if one of our packages is found elsewhere than beside this file."""
    home = Path(__file__).resolve().parent
    for name in PACKAGES:
        spec = importlib.util.find_spec(name)
        origins = [] if spec is None else [spec.origin] if spec.origin else list(spec.submodule_search_locations or ())
        found = Path(origins[0]).resolve() if origins and origins[0] is not None else None
        if found is None or not found.is_relative_to(home / name):
            where = "nothing" if found is None else str(found.parent if found.suffix == ".py" else found)
            raise StrangerFound(
                f"adcs-cosim needs its own package {name!r} ({home / name}), but Python finds {where}: rename that "
                "folder, or start elsewhere."
            )


def main() -> None:
    """Run `adcs`; exit status 2 where it cannot be run."""
    try:
        refuse_strangers()
    except StrangerFound as error:
        print(f"{type(error).__name__}: {error}", file=sys.stderr)
        raise SystemExit(2) from error
    from cosim.cli.commands import app

    app()
