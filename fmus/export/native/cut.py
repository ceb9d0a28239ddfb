"""What of a component's functions follows from its parameters alone, and what from them and the inputs.

The functions are walked as one graph of scalar operations, equal ones once. The level of an operation is the lowest
whose arguments are all that it depends on:
    fixed   parameters p, calculated parameters c
    held    inputs u as well
    moving  time, states, step means and seeds as well
A cut at a level keeps the values that operations above it, and results, take from it, and nothing below these: at
`fixed` k of all functions, at `held` g of the rates and then of the outputs.
    k = fixed(p, c),   g = held(u, p, c, k),   g[:n] = held_rates(u, p, c, k)                      (1)
    dx = rates(t, x, u, p, c, k, g[:n]),   y = outputs(t, x, u, p, c, m, k, g)                     (2)
Slopes take k only: they are for inputs that move, of which each value is seen once. Each operation keeps its
operands, so that results are bit for bit those of the whole functions.

Limits: a cut that saves less than LEAST_SAVING of a function's operations is not made in it, and none where a function
calls others that CasADi does not write out.
"""

from collections.abc import Collection, Generator, Iterable, Mapping, Sequence
from contextlib import contextmanager

import casadi as ca

FIXED, HELD, MOVING = range(3)
LEVELS = {"p": FIXED, "c": FIXED, "u": HELD}
LEAST_SAVING = 0.1


def cut(functions: Mapping[str, ca.Function]) -> dict[str, ca.Function]:
    """Return functions of scalars with further arguments k and g, and those of (1) that give any.

    functions: by name; arguments are told apart by their names. Where nothing is cut off, k or g have no elements.
    held_rates is there where it is less than held.
    """
    if any(_calls(f) for f in functions.values()):
        return {name: _whole(f) for name, f in functions.items()}
    graph = _Graph()
    roots = {name: graph.add(f) for name, f in functions.items()}
    fixed = {name: graph.worth(FIXED, found, ()) for name, found in roots.items()}
    at_k = _symbols("k", sorted(set().union(*fixed.values())))
    known = {name: {node: at_k[node] for node in nodes} for name, nodes in fixed.items()}

    held = {name: graph.worth(HELD, roots[name], known[name]) for name in ("rates", "outputs") if name in functions}
    of_rates = sorted(held.get("rates", ()))
    of_both = of_rates + sorted(held.get("outputs", set()) - set(of_rates)) if of_rates else []
    at_g = _symbols("g", of_both)
    g = {name: _column(at_g.values()) for name in held if held[name]} if of_rates else {}
    if of_rates:
        g["rates"] = _column(at_g[node] for node in of_rates)
    for name in g:
        known[name] |= {node: at_g[node] for node in held[name]}

    k = _column(at_k.values())
    nothing = ca.SX(0, 1)
    with _as_written():
        result = {
            name: graph.function(f, roots[name], known[name], {"k": k, "g": g.get(name, nothing)})
            for name, f in functions.items()
        }
        if at_k:
            result["fixed"] = graph.kept("fixed", "p c", list(at_k), {}, {}, "k")
        if at_g:
            result["held"] = graph.kept("held", "u p c", of_both, at_k, {"k": k}, "g")
        if len(of_both) > len(of_rates):
            result["held_rates"] = graph.kept("held_rates", "u p c", of_rates, at_k, {"k": k}, "g")
    return result


