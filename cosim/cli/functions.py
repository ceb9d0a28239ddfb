"""The functions of a user's file that give a system: which there are, and one called with arguments as they are typed.

`FILE.py:mine(kp=5, axis=[0, 0, 1])`: the arguments are Python's literals, by position or by name.
"""

import ast
import inspect
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import ModuleType
from typing import Any

from cosim.errors import SimulationError, UnknownName
from fmus.description.names import did_you_mean

Function = Callable[..., object]


class ScenarioError(SimulationError):
    """A file that gives no system; the text says why and what is expected."""


class NoScenario(ScenarioError):
    """A file without any function that could give a system."""


@dataclass(frozen=True)
class Call:
    """A function's name, "" where the file has to tell, and the values of arguments."""

    name: str = ""
    positional: tuple[Any, ...] = ()
    named: Mapping[str, Any] = field(default_factory=dict)


def parse(text: str, file: Path) -> Call:
    """Read "mine" or "mine(5, n=3)"; raises `ScenarioError` for what is no call with literals."""
    if "(" not in text:
        return Call(text)
    where = f"{file}:{text}"
    try:
        call = ast.parse(text.strip(), mode="eval").body
    except (SyntaxError, ValueError, RecursionError, MemoryError) as error:
        raise ScenarioError(
            f"{where} cannot be read: {getattr(error, 'msg', error)}. Write it as {file}:FUNCTION(NAME=VALUE)."
        ) from error
    if not (isinstance(call, ast.Call) and isinstance(call.func, ast.Name)):
        raise ScenarioError(f"{where} is no call of a function. Write it as {file}:FUNCTION(NAME=VALUE).")
    positional = tuple(_literal(node, where, f"argument {i}") for i, node in enumerate(call.args, 1))
    named: dict[str, Any] = {}
    for keyword in call.keywords:
        if keyword.arg is None:
            raise ScenarioError(f"{where}: ** is not possible here. Write each argument as NAME=VALUE.")
        named[keyword.arg] = _literal(keyword.value, where, keyword.arg)
    return Call(call.func.id, positional, named)


def _literal(node: ast.expr, where: str, name: str) -> Any:
    try:
        return ast.literal_eval(node)
    except (ValueError, TypeError, SyntaxError, MemoryError, RecursionError) as error:
        known = "a number, a text in quotes, True, False, None, a list, a tuple or a dict of such"
        raise ScenarioError(f"{where}: {name} is {ast.unparse(node)}; it must be {known}.") from error


def find(module: ModuleType, file: Path, call: Call) -> tuple[str, Function]:
    """Return the function that is called, by its name; without one the only function, or the one called `system`.

    Only a function whose arguments all have defaults is taken without a name. Raises `ScenarioError`, `UnknownName`.
    """
    found = {
        name: function
        for name, function in inspect.getmembers(module, inspect.isfunction)
        if function.__module__ == module.__name__ and not name.startswith("_")
    }
    if call.name:
        if call.name not in found:
            raise UnknownName("function", call.name, str(file), list(found))
        return call.name, found[call.name]
    ready = {name: function for name, function in found.items() if not _needed(function)}
    if not ready:
        needy = [f"{name}{inspect.signature(function)}" for name, function in found.items()]
        there = f" Functions with arguments in it, to be given as {file}:FUNCTION(NAME=VALUE): {', '.join(needy)}."
        text = f"{file} has no function that needs no argument and returns (System, Experiment)."
        raise NoScenario(text + (there if needy else ""))
    if "system" not in ready and len(ready) > 1:
        there = ", ".join(ready)
        raise ScenarioError(
            f"{file}: say which function, as {file}:FUNCTION. Functions without arguments in it: {there}."
        )
    name = "system" if "system" in ready else next(iter(ready))
    return name, ready[name]


def bound(name: str, function: Function, call: Call, file: Path) -> inspect.BoundArguments:
    """Return the arguments of a call, defaults filled in; raises `ScenarioError` with the function's signature."""
    signature = inspect.signature(function)
    where, own = f"{file}:{name}", f" It is {name}{signature}."
    known = [p.name for p in signature.parameters.values() if p.kind not in (p.VAR_POSITIONAL, p.VAR_KEYWORD)]
    takes_any = any(p.kind is p.VAR_KEYWORD for p in signature.parameters.values())
    for given in call.named:
        if given not in known and not takes_any:
            raise ScenarioError(f'{where} takes no argument "{given}".{did_you_mean(given, known)}{own}')
    try:
        arguments = signature.bind(*call.positional, **call.named)
    except TypeError as error:
        raise ScenarioError(f"{where}: {error}.{own} Write {file}:{name}(NAME=VALUE).") from error
    arguments.apply_defaults()
    return arguments


def _needed(function: Function) -> list[str]:
    """Return the arguments that a function cannot be called without."""
    parameters = inspect.signature(function).parameters.values()
    return [p.name for p in parameters if p.default is p.empty and p.kind not in (p.VAR_POSITIONAL, p.VAR_KEYWORD)]
