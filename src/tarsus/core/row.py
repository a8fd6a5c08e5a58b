"""The values at the nodes of a step as one machine vector: a row of N floats, with arithmetic on all of them at once.

``load`` and ``store`` take the last axis of a C-contiguous array whose length there is N. Outside the compiler a row
is a numpy array. Numba unrolls loops over so few nodes before it would make vectors of them.
"""

from __future__ import annotations

import operator
from typing import Any

import numpy as np
from llvmlite import ir
from numba.core import cgutils, config, types
from numba.core.datamodel import models
from numba.core.datamodel.registry import register_default
from numba.core.typing.templates import ConcreteTemplate, infer_global, signature
from numba.extending import intrinsic, lower_builtin

from tarsus.core.nodes import N

_VECTOR = ir.VectorType(ir.DoubleType(), N)


class Row(types.Type):
    """Type of a row."""

    def __init__(self) -> None:
        super().__init__(name="Row")


row_type = Row()


@register_default(Row)
class _Model(models.PrimitiveModel):
    def __init__(self, manager: Any, type_: Any) -> None:
        super().__init__(manager, type_, _VECTOR)


def _spread(context: Any, builder: Any, value: Any, type_: Any) -> Any:
    """A row of one number."""
    if type_ == row_type:
        return value
    value = context.cast(builder, value, type_, types.float64)
    one = builder.insert_element(ir.Constant(_VECTOR, ir.Undefined), value, ir.Constant(ir.IntType(32), 0))
    return builder.shuffle_vector(one, one, ir.Constant(ir.VectorType(ir.IntType(32), N), [0] * N))


def _arithmetic(function: Any, instruction: str) -> None:
    numbers = (types.float64, types.int64)
    pairs = [(row_type, row_type), *((row_type, n) for n in numbers), *((n, row_type) for n in numbers)]

    class Template(ConcreteTemplate):
        cases = [signature(row_type, *pair) for pair in pairs]

    infer_global(function)(Template)  # type: ignore[reportOptionalCall]

    def lower(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        both = (_spread(context, builder, *pair) for pair in zip(args, sig.args, strict=True))
        return getattr(builder, instruction)(*both)

    for pair in pairs:
        lower_builtin(function, *pair)(lower)


for _function, _instruction in (
    (operator.add, "fadd"), (operator.iadd, "fadd"), (operator.sub, "fsub"), (operator.mul, "fmul"), (operator.truediv, "fdiv"),
):  # fmt: skip
    _arithmetic(_function, _instruction)


@infer_global(operator.neg)  # type: ignore[reportOptionalCall]
class _Negative(ConcreteTemplate):
    cases = [signature(row_type, row_type)]


@lower_builtin(operator.neg, row_type)
def _negative(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    return builder.fsub(ir.Constant(_VECTOR, [-0.0] * N), args[0])


def _place(context: Any, builder: Any, array_type: Any, array: Any, index_type: Any, index: Any) -> Any:
    """Address of a row of an array."""
    struct = context.make_array(array_type)(context, builder, array)
    lengths = cgutils.unpack_tuple(builder, struct.shape)
    offset = ir.Constant(ir.IntType(64), 0)
    for d, at in enumerate(cgutils.unpack_tuple(builder, index)):
        step = context.cast(builder, at, index_type.types[d], types.int64)
        offset = step if d == 0 else builder.add(builder.mul(offset, lengths[d]), step)
    place = builder.gep(struct.data, [builder.mul(offset, ir.Constant(ir.IntType(64), N))])
    return builder.bitcast(place, _VECTOR.as_pointer())


@intrinsic
def _load(typingctx, array, index):
    def generate(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        return builder.load(_place(context, builder, array, args[0], index, args[1]), align=8)

    return row_type(array, index), generate


@intrinsic
def _store(typingctx, array, index, row):
    def generate(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        builder.store(args[2], _place(context, builder, array, args[0], index, args[1]), align=8)
        return context.get_dummy_value()

    return types.void(array, index, row_type), generate


def _reduction(name: str, *first: Any) -> Any:
    @intrinsic
    def reduce(typingctx, row):
        def generate(context: Any, builder: Any, sig: Any, args: Any) -> Any:
            double = ir.DoubleType()
            kind = ir.FunctionType(double, [*(double for _ in first), _VECTOR])
            function = cgutils.get_or_insert_function(builder.module, kind, f"llvm.vector.reduce.{name}.v{N}f64")
            return builder.call(function, [*(ir.Constant(double, value) for value in first), args[0]], fastmath=("reassoc", "nsz"))

        return types.float64(row_type), generate

    return reduce


@intrinsic
def _magnitude(typingctx, row):
    def generate(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        kind = ir.FunctionType(_VECTOR, [_VECTOR])
        function = cgutils.get_or_insert_function(builder.module, kind, f"llvm.fabs.v{N}f64")
        return builder.call(function, args)

    return row_type(row_type), generate


def _plain(intrinsic_: Any, function: Any) -> Any:
    return function if config.DISABLE_JIT else intrinsic_


def _put(array: Any, index: Any, row: Any) -> None:
    array[index] = row


# Row of an array at a tuple of all indices but the last, and writing one there.
load = _plain(_load, lambda array, index: np.array(array[index]))
store = _plain(_store, _put)
# Sum of a row, its largest and its smallest number, and the row of its absolute values.
total = _plain(_reduction("fadd", -0.0), np.sum)
highest = _plain(_reduction("fmax"), np.max)
lowest = _plain(_reduction("fmin"), np.min)
magnitude = _plain(_magnitude, np.abs)
