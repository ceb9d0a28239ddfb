"""Components whose C is too long for a compiler in one piece: the same arithmetic, cut into short functions.

CasADi writes a function of scalars as one straight run of statements. What a compiler does to it grows faster than its
length. Where a component has more than MANY_STATES, and a function more than LARGE instructions, the intermediate
values move from variables into CasADi's work vector, the run is cut into functions of PIECE statements, and -O1
compiles it. The order of operations stays, and so do the bits; a step takes longer.
"""

import re
from collections.abc import Sequence

import casadi as ca

MANY_STATES = 250  # what has fewer flies often, and is worth the compiler's time
LARGE = 5000
PIECE = 100
OPTIMISATION = "-O1"

_FUNCTION = re.compile(
    r"^static int (\w+)\(const casadi_real\*\* arg, casadi_real\*\* res, casadi_int\* iw, casadi_real\* w, int mem\) "
    r"\{\n"
    r"((?:  (?:w\[|if \(res).*;\n)+)  return 0;\n\}\n",
    re.MULTILINE,
)
_ARGUMENTS = "const casadi_real** arg, casadi_real** res, casadi_real* w"


def is_large(states: int, functions: Sequence[ca.Function]) -> bool:
    """Whether a component of so many states has a function that a compiler does not take well in one piece."""
    return states > MANY_STATES and any(f.n_instructions() > LARGE for f in functions)


def in_pieces(code: str) -> str:
    """Return CasADi's C, written with avoid_stack, with long functions of scalars cut into pieces."""
    return _FUNCTION.sub(_cut, code)


def _cut(match: re.Match[str]) -> str:
    whole, name, body = match[0], match[1], match[2].splitlines(keepends=True)
    if len(body) <= PIECE:
        return whole
    pieces = [body[i : i + PIECE] for i in range(0, len(body), PIECE)]
    defined = (f"static void {name}_{k}({_ARGUMENTS}) {{\n{''.join(lines)}}}\n" for k, lines in enumerate(pieces))
    calls = (f"  {name}_{k}(arg, res, w);\n" for k in range(len(pieces)))
    head = whole[: whole.index("\n") + 1]
    return f"{''.join(defined)}{head}{''.join(calls)}  return 0;\n}}\n"
