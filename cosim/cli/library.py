"""Where FMUs come from: a file as it is, or a component by name, built when it is missing or out of date."""

import threading
from collections.abc import Callable
from pathlib import Path

from cosim.errors import FmuError
from cosim.ssp.package import path_of
from cosim.system.reference import Reference, is_fmu, reference_of
from fmus.description.names import did_you_mean_file
from fmus.errors import NoCompiler
from fmus.export.build import build_reference


class Library:
    """Locates FMUs for one preference of back end; `note` is told lines that a user should see once.

    A Python-only component is always built by the python back end; without a C compiler every component is. Threads may
    share a library: an FMU that two of them ask for is built once.
    """

    def __init__(self, backend: str = "native", note: Callable[[str], None] | None = None) -> None:
        self.backend = backend
        self._note = note or (lambda _line: None)
        self._turn = threading.Lock()

    def __call__(self, given: Reference | Path) -> Path:
        """Return the FMU of a reference: FILE.fmu, NAME or FILE.py:Class, the latter two with :modes=6 or the like.

        A component's class is a reference too, one from a notebook's cell as well, and an FMU within a package,
        FILE.ssp#resources/NAME.fmu. Raises `FmuError` for a file that is not there, `SspError` for one that is not in
        a package, `fmus.errors.BuildError` for what cannot be built.
        """
        reference = reference_of(given)
        if is_fmu(reference):
            path = path_of(reference)
            if not path.is_file():
                raise FmuError(path, f"there is no such file.{did_you_mean_file(path)}".removesuffix("."))
            return path
        try:
            return self._build(reference)
        except NoCompiler as error:
            self._do_without_compiler(error)
            return self._build(reference)

    def _do_without_compiler(self, error: NoCompiler) -> None:
        """Take the python back end from now on; the first thread that finds out tells."""
        with self._turn:
            if self.backend != "python":
                self.backend = "python"
                self._note(f"{error} Until then: python back end.")

    def _build(self, reference: Reference) -> Path:
        return build_reference(reference, self.backend, announce=self._note)


def locate(reference: Reference | Path) -> Path:
    """Return the FMU of a reference, native where there is a compiler."""
    return Library()(reference)
