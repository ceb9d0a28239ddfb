"""Ctrl-C ends a run within the step that is running; a second one ends it at once."""

import ctypes
import os
import signal
import socket
import threading
from collections.abc import Callable, Generator
from contextlib import contextmanager, suppress
from types import FrameType

GRACE = 0.2
"""Seconds that Python has to raise KeyboardInterrupt after a second Ctrl-C, before the process is ended."""

STATUS = 128 + signal.SIGINT
"""Exit status of a process that Ctrl-C ended."""


@contextmanager
def interruptible(stop: ctypes.c_int, last_words: Callable[[], None]) -> Generator[None]:
    """Within, the first SIGINT sets `stop` and nothing else; outside the main thread nothing changes.

    The second one raises KeyboardInterrupt; where that cannot be raised, for the thread is inside an FMU that does not
    return, `last_words` is called and the process ends. Python runs signal handlers between two of its own
    instructions only, so a thread of its own listens to the bytes that the interpreter writes when a signal arrives.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    heard = threading.Event()

    def end(_number: int, _frame: FrameType | None) -> None:
        heard.set()
        raise KeyboardInterrupt

    def note(_number: int, _frame: FrameType | None) -> None:
        stop.value = 1
        signal.signal(signal.SIGINT, end)

    listening, telling = socket.socketpair()
    telling.setblocking(False)
    before = signal.signal(signal.SIGINT, note)
    others = signal.set_wakeup_fd(telling.fileno(), warn_on_full_buffer=False)
    listener = threading.Thread(target=_listen, args=(listening, others, stop, heard, last_words), daemon=True)
    listener.start()
    try:
        yield
    finally:
        signal.set_wakeup_fd(others)
        signal.signal(signal.SIGINT, signal.SIG_DFL if before is None else before)  # None: a handler not of Python
        telling.close()
        listener.join()
        listening.close()


def _listen(
    bytes_of: socket.socket, others: int, stop: ctypes.c_int, heard: threading.Event, last_words: Callable[[], None]
) -> None:
    count = 0
    while told := bytes_of.recv(64):
        if others >= 0:
            with suppress(OSError):
                os.write(others, told)
        count += told.count(signal.SIGINT)
        if count:
            stop.value = 1
        if count > 1 and not heard.wait(GRACE):
            with suppress(Exception):
                last_words()
            os._exit(STATUS)
