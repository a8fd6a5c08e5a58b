"""Arithmetic of named SI values, as a study writes it: ``"static / (1 + ratio)"``."""

from __future__ import annotations

import ast
import math
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from functools import lru_cache, reduce
from types import CodeType

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tarsus.base.errors import InputError
from tarsus.base.messages import nearest

FUNCTIONS = {
    "sqrt": np.sqrt,
    "exp": np.exp,
    "log": np.log,
    "log10": np.log10,
    "sin": np.sin,
    "cos": np.cos,
    "abs": np.abs,
    "min": lambda *values: reduce(np.minimum, values),
    "max": lambda *values: reduce(np.maximum, values),
}
CONSTANTS = {"pi": math.pi}

_ALLOWED = (
    ast.Expression,
    ast.BinOp,
    ast.UnaryOp,
    ast.Call,
    ast.Name,
    ast.Constant,
    ast.Load,
    ast.Add,
    ast.Sub,
    ast.Mult,
    ast.Div,
    ast.Pow,
    ast.USub,
    ast.UAdd,
)


@dataclass(frozen=True)
class Expression:
    """An expression that was checked: numbers, names, + - * / **, brackets, and the functions of `FUNCTIONS`."""

    text: str

    @property
    def names(self) -> frozenset[str]:
        """Names that it needs."""
        return _compiled(self.text)[1]

    def check(self, known: Collection[str]) -> list[str]:
        """What is wrong with it, a sentence each, where only these names exist."""
        try:
            names = self.names
        except InputError as error:
            return list(error.problems)
        return [f"'{self.text}': there is no '{name}'{nearest(name, known)}" for name in sorted(names - set(known))]

    def values(self, names: Mapping[str, ArrayLike]) -> NDArray[np.float64]:
        """Its values for values of the names, numbers or arrays of one shape; NaN where the arithmetic has none
        (division by zero, a root of a negative number)."""
        code, needed = _compiled(self.text)
        given = {name: np.asarray(names[name], dtype=float) for name in needed}
        try:
            with np.errstate(all="ignore"):
                found = eval(code, {"__builtins__": {}, **FUNCTIONS, **CONSTANTS}, given)
        except ArithmeticError:  # of numbers alone
            found = math.nan
        return np.where(np.isfinite(found), found, np.nan)


@lru_cache(maxsize=1024)
def _compiled(text: str) -> tuple[CodeType, frozenset[str]]:
    """Code and needed names of an expression; nothing but the allowed nodes passes."""
    try:
        tree = ast.parse(text, mode="eval")
    except (SyntaxError, ValueError):
        raise InputError(f"'{text}' is no arithmetic expression") from None
    called = {id(node.func) for node in ast.walk(tree) if isinstance(node, ast.Call)}
    names: set[str] = set()
    for node in ast.walk(tree):
        if not isinstance(node, _ALLOWED):
            raise InputError(f"'{text}': only numbers, names, + - * / ** and functions are allowed")
        if isinstance(node, ast.Constant) and (
            isinstance(node.value, bool) or not isinstance(node.value, (int, float))
        ):
            raise InputError(f"'{text}': {node.value!r} is no number")
        if isinstance(node, ast.Call) and (
            node.keywords or not isinstance(node.func, ast.Name) or node.func.id not in FUNCTIONS
        ):
            raise InputError(f"'{text}': functions are {', '.join(FUNCTIONS)}")
        if isinstance(node, ast.Name) and id(node) not in called and node.id not in CONSTANTS:
            names.add(node.id)
    return compile(tree, "<study>", "eval"), frozenset(names)
