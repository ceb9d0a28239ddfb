"""The run at a communication point: explicit, copyable, saved and restored. A checkpoint is a saved point."""

import io
import json
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any, Protocol

import numpy as np

from cosim.arrays import ByteArray, FloatArray, IntArray
from cosim.errors import NotSupported
from cosim.masters.layout import Layout
from cosim.masters.types import Texts
from cosim.slaves.slave import Slave


class Part(Protocol):
    """What remembers something from one communication point to the next that the vectors of a `Point` do not have.

    A control of steps, what happens between steps (events, faults with their delay lines and noise), a count. A part
    joins by these two methods and by its name in `Flight.parts`; another flight of the same system and experiment goes
    on to the same bits once its parts have recalled what those of the first remembered at the point.
    """

    def memory(self) -> Any:
        """Return it as plain data, as JSON has it: None, truths, numbers, texts, lists, mappings with texts as keys.

        Floats keep their bits, NaN among them; whole numbers may be of any size, as a noise generator's state is.
        """
        ...

    def recall(self, memory: Any) -> None:
        """Remember what `memory` has returned of such a part in another flight."""
        ...


@dataclass(frozen=True)
class Point:
    """Communication point `index` of a run.

    `values` has every slot of the layout as it is seen at that point, shape (size,); `newest` what the components
    returned last, ahead of it where a slow component has stepped already; `begun`, shape (2, n), the sources' values
    and slopes at the start of the period of every input, in the order of the layout's components, for components that
    step at its end. `texts` are the texts that the slots of Strings number. `memory`: what an algorithm has learned, in
    its own words. `states`: the serialized FMU states by instance, and `parts` what the parts of the run remember, by
    their names, where they were asked for.
    """

    index: int
    values: FloatArray
    newest: FloatArray
    begun: FloatArray
    texts: Texts
    memory: FloatArray = field(default_factory=lambda: np.zeros(0))
    states: Mapping[str, bytes] = field(default_factory=dict[str, bytes])
    parts: Mapping[str, Any] = field(default_factory=dict[str, Any])

    @classmethod
    def start(cls, layout: Layout) -> "Point":
        """Return the point before initialization: held inputs have their values, everything else is zero."""
        values, texts = np.zeros(layout.size), Texts()
        for i, constant in enumerate(layout.constants):
            values[layout.held + i] = texts.number(constant) if isinstance(constant, bytes) else constant
        for passage in layout.passages.values():
            passage.reset(values)
        return cls(0, values, values.copy(), np.zeros((2, len(layout.inputs.links))), texts)

    def copy(self) -> "Point":
        """Return a point that shares nothing with this one."""
        texts = Texts(self.texts.all()[1:])
        values, newest, begun, memory = (a.copy() for a in (self.values, self.newest, self.begun, self.memory))
        return Point(self.index, values, newest, begun, texts, memory, dict(self.states), dict(self.parts))

    def with_states(self, slaves: Mapping[str, Slave]) -> "Point":
        """Return the point with the states of the FMUs, which stand at it.

        Raises `NotSupported` naming an FMU that cannot serialize its state.
        """
        states: dict[str, bytes] = {}
        for name, slave in slaves.items():
            if not (slave.description.can_get_and_set_state and slave.description.can_serialize_state):
                advice = "Its modelDescription.xml says canSerializeFMUstate=false: this system cannot be saved."
                raise NotSupported(f"{name} cannot serialize its FMU state", advice)
            state = slave.get_state()
            try:
                states[name] = slave.serialize_state(state)
            finally:
                slave.free_state(state)
        return replace(self, states=states)

    def restore(self, slaves: Mapping[str, Slave]) -> None:
        """Put instances of the same FMUs into the states that the point has; raises `CallFailed`."""
        for name, data in self.states.items():
            state = slaves[name].deserialize_state(data)
            try:
                slaves[name].set_state(state)
            finally:
                slaves[name].free_state(state)

    def with_parts(self, parts: Mapping[str, Part]) -> "Point":
        """Return the point with what the parts of the run remember at it."""
        return replace(self, parts={name: part.memory() for name, part in parts.items()})

    def recall(self, parts: Mapping[str, Part]) -> None:
        """Let parts of the same names remember what those of the point did; raises `KeyError` for one that had none."""
        for name, part in parts.items():
            part.recall(self.parts[name])

    def to_bytes(self) -> bytes:
        """Return the point as bytes that `from_bytes` reads, an archive of NumPy arrays."""
        file = io.BytesIO()
        texts, states = self.texts.all(), self.states
        np.savez(
            file,
            allow_pickle=False,
            index=np.array(self.index),
            values=self.values,
            newest=self.newest,
            begun=self.begun,
            memory=self.memory,
            texts=_joined(texts),
            text_lengths=np.array([len(t) for t in texts], dtype=np.int64),
            instances=np.array(list(states), dtype=np.str_),
            states=_joined(tuple(states.values())),
            state_lengths=np.array([len(s) for s in states.values()], dtype=np.int64),
            parts=_joined((json.dumps(self.parts).encode(),)),
        )
        return file.getvalue()

    @classmethod
    def from_bytes(cls, data: bytes) -> "Point":
        """Return the point that `to_bytes` wrote."""
        with np.load(io.BytesIO(data), allow_pickle=False) as file:
            texts = _split(file["texts"], file["text_lengths"])
            states = _split(file["states"], file["state_lengths"])
            return cls(
                int(file["index"]),
                file["values"],
                file["newest"],
                file["begun"],
                Texts(texts[1:]),
                file["memory"],
                dict(zip(map(str, file["instances"]), states, strict=True)),
                json.loads(file["parts"].tobytes()),
            )


def _joined(parts: tuple[bytes, ...]) -> ByteArray:
    return np.frombuffer(b"".join(parts), dtype=np.uint8)


def _split(joined: ByteArray, lengths: IntArray) -> list[bytes]:
    ends = np.cumsum(lengths)
    return [joined[end - n : end].tobytes() for n, end in zip(lengths, ends, strict=True)]
