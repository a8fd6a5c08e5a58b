"""A law as a program: a short list of operations on numbers, which the core evaluates for eight values at once.

`tarsus.model.laws.translate` makes one from a law's plain Python function.  A program is straight: every operation is
carried out, branches have become selections, loops are written out, and nothing raises, so that a division by
zero gives an infinity or NaN.  It is data: it serialises with a plan and means the same on every machine.

Values are numbered: the arguments first, then the parameters, the constants, and the result of every operation in
order.  The last operation gives the law's value.
"""

from __future__ import annotations

import hashlib
import math
import struct
from collections.abc import Callable
from dataclasses import dataclass
from enum import IntEnum, auto
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tarsus.base.errors import InputError

LIMIT = 4000
"""Operations of a program at most: the core numbers values in 16 bits, and a longer law takes longer than a step."""


class Op(IntEnum):
    """Operations, in the order that the core numbers them; comparisons give 1 or 0."""

    COPY = 0
    ADD = auto()
    SUBTRACT = auto()
    MULTIPLY = auto()
    DIVIDE = auto()
    NEGATE = auto()
    LESS = auto()
    LESS_EQUAL = auto()
    EQUAL = auto()
    NOT_EQUAL = auto()
    SELECT = auto()
    """The second operand where the first is not zero, else the third."""
    MINIMUM = auto()
    MAXIMUM = auto()
    ABSOLUTE = auto()
    SQRT = auto()
    FLOOR = auto()
    CEIL = auto()
    TRUNC = auto()
    ROUND = auto()
    POWER = auto()
    FLOOR_DIVIDE = auto()
    MODULO = auto()
    FMOD = auto()
    HYPOT = auto()
    ATAN2 = auto()
    COPYSIGN = auto()
    EXP = auto()
    EXPM1 = auto()
    LOG = auto()
    LOG1P = auto()
    LOG2 = auto()
    LOG10 = auto()
    SIN = auto()
    COS = auto()
    TAN = auto()
    ASIN = auto()
    ACOS = auto()
    ATAN = auto()
    SINH = auto()
    COSH = auto()
    TANH = auto()
    ASINH = auto()
    ACOSH = auto()
    ATANH = auto()
    ERF = auto()
    ERFC = auto()
    ISFINITE = auto()
    ISNAN = auto()
    ISINF = auto()

    @property
    def operands(self) -> int:
        """How many values it takes."""
        if self is Op.SELECT:
            return 3
        return 2 if self in _TWO else 1


_COMPARISONS = (Op.LESS, Op.LESS_EQUAL, Op.EQUAL, Op.NOT_EQUAL)
_BOOLEAN = (*_COMPARISONS, Op.ISFINITE, Op.ISNAN, Op.ISINF)
_COMMUTE = (Op.ADD, Op.MULTIPLY, Op.EQUAL, Op.NOT_EQUAL)
_TWO = frozenset(
    {
        *(Op.ADD, Op.SUBTRACT, Op.MULTIPLY, Op.DIVIDE, *_COMPARISONS, Op.MINIMUM, Op.MAXIMUM, Op.POWER),
        *(Op.FLOOR_DIVIDE, Op.MODULO, Op.FMOD, Op.HYPOT, Op.ATAN2, Op.COPYSIGN),
    }
)


