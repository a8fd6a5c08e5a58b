"""From a law's plain Python function to its program.

The function is read, not run: its syntax tree is followed once with the arguments as unknown values.  Branches on
what is not known are both followed and their outcomes selected, loops are written out turn by turn, functions of
the same file are carried out where they are called.  What a law may not contain is refused with a sentence.
"""

from __future__ import annotations

import ast
import builtins
import inspect
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from types import BuiltinFunctionType, FunctionType, ModuleType
from typing import Any, NoReturn

from tarsus.base.errors import InputError
from tarsus.model.laws.program import LIMIT, Builder, Number, Op, Program, Value
from tarsus.model.laws.source import definition

TURNS = 1000
"""Turns of a loop at most: each is written out, and the program is limited anyway."""
DEPTH = 20
"""Functions that call one another at most."""

ALLOWED = "a law is arithmetic, comparisons, 'if', 'for' over range() and math functions of floats"


@lru_cache(maxsize=256)
def translate(function: Callable[..., float], leading: int | None = None, name: str | None = None) -> Program:
    """The program of a plain function of floats.

    Parameters
    ----------
    function
        A function whose source can be read: of a module, a file loaded by path, or a notebook.
    leading
        How many of what it takes are arguments; the rest are parameters. All, unless given.
    name
        What messages call it; its qualified name, unless given.

    Raises
    ------
    InputError
        Where it contains what a law may not, with its name and the line in its file.
    """
    named = name or function.__qualname__.rpartition("<locals>.")[2]
    tree = definition(function, named)
    taken = [a.arg for a in (*tree.args.posonlyargs, *tree.args.args)]
    arguments = len(taken) if leading is None else leading
    builder = Builder(arguments, len(taken) - arguments)
    body = _Body(builder, function, named, (function,))
    if tree.args.vararg or tree.args.kwarg or tree.args.kwonlyargs:
        body.refuse(tree, f"it takes its arguments by position, each by its name: {ALLOWED}")
    result = body.run(tree, dict(zip(taken, builder.inputs, strict=True)))
    try:
        return builder.finish(body.number(tree, result))
    except OverflowError:
        body.refuse(tree, "it contains an integer that is too large for a float")


_MATH: dict[Any, Op] = {getattr(math, op.name.lower()): op for op in Op if hasattr(math, op.name.lower())}
_MATH[math.fabs] = Op.ABSOLUTE
_MATH[math.pow] = Op.POWER
_PLAIN: dict[Any, Op] = {abs: Op.ABSOLUTE, round: Op.ROUND, pow: Op.POWER, int: Op.TRUNC}
_SEQUENCES = (range, enumerate, zip, reversed, tuple, list, len)
_BINARY = {
    ast.Add: Op.ADD, ast.Sub: Op.SUBTRACT, ast.Mult: Op.MULTIPLY, ast.Div: Op.DIVIDE,
    ast.FloorDiv: Op.FLOOR_DIVIDE, ast.Mod: Op.MODULO, ast.Pow: Op.POWER,
}  # fmt: skip
_COMPARE = {
    ast.Lt: (Op.LESS, False), ast.LtE: (Op.LESS_EQUAL, False), ast.Gt: (Op.LESS, True),
    ast.GtE: (Op.LESS_EQUAL, True), ast.Eq: (Op.EQUAL, False), ast.NotEq: (Op.NOT_EQUAL, False),
}  # fmt: skip
_WORDS: dict[type[ast.AST], str] = {
    ast.While: "'while'", ast.Try: "'try'", ast.With: "'with'", ast.Raise: "'raise'", ast.Assert: "'assert'",
    ast.Lambda: "a lambda", ast.FunctionDef: "a function inside the function", ast.ClassDef: "a class",
    ast.Import: "'import' inside the function", ast.ImportFrom: "'import' inside the function",
    ast.Global: "'global'", ast.Nonlocal: "'nonlocal'", ast.Delete: "'del'", ast.Match: "'match'",
    ast.Break: "'break'", ast.Continue: "'continue'", ast.Yield: "'yield'", ast.NamedExpr: "':='",
    ast.ListComp: "a comprehension", ast.GeneratorExp: "a comprehension", ast.SetComp: "a comprehension",
    ast.DictComp: "a comprehension", ast.Dict: "a dictionary", ast.Set: "a set", ast.JoinedStr: "a string",
    ast.Starred: "'*'", ast.Slice: "a slice", ast.Await: "'await'",
}  # fmt: skip


