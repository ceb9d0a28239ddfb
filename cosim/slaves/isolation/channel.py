"""What a master and the process of an FMU share: memory for the numbers of a step, sockets for all else.

A request or a reply is a counter that goes up by one. Who waits for it looks at it for some microseconds, and then
sleeps until a byte comes; a wake-up that is missed, for the two write and read without fences, costs a millisecond.
A socket that is closed tells that the other end is gone, however it went.
"""

import mmap
import os
import pickle
import select
import socket
import struct
import tempfile
import time
from collections.abc import Callable
from typing import Any

import numpy as np

from cosim.arrays import FloatArray

VALUES = 1 << 16
"""How many doubles a step may carry in both directions together; what has more goes through the socket."""

_HEAD = 64
REQUEST, REPLY, MASTER_SLEEPS, CELL_SLEEPS, PROGRAM, SAID = 0, 8, 16, 24, 32, 33
"""Words of the head; counters and flags lie 64 bytes apart, in cache lines of their own.

PROGRAM: number of a program, whose values lie in the memory, 0: a message comes through the socket. SAID: of a reply,
whether a message comes with it.
"""

_CORES = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
MASTER_LOOKS, CELL_LOOKS = (2_000, 25_000) if _CORES > 1 else (0, 0)
"""How often is looked before sleeping, some 40 ns each: a small step takes less, all else between two steps too.

With one core the other end could not even answer.
"""

RESTS = 100
"""How often one sleeps at once after looks in vain: where steps are long, or the cores are busy, looking is a loss."""

SLICES = 1e-3, 0.05
"""The shortest and the longest sleep before looking again, s."""


class Gone(Exception):
    """The other end is no more."""


class Late(Exception):
    """The other end has not answered in time."""


class Channel:
    """One end of a channel; `master` tells which."""

    def __init__(self, memory: int, wake: socket.socket, data: socket.socket, *, master: bool) -> None:
        self._map = mmap.mmap(memory, 8 * (_HEAD + VALUES))
        self.words = memoryview(self._map)[: 8 * _HEAD].cast("q")
        self.values: FloatArray = np.frombuffer(self._map, dtype=np.float64, offset=8 * _HEAD)
        self._wake, self._data = wake, data
        self._mine, self._theirs = (REQUEST, REPLY) if master else (REPLY, REQUEST)
        self._looks, self._rests, self._heard = MASTER_LOOKS if master else CELL_LOOKS, 0, 0
        self._i_sleep, self._it_sleeps = (MASTER_SLEEPS, CELL_SLEEPS) if master else (CELL_SLEEPS, MASTER_SLEEPS)

    def tell(self, message: Any = None) -> None:
        """Raise this end's counter, and send a message, where there is one; raises `Gone`."""
        self.words[self._mine] += 1
        try:
            if self.words[self._it_sleeps]:
                self._wake.send(b"!")
            if message is not None:
                text = pickle.dumps(message)
                self._data.sendall(struct.pack("<Q", len(text)) + text)
        except OSError as error:
            raise Gone from error

    def hear(self, timeout: float | None = None, look: Callable[[], None] = lambda: None) -> None:
        """Wait until the other end's counter is one higher; `look` is called now and then.

        Raises `Gone`; `Late` after `timeout` s.
        """
        words, place = self.words, self._theirs
        wanted = self._heard + 1
        if self._rests:
            self._rests -= 1
        else:
            for _ in range(self._looks):
                if words[place] == wanted:
                    self._heard = wanted
                    return
            self._rests = RESTS
        self._sleep(wanted, timeout, look)
        self._heard = wanted

    def _sleep(self, wanted: int, timeout: float | None, look: Callable[[], None]) -> None:
        words, place = self.words, self._theirs
        begun, nap = time.monotonic(), SLICES[0]
        words[self._i_sleep] = 1
        try:
            while words[place] != wanted:
                look()
                if timeout is not None and time.monotonic() - begun > timeout:
                    raise Late
                ready, _, _ = select.select([self._wake], [], [], nap)
                nap = min(2 * nap, SLICES[1])
                if ready and not self._wake.recv(64) and words[place] != wanted:
                    raise Gone
        except OSError as error:
            raise Gone from error
        finally:
            words[self._i_sleep] = 0

    def message(self) -> Any:
        """Return the message that comes with what was heard; raises `Gone`."""
        (size,) = struct.unpack("<Q", self._exactly(8))
        return pickle.loads(self._exactly(size))

    def _exactly(self, size: int) -> bytes:
        parts: list[bytes] = []
        while size:
            try:
                part = self._data.recv(min(size, 1 << 20))
            except OSError as error:
                raise Gone from error
            if not part:
                raise Gone
            parts.append(part)
            size -= len(part)
        return b"".join(parts)

    def close(self) -> None:
        """Close the sockets: the other end is told so. The memory goes with the last look at it."""
        self._wake.close()
        self._data.close()


def pair() -> tuple[Channel, tuple[int, int, int], Callable[[], None]]:
    """Return the master's end, the three descriptors of the other one, and what closes these in this process."""
    memory = tempfile.TemporaryFile()
    memory.truncate(8 * (_HEAD + VALUES))
    (wake, its_wake), (data, its_data) = socket.socketpair(), socket.socketpair()
    given = memory.fileno(), its_wake.fileno(), its_data.fileno()

    def handed_on() -> None:
        memory.close()
        its_wake.close()
        its_data.close()

    return Channel(memory.fileno(), wake, data, master=True), given, handed_on


def other_end(memory: int, wake: int, data: int) -> Channel:
    """Return the end of a process that was given the descriptors."""
    return Channel(memory, socket.socket(fileno=wake), socket.socket(fileno=data), master=False)