@dataclass(frozen=True, eq=False)
class Program:
    """A law's value as operations; see the module.  Two programs are equal where they do the same operations.

    code (n, 4): operation and its operands' numbers, those it does not take 0; constants (c,);
    arguments, parameters: how many come before the constants.

    Raises
    ------
    InputError
        Where the numbers are no program: an unknown operation, or an operand that comes later.
    """

    code: NDArray[np.int32]
    constants: NDArray[np.float64]
    arguments: int
    parameters: int

    def __post_init__(self) -> None:
        code = np.array(self.code, dtype=np.int32, order="C").reshape(-1, 4)
        constants = np.array(self.constants, dtype=np.float64).reshape(-1)
        first = self.arguments + self.parameters + len(constants)
        known = np.isin(code[:, 0], [int(op) for op in Op])
        earlier = (code[:, 1:] >= 0) & (code[:, 1:] < (first + np.arange(len(code)))[:, None])
        if not len(code) or not known.all() or not earlier.all():
            raise InputError("a program is a list of known operations, each on values before it, and has at least one")
        for name, array in (("code", code), ("constants", constants)):
            array.flags.writeable = False
            object.__setattr__(self, name, array)

    @property
    def first(self) -> int:
        """Number of the first operation's result."""
        return self.arguments + self.parameters + len(self.constants)

    @property
    def registers(self) -> int:
        """How many values there are in all."""
        return self.first + len(self.code)

    @property
    def result(self) -> int:
        """Number of the law's value: the last."""
        return self.registers - 1

    @cached_property
    def digest(self) -> str:
        """Hexadecimal digest of what it computes: equal for equal programs, on every machine."""
        head = struct.pack("<4q", self.arguments, self.parameters, len(self.constants), len(self.code))
        body = self.constants.astype("<f8").tobytes() + self.code.astype("<i4").tobytes()
        return hashlib.sha256(head + body).hexdigest()

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Program) and self.digest == other.digest

    def __hash__(self) -> int:
        return hash(self.digest)

    def __str__(self) -> str:
        """One operation a line, to read."""
        names = [f"x{i}" for i in range(self.arguments)] + [f"p{i}" for i in range(self.parameters)]
        names += [f"{c:.17g}" for c in self.constants] + [f"r{i}" for i in range(len(self.code))]
        lines = []
        for i, (number, *operands) in enumerate(self.code.tolist()):
            op = Op(number)
            lines.append(f"r{i} = {op.name.lower()} {', '.join(names[o] for o in operands[: op.operands])}")
        return "\n".join(lines)


@dataclass(frozen=True)
class Value:
    """A number known only when the program runs; ``boolean`` where it is 1 or 0."""

    index: int
    boolean: bool = False


Number = Value | float | int | bool
"""A value, or a number that is known already: kept as Python's own, so that it is computed with as Python would."""


class Builder:
    """Collects operations: the same one is done once, and what is known already is computed here.

    arguments, parameters: how many of each; `inputs` are their values.
    """

    def __init__(self, arguments: int, parameters: int) -> None:
        self.arguments, self.parameters = arguments, parameters
        self.inputs = tuple(Value(i) for i in range(arguments + parameters))
        self._rows: list[tuple[Any, ...]] = [("input", i) for i in range(len(self.inputs))]
        self._known: dict[tuple[Any, ...], int] = {}

    def __len__(self) -> int:
        return len(self._rows)

    def apply(self, op: Op, *operands: Number) -> Number:
        """The operation's result: a number where all operands are numbers and Python gives one, else a value."""
        if not any(isinstance(x, Value) for x in operands):
            known = _known(op, operands)
            if known is not None:
                return known
        shorter = _SHORTER.get(op)
        found = shorter(self, *operands) if shorter else None
        return self._emit(op, *operands) if found is None else found

    def finish(self, result: Number) -> Program:
        """The program whose value is ``result``, without the operations that do not enter it."""
        last = self._place(result)
        if self._rows[last][0] in ("input", "constant"):
            last = self._emit(Op.COPY, Value(last)).index
        used = {last}
        for index in range(last, -1, -1):
            row = self._rows[index]
            if index in used and row[0] not in ("input", "constant"):
                used.update(row[1:])
        constants = [i for i in sorted(used) if self._rows[i][0] == "constant"]
        rows = [i for i in sorted(used) if self._rows[i][0] not in ("input", "constant")]
        inputs = list(range(len(self.inputs)))
        number = {index: k for k, index in enumerate(inputs + constants + rows)}
        code = np.zeros((len(rows), 4), dtype=np.int32)
        for k, index in enumerate(rows):
            op, *operands = self._rows[index]
            code[k, 0] = op
            code[k, 1 : 1 + len(operands)] = [number[o] for o in operands]
        values = np.array([self._rows[i][1] for i in constants], dtype=np.float64)
        return Program(code, values, self.arguments, self.parameters)

    def _place(self, x: Number) -> int:
        if isinstance(x, Value):
            return x.index
        value = float(x)
        return self._row(("constant", struct.pack("<d", value)), ("constant", value))

    def _emit(self, op: Op, *operands: Number) -> Value:
        places = [self._place(x) for x in operands]
        if op in _COMMUTE:
            places.sort()
        row = (op, *places)
        boolean = op in _BOOLEAN or (op is Op.SELECT and all(_is_boolean(x) for x in operands[1:]))
        return Value(self._row(row, row), boolean)

    def _row(self, key: tuple[Any, ...], row: tuple[Any, ...]) -> int:
        if key not in self._known:
            self._known[key] = len(self._rows)
            self._rows.append(row)
        return self._known[key]


