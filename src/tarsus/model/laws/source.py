"""The source of a law's function: its syntax tree, as it was when the function was loaded."""

from __future__ import annotations

import ast
import inspect
from collections.abc import Callable
from functools import lru_cache
from types import FunctionType
from typing import Any

from tarsus.base.errors import InputError


@lru_cache(maxsize=256)
def definition(function: Callable[..., Any], name: str) -> ast.FunctionDef:
    """The syntax tree of a plain function, with the line numbers of its file; ``name`` is what messages call it.

    Raises
    ------
    InputError
        Where it is no plain function, or its source cannot be read or is no longer that of the function.
    """
    if not isinstance(function, FunctionType) or hasattr(function, "__wrapped__"):
        raise InputError(f"{name}: a law is a plain function written with 'def', without decorators")
    line = function.__code__.co_firstlineno
    if function.__name__ == "<lambda>":
        raise InputError(f"{name}, line {line}: a lambda is not a law; write the function with 'def'")
    try:
        lines, _ = inspect.getsourcelines(function)
        text = "".join(lines)
        indented = text[:1].isspace()
        tree = ast.parse("if True:\n" + text if indented else text)
    except (OSError, TypeError, SyntaxError):
        raise InputError(f"{name}: its source cannot be read; write the law in a file") from None
    ast.increment_lineno(tree, line - (2 if indented else 1))
    outer = tree.body[0]
    found = outer.body[0] if isinstance(outer, ast.If) else outer
    if not isinstance(found, ast.FunctionDef) or not _same(function, found):
        raise InputError(f"{name}, line {line}: its file has changed since it was loaded; load it again")
    for decorator in found.decorator_list:
        if not (isinstance(decorator, ast.Name) and decorator.id == "staticmethod"):
            raise InputError(
                f"{name}, line {decorator.lineno}: the decorator '{ast.unparse(decorator)}' is not allowed on a law"
            )
    return found


def _same(function: FunctionType, tree: ast.FunctionDef) -> bool:
    """Whether the tree is that of the function, and not of a file edited since: it names and says the same."""
    bare = ast.FunctionDef(tree.name, tree.args, tree.body, [], None, lineno=1, col_offset=0)
    module = ast.fix_missing_locations(ast.Module([bare], []))
    try:
        compiled = compile(module, "<law>", "exec", dont_inherit=True)
    except SyntaxError:  # a name of an enclosing function that the tree alone does not show
        return True
    code = next((c for c in compiled.co_consts if inspect.iscode(c)), None)
    own = function.__code__
    if code is None:
        return False

    def said(c: Any) -> tuple[Any, ...]:
        numbers = [(type(x), x) for x in c.co_consts if isinstance(x, (int, float))]
        return c.co_varnames, sorted({*c.co_names, *c.co_freevars}), numbers

    return said(code) == said(own)
