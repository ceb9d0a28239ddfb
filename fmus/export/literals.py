"""Values as text that gives them again, and whether two classes are one."""

import dataclasses
import math
from collections.abc import Mapping
from types import CodeType, FunctionType
from typing import Any

import numpy as np


def literal(value: Any) -> str | None:
    """Return an expression for numbers, texts, arrays, and tuples, lists, sets and dictionaries of them, else None."""
    if value is None or type(value) in (bool, int, str, bytes):
        return repr(value)
    if type(value) in (float, complex):
        return repr(value) if np.isfinite(value) else f"{type(value).__name__}({str(value)!r})"
    if isinstance(value, (np.ndarray, np.generic)) and value.dtype.kind in "biufcU" and value.dtype.char not in "gG":
        shaped = f".reshape({value.shape})" if value.size == 0 else "[()]" if value.ndim == 0 else ""
        return f"numpy.array({literal(value.tolist())}, dtype={value.dtype.str!r}){shaped}"
    if type(value) is dict:
        pairs = [(literal(k), literal(v)) for k, v in value.items()]
        return None if any(None in pair for pair in pairs) else f"{{{', '.join(f'{k}: {v}' for k, v in pairs)}}}"
    if isinstance(value, list | tuple | set | frozenset) and type(value) in (list, tuple, set, frozenset):
        items = [literal(v) for v in value]
        if None in items:
            return None
        inside = f"[{', '.join(str(i) for i in items)}]"
        return inside if isinstance(value, list) else f"{type(value).__name__}({inside})"
    return None


def same(a: Any, b: Any) -> bool:
    """Whether two values are the same wherever they were made: classes by bases, methods and what they declare."""
    if a is b:
        return True
    if isinstance(a, type):
        return (
            isinstance(b, type)
            and a.__name__ == b.__name__
            and same(a.__bases__, b.__bases__)
            and same(_own(a), _own(b))
        )
    if type(a) is not type(b) and not same(type(a), type(b)):
        return False
    if isinstance(a, FunctionType):
        return same(_parts(a), _parts(b))
    if isinstance(a, np.ndarray):
        return a.dtype == b.dtype and a.shape == b.shape and a.tobytes() == b.tobytes()
    if isinstance(a, float):
        return a == b or (math.isnan(a) and math.isnan(b))
    if isinstance(a, Mapping):
        return list(a) == list(b) and all(same(a[k], b[k]) for k in a)
    if isinstance(a, list | tuple):
        return len(a) == len(b) and all(map(same, a, b))
    for inside in ("__func__", "fget", "func"):  # of static and class methods, properties, cached properties
        if hasattr(a, inside):
            return same(getattr(a, inside), getattr(b, inside))
    if dataclasses.is_dataclass(a):
        return same(
            [getattr(a, f.name) for f in dataclasses.fields(a)], [getattr(b, f.name) for f in dataclasses.fields(b)]
        )
    return repr(a) == repr(b)


def _parts(function: FunctionType) -> list[Any]:
    return [_code(function.__code__), function.__defaults__, function.__kwdefaults__]


def _own(cls: type) -> dict[str, Any]:
    return {name: value for name, value in vars(cls).items() if not name.startswith("__")}


def _code(code: CodeType) -> list[Any]:
    """Return names and constants of a function; its byte code is another where its module has other imports."""
    inside = [_code(c) if isinstance(c, CodeType) else c for c in code.co_consts]
    return [code.co_names, code.co_varnames, inside]
