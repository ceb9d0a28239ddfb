"""An FMU with inputs and outputs of every type of FMI 2.0, to be wired in chains and loops.

Feedthrough: r = 0.5 r_in + x, i = (i_in + count) mod 1000, b = not b_in, e = the item after e_in, s = "<" + s_in.
State: x' = r_in, count += i_in, odd changes where b_in is true, mode goes on by an item where it is, memory is s_in and
the number of the step, so that every step brings a new text.
"""

from pathlib import Path

from .c_fmu import boolean, build, enumeration, integer, real, string

ITEMS = {"off": 1, "slow": 2, "fast": 5}
NAMES = {"r": "x", "i": "count", "b": "odd", "e": "mode", "s": "memory"}
"""The feedthrough output of each type, and its output that is a state."""

VARIABLES = [
    real("r_in", "input"),
    integer("i_in", "input"),
    boolean("b_in", "input"),
    enumeration("e_in", "input", items=ITEMS),
    string("s_in", "input"),
    real("r", depends="r_in"),
    integer("i", depends="i_in"),
    boolean("b", depends="b_in"),
    enumeration("e", depends="e_in", items=ITEMS),
    string("s", depends="s_in"),
    real("x"),
    integer("count"),
    boolean("odd"),
    enumeration("mode", items=ITEMS),
    string("memory"),
    real("x0", "parameter", start=0.25),
    integer("count0", "parameter", start=3),
    boolean("odd0", "parameter", start=True),
    enumeration("mode0", "parameter", start=2, items=ITEMS),
    string("memory0", "parameter", start="begin"),
]

OUTPUTS = r"""
    #define NEXT(item) ((item) == 1 ? 2 : (item) == 2 ? 5 : 1)
    if (!m->whole[1]) { x = x0; count = count0; odd = odd0; mode = mode0; strcpy(memory, memory0); }
    r = 0.5 * r_in + x;
    i = (i_in + count) % 1000;
    b = !b_in;
    e = NEXT(e_in);
    s[0] = '<';
    snprintf(s + 1, 30, "%s", s_in);
"""

STEP = r"""
    m->whole[0]++;
    x += h * (r_in + 0.5 * h * m->slope[0]);
    count = (count + i_in) % 1000;
    odd = odd != b_in;
    if (b_in) mode = NEXT(mode);
    snprintf(memory, TEXT, "%.20s \xc2\xb5%lld", s_in, m->whole[0]);
"""


def typed(folder: Path, **capabilities) -> Path:
    """Write Typed.fmu into a folder."""
    initialized = "outputs(m); m->whole[1] = 1;"
    return build(folder, "Typed", VARIABLES, outputs=OUTPUTS, step=STEP, initialized=initialized, **capabilities)
