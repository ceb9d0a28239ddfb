"""Ctrl-C and SIGTERM end a run within the step that is running; a second Ctrl-C ends it at once."""

import ctypes
import os
import signal
import socket
import threading
from collections.abc import Callable, Generator
from contextlib import contextmanager, suppress
from functools import cache
from types import FrameType
from typing import Any

GRACE = 0.2
"""Seconds that Python has to raise KeyboardInterrupt after a second Ctrl-C, before the process is ended."""

STATUS = 128 + signal.SIGINT
"""Exit status of a process that Ctrl-C ended."""


class Asked:
    """Whether SIGTERM asked the process to end while a run went on."""

    def __init__(self) -> None:
        self._handler: Any = None
        self._number = 0

    def note(self, number: int, handler: Any) -> None:
        """Keep a signal, and whose it is."""
        self._number, self._handler = number, handler

    def answer(self) -> None:
        """Do what the signal asks for, now that the run is written: end the process, or what the program does then.

        Raises `SystemExit` with the status of a process that the signal ended, so that it tidies up.
        """
        if callable(self._handler):
            self._handler(self._number, None)
        elif self._number and self._handler != signal.SIG_IGN:
            raise SystemExit(128 + self._number)


@contextmanager
def interruptible(stop: ctypes.c_int, last_words: Callable[[], None]) -> Generator[Asked]:
    """Within, the first SIGINT sets `stop` and nothing else; outside the main thread nothing changes.

    SIGTERM sets it too, and what is yielded answers it later. The second SIGINT raises KeyboardInterrupt; where that
    cannot be raised, for the thread is inside an FMU that does not return, `last_words` is called and the process ends.
    """
    asked = Asked()
    if threading.current_thread() is not threading.main_thread():
        yield asked
        return
    listener = _listener(os.getpid())  # a forked process has no threads
    with listener.attending(stop, last_words, asked):
        yield asked


class _Listener:
    """A thread that hears of SIGINT while the main thread is in C.

    Python runs signal handlers between two of its own instructions only, in the main thread. But the interpreter
    writes a byte for every signal, at once, and whoever waits for it can set a flag that the kernel reads.
    """

    def __init__(self) -> None:
        self._listening, self._telling = socket.socketpair()
        self._telling.setblocking(False)
        self._stop = ctypes.c_int()
        self._last_words: Callable[[], None] = lambda: None
        self._others = -1
        self._count = 0
        self._heard = threading.Event()
        threading.Thread(target=self._listen, name="cosim-interrupt", daemon=True).start()

    @contextmanager
    def attending(self, stop: ctypes.c_int, last_words: Callable[[], None], asked: Asked) -> Generator[None]:
        """Have SIGINT and SIGTERM set `stop` within; a run within a run leaves the outer one as it was."""
        outer = self._stop, self._last_words, self._count
        self._stop, self._last_words, self._count = stop, last_words, 0
        self._heard.clear()
        before = signal.signal(signal.SIGINT, self._note)
        ending = signal.getsignal(signal.SIGTERM)

        def note_ending(number: int, _frame: FrameType | None) -> None:
            stop.value = 1
            asked.note(number, ending)

        signal.signal(signal.SIGTERM, note_ending)
        others = signal.set_wakeup_fd(self._telling.fileno(), warn_on_full_buffer=False)
        nested = others == self._telling.fileno()
        if not nested:
            self._others = others
        try:
            yield
        finally:
            signal.set_wakeup_fd(others)
            for number, handler in ((signal.SIGINT, before), (signal.SIGTERM, ending)):
                signal.signal(number, signal.SIG_DFL if handler is None else handler)  # None: one not of Python
            self._heard.set()  # whatever comes now is not for this run
            self._stop, self._last_words, self._count = outer  # what has flown is not kept alive
            if nested:
                self._heard.clear()

    def _note(self, _number: int, _frame: FrameType | None) -> None:
        self._stop.value = 1
        signal.signal(signal.SIGINT, self._end)

    def _end(self, _number: int, _frame: FrameType | None) -> None:
        self._heard.set()
        raise KeyboardInterrupt

    def _listen(self) -> None:
        while told := self._listening.recv(64):
            if self._others >= 0:
                with suppress(OSError):
                    os.write(self._others, told)
            self._count += told.count(signal.SIGINT)
            if self._count or signal.SIGTERM in told:
                self._stop.value = 1
            if self._count > 1 and not self._heard.wait(GRACE):
                with suppress(Exception):
                    self._last_words()
                os._exit(STATUS)


@cache
def _listener(_process: int) -> _Listener:
    return _Listener()
