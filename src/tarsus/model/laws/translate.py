"""From a law's plain Python function to its program.

The function is run with numbers whose operations are recorded. Where it asks whether one of them holds, it is run again
for the other outcome, until all outcomes are known; the results are then selected by the comparisons that led to them.
Functions that the law calls are run alike. What cannot be recorded is refused with a sentence.
"""

from __future__ import annotations

import builtins
import inspect
import math
from collections.abc import Callable, Sequence
from functools import lru_cache
from numbers import Real
from types import BuiltinFunctionType, CellType, FunctionType, ModuleType
from typing import Any, NoReturn

from tarsus.base.errors import InputError
from tarsus.model.laws.program import LIMIT, Builder, Number, Op, Program, Value

OUTCOMES = 256
"""Outcomes of its comparisons that a law is run for at most: eight independent ones, or as many in a row."""
ALLOWED = "a law is plain Python of floats, with 'min', 'max' and the functions of 'math'"


class Refused(Exception):
    """Why a law cannot be recorded, in a sentence."""


class Traced:
    """A number known only when the program runs: its operations are recorded, its truth is asked for."""

    __slots__ = ("tracer", "value")
    __hash__ = object.__hash__
    __array_ufunc__ = None  # functions of numpy refuse it

    def __init__(self, tracer: LawTracer, value: Value) -> None:
        self.tracer, self.value = tracer, value

    def __bool__(self) -> bool:
        return self.tracer.holds(self.value)

    def __pos__(self) -> Traced:
        return self

    def __round__(self, digits: int | None = None) -> Any:
        if digits is not None:
            raise Refused("'round' takes one number in a law")
        return self.tracer.apply(Op.ROUND, self)

    def _unknown(self) -> NoReturn:
        raise Refused(f"a number that changes is used where a known one is needed: {ALLOWED}")

    __float__ = __int__ = __index__ = __complex__ = _unknown


Traced.__name__ = "number"  # what Python's own messages call it


def _records(op: Op, *, reflected: bool = False) -> Callable[..., Any]:
    """A method of `Traced` that records an operation on it and what else it takes."""

    def method(self: Traced, *others: Any) -> Any:
        if not all(isinstance(one, Traced | Real) for one in others):
            return NotImplemented
        return self.tracer.apply(op, *others, self) if reflected else self.tracer.apply(op, self, *others)

    return method


for _name, _op in {
    "add": Op.ADD,
    "sub": Op.SUBTRACT,
    "mul": Op.MULTIPLY,
    "truediv": Op.DIVIDE,
    "floordiv": Op.FLOOR_DIVIDE,
    "mod": Op.MODULO,
    "pow": Op.POWER,
}.items():
    setattr(Traced, f"__{_name}__", _records(_op))
    setattr(Traced, f"__r{_name}__", _records(_op, reflected=True))
for _name, _op in {"lt": Op.LESS, "le": Op.LESS_EQUAL, "eq": Op.EQUAL, "ne": Op.NOT_EQUAL}.items():
    setattr(Traced, f"__{_name}__", _records(_op))
for _name, _op in {"gt": Op.LESS, "ge": Op.LESS_EQUAL}.items():
    setattr(Traced, f"__{_name}__", _records(_op, reflected=True))
for _name, _op in {"neg": Op.NEGATE, "abs": Op.ABSOLUTE, "floor": Op.FLOOR, "ceil": Op.CEIL, "trunc": Op.TRUNC}.items():
    setattr(Traced, f"__{_name}__", _records(_op))

_MATH = {getattr(math, op.name.lower()): op for op in Op if hasattr(math, op.name.lower())}
_MATH |= {math.fabs: Op.ABSOLUTE, math.pow: Op.POWER}


