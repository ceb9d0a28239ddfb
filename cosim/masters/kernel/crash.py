"""An FMU that ends the process is told by name: on standard error, and in run.json."""

import threading
from collections.abc import Generator
from contextlib import contextmanager
from ctypes import addressof

from cosim.masters.kernel.library import library
from cosim.slaves import breadcrumb
from fmus.errors import BuildError

_lock = threading.Lock()
_handled = False


@contextmanager
def told() -> Generator[None]:
    """Within, a crash of an FMU in this thread is told; where nothing compiles, and on Windows, by the system alone."""
    try:
        kernel = library()
    except (BuildError, OSError):
        yield
        return
    global _handled
    with _lock:
        if not _handled:  # once: what sets handlers later, a Java machine in an FMU, has reasons, and keeps them
            kernel.kernel_tell_crashes(addressof(breadcrumb.ALL), breadcrumb.THREADS)
            _handled = True
    stack = kernel.kernel_take_stack()
    try:
        with breadcrumb.left():
            yield
    finally:
        kernel.kernel_give_stack_back(stack)
