"""The kinds of values that FMI 2.0 has calls for, and the texts that Strings number in a vector of doubles."""

from collections.abc import Iterable
from enum import IntEnum

from fmus.description.description import ScalarVariable


class Kind(IntEnum):
    """Which pair of FMI functions reads and writes a variable; the kernel knows the same numbers."""

    REAL = 0
    INTEGER = 1
    BOOLEAN = 2
    STRING = 3


_KINDS = {
    "Real": Kind.REAL,
    "Integer": Kind.INTEGER,
    "Enumeration": Kind.INTEGER,
    "Boolean": Kind.BOOLEAN,
    "String": Kind.STRING,
}


def kind_of(variable: ScalarVariable) -> Kind:
    """Return the kind of a variable: an Enumeration is read and written as an Integer."""
    return _KINDS[variable.type]


class Texts:
    """The distinct texts of a run, in the order in which they came up; text 0 is the empty one."""

    def __init__(self, texts: Iterable[bytes] = ()) -> None:
        self._texts = [b""]
        self._numbers = {b"": 0}
        for text in texts:
            self.number(text)

    def number(self, text: bytes) -> int:
        """Return the number of a text, a new one for a new text."""
        found = self._numbers.setdefault(text, len(self._texts))
        if found == len(self._texts):
            self._texts.append(text)
        return found

    def text(self, number: float) -> bytes:
        """Return the text of a number."""
        return self._texts[int(number)]

    def words(self, number: float) -> str:
        """Return the text of a number as FMI means it, in UTF-8."""
        return self.text(number).decode("utf-8", "replace")

    def all(self) -> tuple[bytes, ...]:
        """Return all texts, each in its place."""
        return tuple(self._texts)

    def __len__(self) -> int:
        """Return how many texts there are."""
        return len(self._texts)