class LawTracer:
    """Runs a law once for every outcome of its comparisons.

    path: the comparisons asked for so far in this run, each with its outcome; asked: how many of them were asked again.
    """

    def __init__(self, builder: Builder) -> None:
        self.builder = builder
        self.path: list[tuple[Value, bool]] = []
        self.asked = 0
        self.known: dict[Any, Any] = {function: self._recorded(function, op) for function, op in _MATH.items()}
        self.known |= {
            min: self._extreme(min, Op.MINIMUM),
            max: self._extreme(max, Op.MAXIMUM),
            math.log: self._log,
            math.radians: lambda x: x * (math.pi / 180.0),
            math.degrees: lambda x: x * (180.0 / math.pi),
            int: lambda x: self.apply(Op.TRUNC, x) if isinstance(x, Traced) else int(x),
            float: lambda x: x if isinstance(x, Traced) else float(x),
        }
        self.known |= dict.fromkeys((print, input, open, exec, eval), self._refused)
        own = {one.__name__: made for one, made in self.known.items() if one.__module__ == "builtins"}
        self.builtins = vars(builtins) | own
        self.spaces: dict[int, dict[str, Any]] = {}

    def apply(self, op: Op, *operands: Any) -> Any:
        """Record an operation, or do it where all its operands are known."""
        if len(self.builder) > LIMIT:
            raise Refused(f"more than {LIMIT} operations with all loops written out")
        found = self.builder.apply(op, *(self.plain(one) for one in operands))
        return Traced(self, found) if isinstance(found, Value) else found

    @staticmethod
    def plain(one: Any) -> Number:
        """A number as the builder takes it."""
        if isinstance(one, Traced):
            return one.value
        return one if isinstance(one, int | float) else float(one)

    def holds(self, value: Value) -> bool:
        """The outcome of a comparison in this run: one that was asked before has the outcome it had."""
        if not value.boolean:
            value = self.plain(self.apply(Op.NOT_EQUAL, Traced(self, value), 0.0))  # type: ignore[assignment]
        for test, outcome in self.path[: self.asked]:
            if test == value:
                return outcome
        if self.asked == len(self.path):
            if self.asked == OUTCOMES:
                raise Refused(f"more than {OUTCOMES} comparisons in a row: does a loop end by a number that changes?")
            self.path.append((value, True))
        test, outcome = self.path[self.asked]
        if test != value:
            raise Refused("it does something else when it is run again")
        self.asked += 1
        return outcome

    def selected(self, call: Callable[[], Any]) -> Number:
        """The value of a call over all outcomes."""
        leaves: list[tuple[list[tuple[Value, bool]], Number]] = []
        while True:
            self.asked = 0
            found = call()
            if not isinstance(found, Traced | Real):
                what = "nothing on some path" if found is None else f"a {type(found).__name__}"
                raise Refused(f"it returns {what}, not a number")
            leaves.append((list(self.path), self.plain(found)))
            while self.path and not self.path[-1][1]:
                self.path.pop()
            if not self.path:
                return self._folded(leaves, 0)
            if len(leaves) == OUTCOMES:
                raise Refused(
                    f"more than {OUTCOMES} outcomes of its comparisons: write independent ones with 'min' and 'max'"
                )
            self.path[-1] = self.path[-1][0], False

    def _folded(self, leaves: Sequence[tuple[list[tuple[Value, bool]], Number]], depth: int) -> Number:
        """The results of runs that agree in their first comparisons, selected by the next."""
        path, found = leaves[0]
        if len(path) == depth:
            return found
        sides = ([one for one in leaves if one[0][depth][1] is outcome] for outcome in (True, False))
        return self.builder.apply(Op.SELECT, path[depth][0], *(self._folded(side, depth + 1) for side in sides))

    # ---- the law's world: what it finds under the names that it uses

    def rebuilt(self, function: FunctionType) -> FunctionType:
        """The same function in a world in which numbers are recorded."""
        space = self.spaces.get(id(function.__globals__))
        if space is None:
            space = {name: self.seen(one) for name, one in function.__globals__.items()}
            self.spaces[id(function.__globals__)] = space | {"__builtins__": self.builtins}
        cells = tuple(CellType(self.seen(cell.cell_contents)) for cell in function.__closure__ or ())
        space = self.spaces[id(function.__globals__)]
        made = FunctionType(function.__code__, space, function.__name__, function.__defaults__, cells or None)
        made.__kwdefaults__ = function.__kwdefaults__
        return made

    def seen(self, one: Any) -> Any:
        """What a law finds: functions that record where it would find those of Python, files and classes alike."""
        if isinstance(one, FunctionType):
            return lambda *operands, **named: self.rebuilt(one)(*operands, **named)
        if isinstance(one, BuiltinFunctionType | type) and one in self.known:
            return self.known[one]
        return _Names(self, one) if isinstance(one, ModuleType | type) else one

    def _recorded(self, function: Callable[..., Any], op: Op) -> Callable[..., Any]:
        def recorded(*operands: Any) -> Any:
            if len(operands) != op.operands:
                raise Refused(f"'{function.__name__}' takes {op.operands} numbers in a law, got {len(operands)}")
            return self.apply(op, *operands)

        return recorded

    def _extreme(self, function: Callable[..., Any], op: Op) -> Callable[..., Any]:
        def extreme(*operands: Any) -> Any:
            first, *others = operands if len(operands) > 1 else list(*operands)
            for other in others:
                first = self.apply(op, first, other)
            return first

        return extreme

    def _log(self, x: Any, *base: Any) -> Any:
        top = self.apply(Op.LOG, x)
        return top / self.apply(Op.LOG, *base) if base else top

    @staticmethod
    def _refused(*_: Any) -> NoReturn:
        raise Refused(f"it only computes: {ALLOWED}")


