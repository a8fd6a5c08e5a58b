"""Arithmetic of named SI values, as a study writes it: ``"static / (1 + ratio)"``."""

from __future__ import annotations

import ast
import math
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from functools import lru_cache
from types import CodeType

from tarsus.base.errors import InputError
from tarsus.base.messages import nearest

FUNCTIONS = {"sqrt": math.sqrt, "exp": math.exp, "log": math.log, "log10": math.log10, "sin": math.sin, "cos": math.cos,
             "abs": abs, "min": min, "max": max}  # fmt: skip
CONSTANTS = {"pi": math.pi}

_ALLOWED = (
    ast.Expression, ast.BinOp, ast.UnaryOp, ast.Call, ast.Name, ast.Constant, ast.Load,
    ast.Add, ast.Sub, ast.Mult, ast.Div, ast.Pow, ast.USub, ast.UAdd,
)  # fmt: skip


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
        return [
            f"'{self.text}': there is no '{name}'{nearest(name, known)}"
            for name in sorted(names - set(known))
        ]

    def value(self, names: Mapping[str, float]) -> float:
        """Its value; NaN where the arithmetic has none (division by zero, a root of a negative number)."""
        code = _compiled(self.text)[0]
        try:
            found = eval(code, {"__builtins__": {}, **FUNCTIONS, **CONSTANTS}, dict(names))
        except (ArithmeticError, ValueError):
            return math.nan
        return float(found) if isinstance(found, (int, float)) else math.nan


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
