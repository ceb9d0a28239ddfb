"""Attitudes as a command line or a parameter file writes them: 'euler321(30, 20, 10) deg', 'axis(0,0,1; 30) deg'.

They become unit quaternions, scalar first; any other text is a `Value` as it is.
"""

import re

from cosim.errors import ParameterError
from cosim.system import Value

_TEXT = re.compile(r"\s*(?P<kind>euler|axis)(?P<sequence>\w*)\s*\((?P<numbers>[^()]*)\)\s*(?P<unit>\S*)\s*", re.DOTALL)


def value_of(text: str, name: str) -> Value:
    """Read the text of a value, of a variable by its name; raises `ParameterError`."""
    match = _TEXT.fullmatch(text)
    if match is None:
        if re.match(r"\s*(euler\w*|axis)\s*\(", text):
            raise ParameterError(name, f"{text!r} is no attitude. {_KNOWN}")
        return Value(text)
    unit = match["unit"]
    if unit != "deg" and unit != "rad":
        written = f"the unit {unit}" if unit else "no unit"
        raise ParameterError(name, f"{text!r} has {written}. {_KNOWN}, or rad in place of deg")
    from components.mathematics.start_attitude import axis_angle, euler

    try:
        first, *rest = [[float(n) for n in part.split(",")] for part in match["numbers"].split(";")]
        if match["kind"] == "euler":
            return Value(euler(match["sequence"], first if not rest else [], unit))
        if len(rest) != 1 or len(rest[0]) != 1 or match["sequence"]:
            raise ValueError("an axis and an angle are needed")
        return Value(axis_angle(first, rest[0][0], unit))
    except ValueError as error:
        raise ParameterError(name, f"{text!r}: {error}. {_KNOWN}") from error


_KNOWN = "Write it as 'euler321(30, 20, 10) deg', or as 'axis(0, 0, 1; 30) deg'"