class _Names:
    """A file or class whose names are those of the law's world."""

    def __init__(self, tracer: LawTracer, of: ModuleType | type) -> None:
        self._tracer, self._of = tracer, of

    def __getattr__(self, name: str) -> Any:
        return self._tracer.seen(getattr(self._of, name))


@lru_cache(maxsize=256)
def translate(
    function: Callable[..., float], leading: int | None = None, name: str | None = None, *, switched: bool = False
) -> Program:
    """The program of a plain function of floats.

    Parameters
    ----------
    function
        A function written with ``def``.
    leading
        How many of what it takes are arguments; the rest are parameters. All, unless given.
    name
        What messages call it; its qualified name, unless given.
    switched
        Whether one more parameter follows, by which the value is multiplied: 0 where the law does not act.

    Raises
    ------
    InputError
        Where it does what a law may not, with its name and the line in its file.
    """
    if not isinstance(function, FunctionType) or hasattr(function, "__wrapped__"):
        raise InputError(f"{name or function}: a law is a plain function written with 'def', without decorators")
    named = name or function.__qualname__.rpartition("<locals>.")[2]
    taken = inspect.signature(function).parameters.values()
    if any(one.kind not in (one.POSITIONAL_ONLY, one.POSITIONAL_OR_KEYWORD) for one in taken):
        line = function.__code__.co_firstlineno
        raise InputError(f"{named}, line {line}: it takes its arguments by position, each by its name: {ALLOWED}")
    arguments = len(taken) if leading is None else leading
    builder = Builder(arguments, len(taken) - arguments + switched)
    tracer = LawTracer(builder)
    inputs = [Traced(tracer, one) for one in builder.inputs]
    law = tracer.rebuilt(function)
    try:
        if switched:
            *inputs, on = inputs
            return builder.finish(tracer.selected(lambda: law(*inputs) * on))
        return builder.finish(tracer.selected(lambda: law(*inputs)))
    except Exception as error:
        raise InputError(_sentence(named, function, error)) from error


def _sentence(named: str, function: FunctionType, error: Exception) -> str:
    """What stopped a law, with the line of its file where it was stopped."""
    line, trace = function.__code__.co_firstlineno, error.__traceback__
    while trace is not None:
        if trace.tb_frame.f_code.co_filename == function.__code__.co_filename:
            line = trace.tb_lineno
        trace = trace.tb_next
    said = str(error)
    if not isinstance(error, Refused | TypeError | NameError | AttributeError | OverflowError):
        said = f"it raises {type(error).__name__}" + (f" ({error})" if said else "")
    return f"{named}, line {line}: {said}"
