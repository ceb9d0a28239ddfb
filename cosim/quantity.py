"""A number with a unit in one text, as users type it: "0.005 deg", "1ms", "-3e4 N.m"."""

import re

_NUMBER = re.compile(r"^\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)(.*)$", re.DOTALL)


def split_quantity(text: str) -> tuple[str, str] | None:
    """Return the number of a text and what follows it, blanks around it removed; None if it begins with no number."""
    match = _NUMBER.match(text)
    return None if match is None else (match[1], match[2].strip())
