"""Whose mistake it is: what fails in a component's own text becomes a BuildError with file, line and exception."""

from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path

from fmus.errors import BuildError, ComponentFailed
from fmus.export.source_loader import told


@contextmanager
def blamed(folder: Path | None) -> Generator[None]:
    """Raise ComponentFailed for a contradiction in a component, and for any exception from a file in `folder`."""
    try:
        yield
    except BuildError:
        raise
    except Exception as error:
        from components.framework.errors import ComponentError

        if isinstance(error, ComponentError):
            raise ComponentFailed(str(error)) from error
        text = None if folder is None else told(error, folder)
        if text is None:
            raise
        raise ComponentFailed(text) from error
