"""Statements of a text: which gives a name its value, and which global names it uses."""

import ast
import symtable
from collections.abc import Iterator


def of_cell(text: str) -> ast.Module | None:
    """Return the syntax tree of a cell, which may await at its top; None for what is no Python."""
    try:
        tree = compile(text, "<cell>", "exec", ast.PyCF_ONLY_AST | ast.PyCF_ALLOW_TOP_LEVEL_AWAIT)
    except (SyntaxError, ValueError):
        return None
    return tree if isinstance(tree, ast.Module) else None


def named(tree: ast.Module, name: str) -> Iterator[ast.stmt]:
    """Yield the statements outside functions and classes that bind a name by a definition, import or assignment."""
    for statement in _outside(tree):
        match statement:
            case ast.ClassDef() | ast.FunctionDef():
                bound = {statement.name}
            case ast.Import() | ast.ImportFrom():
                bound = {alias.asname or alias.name for alias in statement.names}
            case ast.Assign():
                bound = {target.id for target in statement.targets if isinstance(target, ast.Name)}
            case ast.AnnAssign(target=ast.Name(id=target)) if statement.value is not None:
                bound = {target}
            case _:
                continue
        if name in bound:
            yield statement


def _outside(tree: ast.AST) -> Iterator[ast.stmt]:
    for node in ast.iter_child_nodes(tree):
        if isinstance(node, ast.stmt):
            yield node
        if not isinstance(node, ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef):
            yield from _outside(node)


def start_line(statement: ast.stmt) -> int:
    """Return the first line of a statement, that of its first decorator."""
    return min([statement.lineno, *(d.lineno for d in getattr(statement, "decorator_list", []))])


def global_names(text: str) -> set[str]:
    """Return the names that a statement takes from its module, those that it binds there left out."""
    found: set[str] = set()
    todo = [symtable.symtable(text, "<cell>", "exec")]
    bound = {s.get_name() for s in todo[0].get_symbols() if s.is_assigned() or s.is_imported()}
    while todo:
        table = todo.pop()
        module = table.get_type() == "module"
        found |= {s.get_name() for s in table.get_symbols() if (s.is_referenced() if module else s.is_global())}
        todo += table.get_children()
    return found - bound


def attributes(statement: ast.stmt, name: str) -> list[str]:
    """Return the dotted names in a statement that begin with a name: np.linalg, np.linalg.norm."""
    chains = [ast.unparse(node) for node in ast.walk(statement) if isinstance(node, ast.Attribute)]
    return [chain for chain in chains if chain.startswith(f"{name}.")]
