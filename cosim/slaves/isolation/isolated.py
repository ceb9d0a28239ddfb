"""An FMU in a process of its own, as a slave: the same calls, sent to it.

What is set goes with the next call. A step takes its inputs along and brings the outputs back that were read after the
step before: one request and one reply a step. A process that ends, or does not answer in time and is ended, is a call
that failed; the next `instantiate` starts another one.

Limits: on POSIX only; in the Python loop only; a process is no fence against an FMU that means harm.
"""

import logging
import os
import signal
import subprocess
import sys
from collections import deque
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from cosim.arrays import FloatArray
from cosim.errors import CallFailed, FmuError, NotSupported
from cosim.slaves.isolation.channel import PROGRAM, SAID, VALUES, Channel, Gone, Late, pair
from cosim.slaves.pending import Patience
from cosim.slaves.shelf import SHELF
from cosim.slaves.slave import CInterface, References, Refusal, Warned
from fmus.description.description import ModelDescription

_log = logging.getLogger(__name__)

LOG_LINES = 200
"""How many of its last log messages a slave keeps."""

_FUNCTIONS = {"free": "FreeInstance", "reset": "Reset", "instantiate": "Instantiate", "terminate": "Terminate"}

Get = tuple[str, tuple[Any, ...]]
"""A method, and what it is told: value references, and of derivatives their orders."""


