"""Which rows of a table a claim is about: comparisons of columns with numbers and words, joined by and, or, not."""

from __future__ import annotations

import ast
import operator
from collections.abc import Callable, Collection, Mapping
from itertools import pairwise
from typing import Any

from tarsus.base.errors import InputError
from tarsus.base.messages import nearest

Cell = float | str
Row = Mapping[str, Cell]
"""The cells of a row by column, as numbers where they are numbers; empty cells are left out."""

_COMPARISONS: dict[type[ast.cmpop], Callable[[Any, Any], bool]] = {
    ast.Eq: operator.eq,
    ast.NotEq: operator.ne,
    ast.Lt: operator.lt,
    ast.LtE: operator.le,
    ast.Gt: operator.gt,
    ast.GtE: operator.ge,
}

_GRAMMAR = 'expected comparisons such as event == "pull_in" and volts < 60, joined by and, or, not'


class Selection:
    """A condition on rows, such as ``event == "pull_in" and volts < 60``; an empty one selects every row.

    Raises InputError where the text is no such condition.
    """

    def __init__(self, text: str) -> None:
        self.text = text
        try:
            self._tree = ast.parse(text, mode="eval").body if text.strip() else None
        except (SyntaxError, ValueError):
            raise InputError(f"'{text}': {_GRAMMAR}") from None
        self.columns: frozenset[str] = frozenset() if self._tree is None else frozenset(_names(self._tree, text))

    def check(self, known: Collection[str]) -> list[str]:
        """A sentence for every column that a table with these columns lacks."""
        return [
            f"'{self.text}': the table has no column '{name}'{nearest(name, known)}"
            for name in sorted(self.columns - set(known))
        ]

    def __call__(self, row: Row) -> bool:
        """Whether a row is selected; a comparison with an empty cell, or of a word with a number, is not met."""
        return self._tree is None or _holds(self._tree, row)


def _names(node: ast.expr, text: str) -> set[str]:
    """Columns of a condition; raises InputError where it is none."""
    match node:
        case ast.BoolOp(values=values):
            return set().union(*(_names(one, text) for one in values))
        case ast.UnaryOp(op=ast.Not(), operand=operand):
            return _names(operand, text)
        case ast.Compare(left=left, ops=ops, comparators=others) if all(type(op) in _COMPARISONS for op in ops):
            terms = [left, *others]
            if all(isinstance(_value(one), float | str) or isinstance(one, ast.Name) for one in terms):
                return {one.id for one in terms if isinstance(one, ast.Name)}
    raise InputError(f"'{text}': {_GRAMMAR}")


def _value(node: ast.expr) -> Cell | None:
    """A number or a word that is written out; None of anything else."""
    match node:
        case ast.Constant(value=bool()):
            return None
        case ast.Constant(value=int() | float() as number):
            return float(number)
        case ast.Constant(value=str() as word):
            return word
        case ast.UnaryOp(op=ast.USub(), operand=ast.Constant(value=int() | float() as number)):
            return -float(number)
    return None


def _holds(node: ast.expr, row: Row) -> bool:
    match node:
        case ast.BoolOp(op=ast.And(), values=values):
            return all(_holds(one, row) for one in values)
        case ast.BoolOp(values=values):
            return any(_holds(one, row) for one in values)
        case ast.UnaryOp(operand=operand):
            return not _holds(operand, row)
        case ast.Compare(left=left, ops=ops, comparators=others):
            cells = [row.get(one.id) if isinstance(one, ast.Name) else _value(one) for one in (left, *others)]
            return all(_met(op, *pair) for op, pair in zip(ops, pairwise(cells), strict=True))
    return False


def _met(op: ast.cmpop, left: Cell | None, right: Cell | None) -> bool:
    return type(left) is type(right) and left is not None and _COMPARISONS[type(op)](left, right)