# What is known already, as Python computes it.


_PYTHON: dict[Op, Callable[..., Any]] = {
    Op.COPY: lambda x: x,
    Op.ADD: lambda a, b: a + b,
    Op.SUBTRACT: lambda a, b: a - b,
    Op.MULTIPLY: lambda a, b: a * b,
    Op.DIVIDE: lambda a, b: a / b,
    Op.NEGATE: lambda x: -x,
    Op.LESS: lambda a, b: a < b,
    Op.LESS_EQUAL: lambda a, b: a <= b,
    Op.EQUAL: lambda a, b: a == b,
    Op.NOT_EQUAL: lambda a, b: a != b,
    Op.SELECT: lambda c, a, b: a if c else b,
    Op.MINIMUM: min,
    Op.MAXIMUM: max,
    Op.ABSOLUTE: abs,
    Op.ROUND: round,
    Op.POWER: lambda a, b: a**b if abs(b) < 1000 else float(a) ** b,
    Op.FLOOR_DIVIDE: lambda a, b: a // b,
    Op.MODULO: lambda a, b: a % b,
} | {op: getattr(math, op.name.lower()) for op in Op if hasattr(math, op.name.lower())}


def _known(op: Op, operands: tuple[Number, ...]) -> float | int | None:
    try:
        found = _PYTHON[op](*operands)
    except (ArithmeticError, ValueError):  # Python raises where the program gives an infinity or NaN
        return None
    return found if isinstance(found, (int, float)) else None


def _is_boolean(x: Number) -> bool:
    return x.boolean if isinstance(x, Value) else isinstance(x, bool)


# Shorter ways to the same value.


def _is(x: Number, number: float) -> bool:
    return not isinstance(x, Value) and float(x) == number


def _multiplied(builder: Builder, a: Number, b: Number) -> Number | None:
    if _is(a, 1.0):
        return b
    return a if _is(b, 1.0) else None


def _divided(builder: Builder, a: Number, b: Number) -> Number | None:
    if isinstance(b, Value) or not math.isfinite(b) or b == 0:
        return None
    if b == 1:
        return a
    mantissa, exponent = math.frexp(b)
    exact = abs(mantissa) == 0.5 and abs(exponent) < 1000  # a power of two has an exact reciprocal
    return builder.apply(Op.MULTIPLY, a, 1.0 / b) if exact else None


LARGEST_POWER = 8
"""Whole powers up to this, and halves between, are products and roots: within 4 roundings of the exact power."""


def _raised(builder: Builder, base: Number, exponent: Number) -> Number | None:
    if isinstance(exponent, Value):
        return None
    if exponent == 0:
        return 1.0
    if exponent == 0.5:
        return builder.apply(Op.SQRT, base)
    whole = int(exponent) if math.isfinite(exponent) else LARGEST_POWER + 1
    if abs(whole) > LARGEST_POWER or abs(exponent - whole) not in (0, 0.5):
        return None
    if exponent < 0:
        return builder.apply(Op.DIVIDE, 1.0, builder.apply(Op.POWER, base, -exponent))
    if exponent != whole:
        return builder.apply(Op.MULTIPLY, builder.apply(Op.POWER, base, whole), builder.apply(Op.SQRT, base))
    result: Number | None = None
    square, rest = base, whole
    while rest:
        if rest % 2:
            result = square if result is None else builder.apply(Op.MULTIPLY, result, square)
        rest //= 2
        if rest:
            square = builder.apply(Op.MULTIPLY, square, square)
    return result


def _selected(builder: Builder, test: Number, then: Number, other: Number) -> Number | None:
    if not isinstance(test, Value):
        return then if test else other
    if then == other and type(then) is type(other):
        return then
    if then is True and other is False and test.boolean:
        return test
    return None


_SHORTER: dict[Op, Callable[..., Number | None]] = {
    Op.MULTIPLY: _multiplied,
    Op.DIVIDE: _divided,
    Op.POWER: _raised,
    Op.SELECT: _selected,
}
