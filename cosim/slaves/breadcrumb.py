"""Where each thread is inside an FMU, in memory that a signal handler reads when the FMU ends the process.

The handler is masters/kernel/crash.h, the structure that of structures.h.
"""

import ctypes
import math
import os
import threading
from collections.abc import Generator
from contextlib import contextmanager
from typing import Any

THREADS = 64
"""How many threads have a breadcrumb that a handler sees; one more thread flies without."""


class Breadcrumb(ctypes.Structure):
    """One thread's: `function` is set while `instance` is in that call, `run` while the kernel runs.

    Both are texts, each at its `address`. `time`: s, of the communication point, NaN before the first. `file`:
    descriptor of run.json, -1 where there is none, and `at` where its status stands in it; `rows`: the path of the file
    that keeps the rows.
    """

    _fields_ = [
        ("thread", ctypes.c_longlong),
        ("process", ctypes.c_longlong),
        ("instance", ctypes.c_void_p),
        ("function", ctypes.c_void_p),
        ("run", ctypes.c_void_p),
        ("time", ctypes.c_double),
        ("file", ctypes.c_longlong),
        ("at", ctypes.c_longlong),
        ("rows", ctypes.c_char_p),
    ]


ALL = (Breadcrumb * THREADS)()
"""What a handler looks through."""

ctypes.pythonapi.Py_IncRef(ctypes.py_object(ALL))  # at exit handlers still look, when Python has freed its modules

_addresses: dict[bytes, int] = {}
_texts: list[Any] = []  # for ever, for a handler may read them at any time
_free = list(range(THREADS))
_lock = threading.Lock()
_own = threading.local()


def address(text: bytes) -> int:
    """Return where a text stands in memory, for as long as the process lives."""
    if text not in _addresses:
        _texts.append(ctypes.create_string_buffer(text))
        _addresses[text] = ctypes.addressof(_texts[-1])
    return _addresses[text]


def here() -> Breadcrumb:
    """Return this thread's breadcrumb; outside `left` one that no handler sees."""
    found: Breadcrumb | None = getattr(_own, "breadcrumb", None)
    if found is None:
        found = _own.breadcrumb = Breadcrumb(file=-1, time=math.nan)
    return found


@contextmanager
def left() -> Generator[None]:
    """Within, a handler sees what this thread is in; within itself it changes nothing."""
    outer = here()
    if outer.process == os.getpid():
        yield
        return
    with _lock:
        place = _free.pop() if _free else -1
    if place < 0:
        yield
        return
    own = ALL[place]
    own.thread, own.process = _signed(threading.get_ident()), os.getpid()
    own.function, own.run, own.file, own.time = None, None, -1, math.nan
    _own.breadcrumb = own
    try:
        yield
    finally:
        own.process = 0
        _own.breadcrumb = outer
        with _lock:
            _free.append(place)


class inside:  # noqa: N801 - it reads as a function; a generator would take four times as long
    """Within, this thread is in a function of an instance; both in UTF-8."""

    def __init__(self, instance: bytes, function: bytes) -> None:
        self._breadcrumb, self._instance, self._function = here(), address(instance), address(function)

    def __enter__(self) -> None:
        self._breadcrumb.instance = self._instance
        self._breadcrumb.function = self._function

    def __exit__(self, *_: object) -> None:
        self._breadcrumb.function = None


def _signed(thread: int) -> int:
    return ctypes.c_longlong(thread).value