class Isolated:
    """An instance of an FMU file in its own process; see `Slave` and `Instance`. Raises `FmuError`."""

    def __init__(self, name: str, path: Path) -> None:
        if sys.platform == "win32":
            raise NotSupported(f"{name} in a process of its own, on Windows", "Fly it without isolation.")
        self.name, self.path = name, path
        self.description: ModelDescription = SHELF.description(path)
        self.messages: deque[str] = deque(maxlen=LOG_LINES)
        self.warned: Warned = {}
        self.patience = Patience()
        self._process: subprocess.Popen[bytes] | None = None
        self._channel: Channel | None = None
        self._alive = False
        self._sets: list[tuple[str, tuple[Any, ...], Any]] = []
        self._got: dict[Get, Any] = {}
        self._wanted: dict[Get, None] = {}
        self._programs: dict[Any, int] = {}
        self._start()

    def __del__(self) -> None:
        """End the process."""
        if getattr(self, "_channel", None) is not None:
            self._end()

    def instantiate(self) -> None:
        """Make the instance, in a new process where there is none."""
        if self._process is None:
            self._start()
        self._ask("instantiate")
        self._alive = True

    def setup_experiment(self, t: float, tolerance: float | None = None, stop: float | None = None) -> None:
        """Announce the experiment."""
        self._ask("setup_experiment", t, tolerance, stop)

    def enter_initialization_mode(self) -> None:
        """Enter initialization mode."""
        self._ask("enter_initialization_mode")

    def exit_initialization_mode(self) -> None:
        """Exit initialization mode."""
        self._ask("exit_initialization_mode")

    def get_real(self, references: References) -> FloatArray:
        """Return Real values."""
        return np.array(self._get("get_real", references))

    def get_integer(self, references: References) -> Sequence[int]:
        """Return values of Integers and Enumerations."""
        return [int(v) for v in self._get("get_integer", references)]

    def get_boolean(self, references: References) -> Sequence[bool]:
        """Return Boolean values."""
        return [bool(v) for v in self._get("get_boolean", references)]

    def get_string(self, references: References) -> Sequence[bytes]:
        """Return Strings."""
        return self._ask("get_string", references)

    def get_output_derivatives(self, references: References, orders: References) -> FloatArray:
        """Return derivatives of Real outputs."""
        return np.array(self._get("get_output_derivatives", references, orders))

    def set_real(self, references: References, values: FloatArray) -> None:
        """Set Real values with the next call."""
        self._set("set_real", (references,), np.array(values, dtype=np.float64))

    def set_integer(self, references: References, values: Sequence[int]) -> None:
        """Set Integers and Enumerations with the next call."""
        self._set("set_integer", (references,), list(values))

    def set_boolean(self, references: References, values: Sequence[bool]) -> None:
        """Set Booleans with the next call."""
        self._set("set_boolean", (references,), list(values))

    def set_string(self, references: References, values: Sequence[bytes]) -> None:
        """Set Strings with the next call."""
        self._set("set_string", (references,), list(values))

    def set_input_derivatives(self, references: References, orders: References, values: FloatArray) -> None:
        """Set derivatives of inputs with the next call."""
        self._set("set_input_derivatives", (references, orders), np.array(values, dtype=np.float64))

    def do_step(self, t: float, h: float) -> None:
        """Step from t to t + h, with what was set, and bring back what was read after the step before."""
        sets = tuple((method, what) for method, what, _ in self._sets)
        gets = tuple(self._wanted)
        sizes = [len(what[0]) for _, what in (*sets, *gets)]
        small = sum(sizes) + 2 <= VALUES and all(map(_is_exact, self._sets))
        if not small or self._channel is None:
            self._ask("do_step", t, h)
            return
        number = self._programs.get((sets, gets))
        if number is None:
            kept, self._sets = self._sets, []
            number = self._programs[sets, gets] = self._ask("program", sets, gets)
            self._sets = kept
        values, at = self._channel.values, 2
        values[0], values[1] = t, h
        for _, what, given in self._sets:
            values[at : at + len(what[0])] = given
            at += len(what[0])
        self._sets.clear()
        self._got.clear()
        self._request("do_step", number)
        for get, size in zip(gets, sizes[len(sets) :], strict=True):
            self._got[get] = values[at : at + size].copy()
            at += size

    def get_state(self) -> Any:
        """Return the number of a state, which stays in the process."""
        return self._ask("get_state")

    def set_state(self, state: Any) -> None:
        """Go back to a state."""
        self._ask("set_state", state)

    def free_state(self, state: Any) -> None:
        """Free a state."""
        if self._alive:
            self._ask("free_state", state)

    def serialize_state(self, state: Any) -> bytes:
        """Return a state as bytes."""
        return self._ask("serialize_state", state)

    def deserialize_state(self, data: bytes) -> Any:
        """Return the number of a state that was bytes."""
        return self._ask("deserialize_state", data)

    def directional_derivative(self, unknowns: References, knowns: References, seed: FloatArray) -> FloatArray:
        """Return a directional derivative."""
        return self._ask("directional_derivative", unknowns, knowns, np.array(seed))

    def terminate(self) -> None:
        """Terminate, where there is an instance."""
        if self._alive:
            self._ask("terminate")

    def reset(self) -> bool:
        """Reset the instance; False where there is none, or it cannot be reset."""
        self.messages.clear()
        self.warned.clear()
        self._wanted.clear()
        self._sets.clear()
        if not self._alive:
            return False
        try:
            return bool(self._ask("reset"))
        except CallFailed:
            return False

    def free(self) -> None:
        """Free the instance, and end its process; one that dies of it is told, and fails nothing."""
        self._sets.clear()
        self._wanted.clear()
        try:
            if self._alive:
                self._ask("free")
        except CallFailed as error:
            _log.warning("%s", error)
        finally:
            self._end()

    def c_interface(self) -> CInterface | None:
        """Return None: the instance is in another process."""
        return None

    def failed(self, status: int) -> Refusal:
        """Return nothing: what failed was told with the call."""
        return Refusal()

    def _get(self, method: str, *what: Any) -> Any:
        if not self._sets:
            found = self._got.get((method, what))
            if found is not None:
                return found
        if self._stepped:
            self._wanted[method, what] = None
        return self._ask(method, *what)

    _stepped = False

    def _set(self, method: str, what: tuple[Any, ...], values: Any) -> None:
        self._got.clear()
        self._sets.append((method, what, values))

    def _ask(self, method: str, *arguments: Any) -> Any:
        """Send what is to be set and a call; return its value. Raises `CallFailed`."""
        calls = [(name, (*what, values)) for name, what, values in self._sets]
        self._sets.clear()
        if not method.startswith("get_"):
            self._got.clear()
        return self._request(method, 0, [*calls, (method, arguments)])

    def _request(self, method: str, program: int, message: Any = None) -> Any:
        channel = self._channel
        if channel is None:
            raise self._lost(method, "its process has ended before")
        self._stepped = method == "do_step" or (self._stepped and method.startswith("get_"))
        channel.words[PROGRAM] = program
        try:
            channel.tell(message)
            channel.hear(self.patience.call, self._look if method == "do_step" else _nothing)
            said = channel.message() if channel.words[SAID] or not program else {}
        except Gone:
            raise self._lost(method, f"its process {self._end()}") from None
        except Late:
            self._end()
            late = f"it has not returned within {self.patience.call:g} s (isolation_timeout), and was ended"
            raise self._lost(method, late) from None
        except KeyboardInterrupt:
            self._end()
            raise
        return self._heard(said)

    def _heard(self, said: dict[str, Any]) -> Any:
        self.messages.extend(said.get("messages", ()))
        for function, (count, first) in said.get("warned", {}).items():
            before, earliest = self.warned.get(function, (0, first))
            self.warned[function] = before + count, earliest
        if "failed" in said:
            failure = CallFailed(**said["failed"], messages=tuple(self.messages))
            if failure.status.endswith(("Fatal", "Pending")):
                self._end()
            raise failure
        return said.get("result")

    def _look(self) -> None:
        if self.patience.stop.value:
            raise KeyboardInterrupt

    def _lost(self, method: str, how: str) -> CallFailed:
        prefix = f"fmi{self.description.fmi_version[0]}"
        words = _FUNCTIONS.get(method) or "".join(part.title() for part in method.split("_"))
        return CallFailed(self.name, f"{prefix}{words}", "nothing", tuple(self.messages), lost=how)

    def _start(self) -> None:
        """Start the process and let it open the FMU."""
        channel, given, handed_on = pair()
        root = Path(__file__).parents[3]
        paths = [str(root), *os.environ.get("PYTHONPATH", "").split(os.pathsep)]
        command = [sys.executable, "-P", "-m", "cosim.slaves.isolation.cell", *map(str, given)]
        environment = os.environ | {"PYTHONPATH": os.pathsep.join(filter(None, paths))}
        self._process = subprocess.Popen(command, pass_fds=given, env=environment, stdin=subprocess.DEVNULL)
        handed_on()
        self._channel, self._alive = channel, False
        self._programs.clear()
        try:
            channel.words[PROGRAM] = 0
            channel.tell((self.name, str(self.path.absolute())))
            channel.hear(self.patience.call)
            said = channel.message()
        except (Gone, Late):
            raise FmuError(self.path, f"its binary cannot be loaded: its process {self._end()}") from None
        if "unusable" in said:
            self._end()
            raise FmuError(self.path, said["unusable"])

    def _end(self) -> str:
        """End the process; return how it went, in words."""
        process, channel = self._process, self._channel
        self._process, self._channel, self._alive = None, None, False
        self._sets.clear()
        self._got.clear()
        if channel is not None:
            channel.close()
        if process is None:
            return "has ended"
        try:
            code = process.wait(0.5 if channel is not None else 0)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
            return "was ended"
        if code < 0:
            return f"was ended by {signal.Signals(-code).name}"
        return f"has ended itself, with exit status {code}"


def _nothing() -> None:
    """Look at nothing."""


def _is_exact(given: tuple[str, tuple[Any, ...], Any]) -> bool:
    """Whether what is set are numbers that doubles hold."""
    method, _, values = given
    return method not in ("set_string", "set_integer") or (
        method == "set_integer" and all(abs(v) <= 2**53 for v in values)
    )
