"""A number with a unit in one text, as users type it: "0.005 deg", "1ms", "-3e4 N.m"."""

import re

_NUMBER = re.compile(r"^\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d{1,3}(?!\d))?)(.*)$", re.DOTALL)
_NO_UNIT = re.compile(r"[,._']|\d\d|[eE][-+]?\d|[xX][0-9a-fA-F]|[bBoO]\d")
"""How what follows a number begins where it is the rest of a number: of 2,5, 1.2.3, 1_000, 1 000, 0x10, 0b1, 1e1234."""


def split_quantity(text: str) -> tuple[str, str] | None:
    """Return the number of a text and what follows it, blanks around it removed; None if it begins with no number.

    What begins as a number written another way, 2,5 or 0x10, begins with no number.
    """
    match = _NUMBER.match(text)
    return None if match is None or _NO_UNIT.match(match[2].strip()) else (match[1], match[2].strip())


def advice_on_numbers(text: str) -> str:
    """Return how numbers are written, as the end of a message, if a text begins as one that is written otherwise."""
    if _NUMBER.match(text) is None or split_quantity(text) is not None:
        return ""
    return ". Numbers are decimal, with a point and nothing between their digits: 2.5, 1000, 1e-3"
