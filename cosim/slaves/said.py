"""What the FMUs of a run have said so far, as a part of it that a checkpoint has."""

from collections.abc import Mapping, MutableSequence
from typing import Any

from cosim.slaves.slave import Slave


class Said:
    """Log messages, and calls that returned fmi2Warning, of the instances of a run; see `Part`."""

    def __init__(self, slaves: Mapping[str, Slave]) -> None:
        self._slaves = slaves

    def memory(self) -> Any:
        """Return them by instance."""
        return {name: [list(slave.messages), slave.warned] for name, slave in self._slaves.items()}

    def recall(self, memory: Any) -> None:
        """Let the instances have said that: what they said at their start is the beginning of it."""
        for name, (messages, warned) in memory.items():
            said = self._slaves[name].messages
            if isinstance(said, MutableSequence):  # signals say nothing
                said.clear()
                said.extend(messages)
            self._slaves[name].warned.update({function: (n, first) for function, (n, first) in warned.items()})
