"""The process of an isolated FMU: python -m cosim.slaves.isolation.cell MEMORY WAKE DATA (descriptors).

It makes the slave that would fly in the master's process, and calls it as it is told: by messages, or, for the calls of
a step, by programs, which are told once and then go by their numbers with their values in memory.
"""

import itertools
import signal
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from cosim.errors import CallFailed, FmuError
from cosim.slaves import breadcrumb
from cosim.slaves.isolation.channel import PROGRAM, SAID, Channel, Gone, other_end
from cosim.slaves.opening import open_fmu

SETS = {"set_real": lambda v: v.copy(), "set_integer": lambda v: [int(x) for x in v], "set_boolean": lambda v: v != 0}
GETS = ("get_real", "get_integer", "get_boolean", "get_output_derivatives")
"""Calls that a program may have, and how a slave takes the numbers; `set_input_derivatives` besides."""


class Cell:
    """The slave and what a master has left in it: states, by numbers, and programs."""

    def __init__(self, channel: Channel, name: str, path: Path) -> None:
        self._channel = channel
        self.slave: Any = open_fmu(name, path)
        self._states: dict[int, Any] = {}
        self._numbers = itertools.count(1)
        self._programs: list[tuple[Any, Any]] = []

    def serve(self) -> None:
        """Answer until the master is gone."""
        channel = self._channel
        channel.tell({"result": None})
        while True:
            channel.hear()
            number = channel.words[PROGRAM]
            try:
                if number:
                    self._run(*self._programs[number - 1])
                    said = self._news({})
                else:
                    said = {"result": [self._call(method, arguments) for method, arguments in channel.message()][-1]}
                    said = self._news(said)
            except CallFailed as error:
                said = self._news({"failed": _fields(error)})
            channel.words[SAID] = bool(said)
            channel.tell(said or None)

    def _call(self, method: str, arguments: tuple[Any, ...]) -> Any:
        """Do what a message says; states stay here, the master has their numbers."""
        if method == "program":
            self._programs.append(arguments)  # pyright: ignore[reportArgumentType]
            return len(self._programs)
        if method == "do_step":
            breadcrumb.here().time = arguments[0]
        if method in ("get_state", "deserialize_state"):
            number = next(self._numbers)
            self._states[number] = getattr(self.slave, method)(*arguments)
            return number
        if method in ("set_state", "serialize_state"):
            return getattr(self.slave, method)(self._states[arguments[0]])
        if method == "free_state":
            return self.slave.free_state(self._states.pop(arguments[0]))
        if method == "free":
            self._states.clear()
        return getattr(self.slave, method)(*arguments)

    def _run(self, sets: tuple[tuple[str, Any], ...], gets: tuple[tuple[str, Any], ...]) -> None:
        """Set, step, get: values are t, h, those that are set, and behind them those that were got."""
        values, slave, at = self._channel.values, self.slave, 2
        for method, what in sets:
            n = len(what[0])
            if method == "set_input_derivatives":
                slave.set_input_derivatives(*what, values[at : at + n].copy())
            else:
                getattr(slave, method)(*what, SETS[method](values[at : at + n]))
            at += n
        t = breadcrumb.here().time = float(values[0])
        slave.do_step(t, float(values[1]))
        for method, what in gets:
            n = len(what[0])
            values[at : at + n] = getattr(slave, method)(*what)
            at += n

    def _news(self, said: dict[str, Any]) -> dict[str, Any]:
        """Return what is said, with the messages and warnings that are new."""
        slave = self.slave
        if slave.messages:
            said["messages"] = list(slave.messages)
            slave.messages.clear()
        if slave.warned:
            said["warned"] = dict(slave.warned)
            slave.warned.clear()
        return said


def _fields(error: CallFailed) -> Mapping[str, Any]:
    names = "component", "function", "status", "last_successful_time", "terminated", "waited"
    return {name: getattr(error, name) for name in names}


def main() -> None:
    """Serve the FMU that the first message names."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is the master's
    channel = other_end(*map(int, sys.argv[1:4]))
    np.seterr(all="ignore")
    try:
        channel.hear()
        name, path = channel.message()
        try:
            cell = Cell(channel, name, Path(path))
        except FmuError as error:
            channel.tell({"unusable": error.problem})
            return
        cell.serve()
    except Gone:
        return


if __name__ == "__main__":
    main()