class _Graph:
    """Scalar operations, equal ones once; a node is an index, operands come before what is made of them.

    operands: none for arguments and constants, whose expressions are in `leaves`.
    """

    def __init__(self) -> None:
        self.arguments: dict[str, ca.SX] = {}
        self.operations: list[int] = []
        self.operands: list[tuple[int, ...]] = []
        self.levels: list[int] = []
        self.leaves: dict[int, ca.SX] = {}
        self._found: dict[object, int] = {}

    def add(self, function: ca.Function) -> list[int]:
        """Add a function; return the nodes of its results, one result after the other."""
        names = function.name_in()
        for i, name in enumerate(names):
            self.arguments.setdefault(name, ca.SX.sym(name, function.size1_in(i)))
        work: dict[int, int] = {}
        results: dict[tuple[int, ...], int] = {}
        for i in range(function.n_instructions()):
            operation, given = function.instruction_id(i), function.instruction_input(i)
            made = function.instruction_output(i)
            if operation == ca.OP_OUTPUT:
                results[tuple(made)] = work[given[0]]
            elif operation == ca.OP_INPUT:
                name, place = names[given[0]], given[1]
                leaf = self.arguments[name].nz[place]
                work[made[0]] = self._node((operation, name, place), operation, (), LEVELS.get(name, MOVING), leaf)
            elif operation == ca.OP_CONST:
                value = function.instruction_constant(i)
                work[made[0]] = self._node((operation, value.hex()), operation, (), FIXED, ca.SX(value))
            else:
                operands = tuple(work[j] for j in given)
                level = max(self.levels[j] for j in operands)
                work[made[0]] = self._node((operation, operands), operation, operands, level, None)
        return [results[key] for key in sorted(results)]

    def _node(self, key: object, operation: int, operands: tuple[int, ...], level: int, leaf: ca.SX | None) -> int:
        if key not in self._found:
            node = self._found[key] = len(self.operations)
            self.operations.append(operation)
            self.operands.append(operands)
            self.levels.append(level)
            if leaf is not None:
                self.leaves[node] = leaf
        return self._found[key]

    def between(self, roots: Sequence[int], stops: Collection[int]) -> set[int]:
        """Return the operations that `roots` need, as far as `stops`, which are known."""
        found: set[int] = set()
        ahead = list(roots)
        while ahead:
            node = ahead.pop()
            if node in found or node in stops or node in self.leaves:
                continue
            found.add(node)
            ahead.extend(self.operands[node])
        return found

    def worth(self, level: int, roots: Sequence[int], known: Collection[int]) -> set[int]:
        """Return the nodes at which a cut at a level keeps values, none where it saves too little."""
        needed = self.between(roots, known)
        above = {node for node in needed if self.levels[node] > level}
        if len(needed) - len(above) < LEAST_SAVING * len(needed):
            return set()
        used = {j for node in above for j in self.operands[node]} | set(roots)
        return (used & needed) - above

    # ---- back to CasADi --------------------------------------------------------------------------------------------

    def function(
        self, whole: ca.Function, roots: Sequence[int], stops: Mapping[int, ca.SX], further: Mapping[str, ca.SX]
    ) -> ca.Function:
        """Return a function with further arguments, which has their elements at the nodes of `stops`."""
        flat = self._expressions(roots, stops)
        results, first = [], 0
        for i in range(whole.n_out()):
            results.append(_column(flat[first : first + whole.nnz_out(i)]))
            first += whole.nnz_out(i)
        names = [*whole.name_in(), *further]
        arguments = [*(self.arguments[name] for name in whole.name_in()), *further.values()]
        return ca.Function(whole.name(), arguments, results, names, whole.name_out())

    def kept(
        self,
        name: str,
        known: str,
        nodes: Sequence[int],
        stops: Mapping[int, ca.SX],
        further: Mapping[str, ca.SX],
        result: str,
    ) -> ca.Function:
        """Return the function of arguments, named, and further ones that gives the values of nodes."""
        names = known.split()
        arguments = [self.arguments[n] for n in names]
        values = _column(self._expressions(nodes, stops))
        return ca.Function(name, [*arguments, *further.values()], [values], [*names, *further], [result])

    def _expressions(self, roots: Sequence[int], stops: Mapping[int, ca.SX]) -> list[ca.SX]:
        made: dict[int, ca.SX] = dict(stops)
        for node in sorted(self.between(roots, stops)):
            operands = [made[j] if j in made else self.leaves[j] for j in self.operands[node]]
            of = ca.SX.unary if len(operands) == 1 else ca.SX.binary
            made[node] = of(self.operations[node], *operands)
        return [made[node] if node in made else self.leaves[node] for node in roots]


def _calls(function: ca.Function) -> bool:
    return any(function.instruction_id(i) == ca.OP_CALL for i in range(function.n_instructions()))


def _whole(function: ca.Function) -> ca.Function:
    """Return a function that has k and g, without elements, as further arguments."""
    known, kept = function.mx_in(), [ca.MX.sym(name, 0, 1) for name in "kg"]
    names = [*function.name_in(), "k", "g"]
    return ca.Function(function.name(), [*known, *kept], function.call(known), names, function.name_out())


def _symbols(name: str, nodes: Sequence[int]) -> dict[int, ca.SX]:
    return {node: ca.SX.sym(f"{name}_{i}") for i, node in enumerate(nodes)}


def _column(elements: Iterable[ca.SX]) -> ca.SX:
    return ca.vertcat(*elements, ca.SX(0, 1))


@contextmanager
def _as_written() -> Generator[None]:
    """Let CasADi make expressions as they are told, x - x too: elsewhere it simplifies them."""
    simplified = ca.GlobalOptions.getSimplificationOnTheFly()
    ca.GlobalOptions.setSimplificationOnTheFly(False)
    try:
        yield
    finally:
        ca.GlobalOptions.setSimplificationOnTheFly(simplified)