class _Unset:
    """What a name stands for where some paths give it no value."""


_UNSET = _Unset()


@dataclass
class _State:
    """Where a function stands: its names, whether it has returned (maybe a value), and what."""

    names: dict[str, Any]
    returned: Any = False
    value: Any = field(default_factory=lambda: _UNSET)

    def copy(self) -> _State:
        return _State(dict(self.names), self.returned, self.value)


class _Body:
    """Follows one function's statements; ``stack``: the functions being carried out."""

    def __init__(
        self, builder: Builder, function: Callable[..., Any], name: str, stack: tuple[Callable[..., Any], ...]
    ) -> None:
        self.builder, self.function, self.name, self.stack = builder, function, name, stack
        self.local = frozenset(function.__code__.co_varnames)  # type: ignore[attr-defined]

    def refuse(self, node: ast.AST, text: str) -> NoReturn:
        raise InputError(f"{self.name}, line {getattr(node, 'lineno', '?')}: {text}")

    def not_allowed(self, node: ast.AST) -> NoReturn:
        what = _WORDS.get(type(node), f"'{type(node).__name__.lower()}'")
        self.refuse(node, f"{what} is not allowed: {ALLOWED}")

    def run(self, tree: ast.FunctionDef, names: dict[str, Any]) -> Any:
        state = _State(names)
        self.block(tree.body, state)
        if state.returned is not True:
            self.refuse(tree, "it does not return a number on every path")
        return state.value

    # ---- statements

    def block(self, statements: Sequence[ast.stmt], state: _State) -> None:
        for statement in statements:
            if state.returned is True:
                return
            self.statement(statement, state)
            if len(self.builder) > LIMIT:
                self.refuse(statement, f"more than {LIMIT} operations with all loops written out")

    def statement(self, node: ast.stmt, state: _State) -> None:
        match node:
            case ast.Return(value=value):
                if value is None:
                    self.refuse(node, "it returns no number here")
                found = self.expression(value, state)
                before = state.value
                state.value = found if before is _UNSET else self.select(node, state.returned, before, found)
                state.returned = True
            case ast.Assign(targets=targets, value=value):
                found = self.expression(value, state)
                for target in targets:
                    self.assign(target, found, state)
            case ast.AnnAssign(target=target, value=value):
                if value is not None:
                    self.assign(target, self.expression(value, state), state)
            case ast.AugAssign(target=ast.Name(id=name) as target, op=op, value=value):
                before = self.look_up(target, name, state)
                state.names[name] = self.binary(node, op, before, self.expression(value, state))
            case ast.If(test=test, body=body, orelse=orelse):
                self.branch(node, self.truth(test, self.expression(test, state)), body, orelse, state)
            case ast.For(target=target, iter=over, body=body, orelse=orelse):
                if orelse:
                    self.refuse(node, f"'else' of a loop is not allowed: {ALLOWED}")
                self.loop(node, target, self.turns(over, state), body, state)
            case ast.Pass() | ast.Expr(value=ast.Constant()):
                pass
            case ast.Expr(value=value):
                self.refuse(node, f"'{ast.unparse(value)}' does nothing here: {ALLOWED}")
            case _:
                self.not_allowed(node)

    def assign(self, target: ast.expr, found: Any, state: _State) -> None:
        match target:
            case ast.Name(id=name):
                state.names[name] = found
            case ast.Tuple(elts=elements) | ast.List(elts=elements):
                if not isinstance(found, tuple) or len(found) != len(elements):
                    self.refuse(target, f"expected {len(elements)} values for '{ast.unparse(target)}'")
                for element, part in zip(elements, found, strict=True):
                    self.assign(element, part, state)
            case _:
                self.refuse(target, f"'{ast.unparse(target)}' cannot be given a value: {ALLOWED}")

    def branch(
        self, node: ast.AST, test: Any, body: Sequence[ast.stmt], orelse: Sequence[ast.stmt], state: _State
    ) -> None:
        if not isinstance(test, Value):
            self.block(body if test else orelse, state)
            return
        then, other = state.copy(), state.copy()
        self.block(body, then)
        self.block(orelse, other)
        if then.returned is True or other.returned is True:
            state.names = (other if then.returned is True else then).names
        else:
            state.names = {
                key: self.joined(test, then.names.get(key, _UNSET), other.names.get(key, _UNSET))
                for key in (*then.names, *(key for key in other.names if key not in then.names))
            }
        if then.value is _UNSET or other.value is _UNSET:
            state.value = other.value if then.value is _UNSET else then.value
        else:
            state.value = self.select(node, test, then.value, other.value)
        returned = then.returned is True and other.returned is True
        state.returned = returned or self.select(node, test, then.returned, other.returned)

    def joined(self, test: Value, then: Any, other: Any) -> Any:
        """A name's value after a branch; unset where one side gives it none, or something of another kind."""
        if then is other:
            return then
        if isinstance(then, tuple) and isinstance(other, tuple) and len(then) == len(other):
            return tuple(self.joined(test, a, b) for a, b in zip(then, other, strict=True))
        if isinstance(then, (Value, int, float)) and isinstance(other, (Value, int, float)):
            return self.builder.apply(Op.SELECT, test, then, other)
        return _UNSET

    def loop(
        self, node: ast.For, target: ast.expr, turns: Sequence[Any], body: Sequence[ast.stmt], state: _State
    ) -> None:
        for turn in turns:
            if state.returned is True:
                return
            self.assign(target, turn, state)
            self.block(body, state)

    def turns(self, over: ast.expr, state: _State) -> Sequence[Any]:
        found = self.expression(over, state)
        if not isinstance(found, tuple):
            self.refuse(over, f"a loop runs over range() of known numbers, not over '{ast.unparse(over)}'")
        return found

    # ---- expressions

    def expression(self, node: ast.expr, state: _State) -> Any:
        match node:
            case ast.Constant(value=value):
                if not isinstance(value, (int, float)):
                    self.refuse(node, f"{value!r} is not a number: {ALLOWED}")
                return value
            case ast.Name(id=name):
                return self.look_up(node, name, state)
            case ast.Attribute(value=value, attr=attribute):
                return self.attribute(node, self.expression(value, state), attribute)
            case ast.BinOp(left=left, op=op, right=right):
                return self.binary(node, op, self.expression(left, state), self.expression(right, state))
            case ast.UnaryOp(op=op, operand=operand):
                return self.unary(node, op, self.expression(operand, state))
            case ast.Compare():
                return self.compare(node, state)
            case ast.BoolOp(op=op, values=values):
                return self.logical(node, op, values, state)
            case ast.IfExp(test=test, body=body, orelse=orelse):
                known = self.truth(test, self.expression(test, state))
                if not isinstance(known, Value):
                    return self.expression(body if known else orelse, state)
                return self.select(node, known, self.expression(body, state), self.expression(orelse, state))
            case ast.Call():
                return self.call(node, state)
            case ast.Tuple(elts=elements) | ast.List(elts=elements):
                return tuple(self.expression(element, state) for element in elements)
            case ast.Subscript(value=value, slice=index):
                return self.item(node, self.expression(value, state), self.expression(index, state))
            case _:
                self.not_allowed(node)

    def number(self, node: ast.AST, x: Any) -> Number:
        if not isinstance(x, (Value, int, float)):
            what = "a tuple" if isinstance(x, tuple) else f"'{getattr(x, '__name__', type(x).__name__)}'"
            self.refuse(node, f"expected a number, got {what}")
        return x

    def apply(self, node: ast.AST, op: Op, *operands: Any) -> Number:
        try:
            return self.builder.apply(op, *(self.number(node, x) for x in operands))
        except OverflowError:
            self.refuse(node, "it contains an integer that is too large for a float")

    def truth(self, node: ast.AST, x: Any) -> Any:
        """Whether a number is not zero: a boolean value, or Python's own where it is known."""
        x = self.number(node, x)
        if not isinstance(x, Value):
            return bool(x)
        return x if x.boolean else self.apply(node, Op.NOT_EQUAL, x, 0.0)

    def select(self, node: ast.AST, test: Any, then: Any, other: Any) -> Any:
        if isinstance(then, tuple) and isinstance(other, tuple) and len(then) == len(other):
            return tuple(self.select(node, test, a, b) for a, b in zip(then, other, strict=True))
        return self.apply(node, Op.SELECT, test, then, other)

    def look_up(self, node: ast.AST, name: str, state: _State) -> Any:
        if name in state.names or name in self.local:
            found = state.names.get(name, _UNSET)
            if found is _UNSET:
                self.refuse(node, f"'{name}' has no value on some path that leads here")
            return found
        function = self.function
        assert isinstance(function, FunctionType)
        closed = dict(zip(function.__code__.co_freevars, function.__closure__ or (), strict=True))
        if name in closed:
            return self.outside(node, name, closed[name].cell_contents)
        if name in function.__globals__:
            return self.outside(node, name, function.__globals__[name])
        if hasattr(builtins, name):
            return getattr(builtins, name)
        self.refuse(node, f"'{name}' is not defined")

    def attribute(self, node: ast.AST, of: Any, name: str) -> Any:
        if isinstance(of, (Value, int, float, tuple)):
            self.refuse(node, f"'.{name}' of a number is not allowed: {ALLOWED}")
        if not hasattr(of, name):
            self.refuse(node, f"'{getattr(of, '__name__', of)}' has no '{name}'")
        return self.outside(node, name, getattr(of, name))

    def outside(self, node: ast.AST, name: str, x: Any) -> Any:
        """Something defined outside the function: a number or numbers as they are now, or what can be called."""
        if isinstance(x, (bool, int, float)):
            return x if isinstance(x, (bool, int)) else float(x)
        if isinstance(x, (tuple, list)):
            return tuple(self.outside(node, name, part) for part in x)
        if isinstance(x, (ModuleType, type, FunctionType, BuiltinFunctionType)):
            return x
        self.refuse(node, f"'{name}' is of type {type(x).__name__}, not a number: {ALLOWED}")

    def binary(self, node: ast.AST, op: ast.operator, a: Any, b: Any) -> Number:
        if type(op) not in _BINARY:
            self.refuse(node, f"the operator '{type(op).__name__}' is not allowed: {ALLOWED}")
        return self.apply(node, _BINARY[type(op)], a, b)

    def unary(self, node: ast.AST, op: ast.unaryop, x: Any) -> Number:
        if isinstance(op, ast.Not):
            known = self.truth(node, x)
            return self.apply(node, Op.EQUAL, known, 0.0) if isinstance(known, Value) else not known
        if isinstance(op, ast.Invert):
            self.refuse(node, f"the operator '~' is not allowed: {ALLOWED}")
        return self.apply(node, Op.NEGATE, x) if isinstance(op, ast.USub) else self.number(node, x)

    def compare(self, node: ast.Compare, state: _State) -> Number:
        left = self.expression(node.left, state)
        result: Any = None
        for op, right_node in zip(node.ops, node.comparators, strict=True):
            if type(op) not in _COMPARE:
                self.refuse(node, f"'{ast.unparse(node)}': only < <= > >= == != compare numbers")
            right = self.expression(right_node, state)
            number, swapped = _COMPARE[type(op)]
            one = self.apply(node, number, *((right, left) if swapped else (left, right)))
            result = one if result is None else self.both(node, result, one)
            left = right
        return result

    def both(self, node: ast.AST, a: Any, b: Any) -> Any:
        if not isinstance(a, Value):
            return b if a else a
        return self.apply(node, Op.SELECT, a, b, False if a.boolean else a)

    def logical(self, node: ast.AST, op: ast.boolop, values: Sequence[ast.expr], state: _State) -> Any:
        result = self.number(node, self.expression(values[0], state))
        for value in values[1:]:
            if not isinstance(result, Value):
                if bool(result) is isinstance(op, ast.Or):
                    return result
                result = self.number(node, self.expression(value, state))
                continue
            found = self.number(node, self.expression(value, state))
            if isinstance(op, ast.And):
                result = self.both(node, result, found)
            else:
                result = self.apply(node, Op.SELECT, result, True if result.boolean else result, found)
        return result

    def item(self, node: ast.AST, of: Any, index: Any) -> Any:
        if not isinstance(of, tuple) or not isinstance(index, int):
            self.refuse(node, f"only a known entry of a tuple of numbers can be taken: {ALLOWED}")
        if not -len(of) <= index < len(of):
            self.refuse(node, f"there is no entry {index} of {len(of)}")
        return of[index]

    # ---- calls

    def call(self, node: ast.Call, state: _State) -> Any:
        called = self.expression(node.func, state)
        named = ast.unparse(node.func)
        if any(isinstance(a, ast.Starred) for a in node.args) or any(k.arg is None for k in node.keywords):
            self.refuse(node, f"'*' in a call is not allowed: {ALLOWED}")
        arguments = [self.expression(a, state) for a in node.args]
        keywords = {str(k.arg): self.expression(k.value, state) for k in node.keywords}
        if isinstance(called, FunctionType):
            return self.helper(node, named, called, arguments, keywords)
        if called in _SEQUENCES:
            return self.sequence(node, named, called, arguments, keywords)
        if keywords:
            self.refuse(node, f"'{named}' takes no keywords in a law")
        op = _MATH.get(called) or _PLAIN.get(called) if _hashable(called) else None
        if op is not None and not (called is math.log and len(arguments) == 2):
            if len(arguments) != op.operands:
                self.refuse(node, f"'{named}' takes {op.operands} numbers in a law, got {len(arguments)}")
            return self.apply(node, op, *arguments)
        return self.known_call(node, named, called, arguments)

    def known_call(self, node: ast.Call, named: str, called: Any, arguments: list[Any]) -> Any:
        if called in (min, max):
            op = Op.MINIMUM if called is min else Op.MAXIMUM
            if len(arguments) == 1 and isinstance(arguments[0], tuple):
                arguments = list(arguments[0])
            if not arguments:
                self.refuse(node, f"'{named}' of no numbers")
            result = self.number(node, arguments[0])
            for other in arguments[1:]:
                result = self.apply(node, op, result, other)
            return result
        if called is math.log:
            return self.apply(node, Op.DIVIDE, *(self.apply(node, Op.LOG, x) for x in arguments))
        if len(arguments) == 1 and called is float:
            return self.apply(node, Op.MULTIPLY, arguments[0], 1.0)
        if len(arguments) == 1 and called is bool:
            return self.truth(node, arguments[0])
        if len(arguments) == 1 and called in (math.radians, math.degrees):
            factor = math.pi / 180.0 if called is math.radians else 180.0 / math.pi
            return self.apply(node, Op.MULTIPLY, arguments[0], factor)
        self.refuse(node, f"'{named}' cannot be called: {ALLOWED}")

    def sequence(
        self, node: ast.Call, named: str, called: Any, arguments: list[Any], keywords: dict[str, Any]
    ) -> Any:
        known = (lambda x: isinstance(x, int)) if called is range else (lambda x: isinstance(x, (tuple, int)))
        if not all(known(x) for x in (*arguments, *keywords.values())):
            self.refuse(
                node, f"the bounds of '{named}' must be known numbers: each turn of a loop is written out"
            )
        try:
            found = called(*arguments, **keywords)
            if isinstance(found, int):
                return found
            if isinstance(found, range) and len(found) > TURNS:
                self.refuse(node, f"a loop of {len(found)} turns: at most {TURNS} are written out")
            return tuple(found)
        except (TypeError, ValueError) as error:
            self.refuse(node, f"'{named}': {error}")

    def helper(
        self, node: ast.Call, named: str, called: FunctionType, arguments: list[Any], keywords: dict[str, Any]
    ) -> Any:
        """Another function of the same file, carried out here."""
        if called in self.stack or len(self.stack) >= DEPTH:
            self.refuse(node, f"'{named}' calls itself: {ALLOWED}")
        if called.__module__ != self.function.__module__:
            self.refuse(node, f"'{named}' is defined in another file; a law calls functions of its own file")
        tree = definition(called, named)
        try:
            bound = inspect.signature(called).bind(*arguments, **keywords)
        except TypeError as error:
            self.refuse(node, f"'{named}': {error}")
        bound.apply_defaults()
        body = _Body(self.builder, called, named, (*self.stack, called))
        if tree.args.vararg or tree.args.kwarg:
            body.refuse(tree, f"it takes its arguments by position, each by its name: {ALLOWED}")
        return body.run(tree, dict(bound.arguments))


def _hashable(x: Any) -> bool:
    return getattr(x, "__hash__", None) is not None
