"""Arrays of numbers that carry their derivatives: what numpy makes of them has the derivatives of what it made.

A `Dual` is an array (...) with its derivatives (..., P) by P numbers. Functions written with numpy take one in place of
an array: sums, products, quotients, roots, sines, the larger or smaller of two, pieces of arrays put together. Orders
(<, >, sign) are those of the values; two numbers are equal where their derivatives are as well.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.lib.mixins import NDArrayOperatorsMixin
from numpy.typing import ArrayLike

from tarsus.base.arrays import Floats


class Dual(NDArrayOperatorsMixin):
    """value (...), slope (..., P)."""

    __slots__ = ("slope", "value")

    def __init__(self, value: ArrayLike, slope: Floats) -> None:
        self.value = np.asarray(value)
        self.slope = slope

    @property
    def shape(self) -> tuple[int, ...]:
        return self.value.shape

    @property
    def ndim(self) -> int:
        return self.value.ndim

    def __len__(self) -> int:
        return len(self.value)

    def __getitem__(self, key: Any) -> Dual:
        inside = key if isinstance(key, tuple) else (key,)
        whole = any(one is Ellipsis for one in inside)
        return Dual(self.value[key], self.slope[(*inside, slice(None))] if whole else self.slope[key])

    def reshape(self, *shape: int) -> Dual:
        value = self.value.reshape(*shape)
        return Dual(value, self.slope.reshape(*value.shape, self.slope.shape[-1]))

    def __array_ufunc__(self, function: Any, method: str, *given: Any, **options: Any) -> Any:
        if method != "__call__" or options:
            return NotImplemented
        values = [value_of(one) for one in given]
        out = function(*values)
        if function in (np.equal, np.not_equal):
            moved = (_slope(given[0], out.shape, self) != _slope(given[1], out.shape, self)).any(axis=-1)
            return out & ~moved if function is np.equal else out | moved
        if function not in _PARTIAL:
            return out  # signs, comparisons, whether a number is finite: of the values
        partials = _PARTIAL[function](*values, out)
        slope = np.zeros((*out.shape, self.slope.shape[-1]))
        for one, partial in zip(given, partials, strict=True):
            if isinstance(one, Dual):
                by = one.slope.reshape(*(1,) * (out.ndim - one.ndim), *one.slope.shape)
                slope += np.where(by != 0.0, np.asarray(partial)[..., None] * by, 0.0)
        return Dual(out, slope)

    def __array_function__(self, function: Any, types: Any, given: Any, options: Any) -> Any:
        return _FUNCTIONS[function](*given, **options)


_PARTIAL: dict[Any, Callable[..., tuple[Any, ...]]] = {
    np.add: lambda a, b, out: (1.0, 1.0),
    np.subtract: lambda a, b, out: (1.0, -1.0),
    np.multiply: lambda a, b, out: (b, a),
    np.true_divide: lambda a, b, out: (1.0 / b, -out / b),
    np.negative: lambda a, out: (-1.0,),
    np.absolute: lambda a, out: (np.sign(a),),
    np.square: lambda a, out: (2.0 * a,),
    np.sqrt: lambda a, out: (0.5 / out,),
    np.sin: lambda a, out: (np.cos(a),),
    np.remainder: lambda a, b, out: (1.0, -np.floor(a / b)),
    np.maximum: lambda a, b, out: (a >= b, a < b),
    np.minimum: lambda a, b, out: (a <= b, a > b),
}
"""Derivatives of a function by each argument, from these and what it made of them."""


def _both(function: Callable[..., Any]) -> Callable[..., Any]:
    """A function of one array along an axis, for its values and their derivatives alike."""

    def of(a: Dual, *given: Any, axis: int | None = None) -> Dual:
        at = {"axis": 0 if axis is None else axis % a.ndim}
        return Dual(function(a.value, *given, **at), function(a.slope, *given, **at))

    return of


def _joined(function: Callable[..., Any]) -> Callable[..., Any]:
    """The same of several."""

    def of(parts: Sequence[Any], axis: int = 0) -> Dual:
        like = next(one for one in parts if isinstance(one, Dual))
        dims = like.ndim + (function is np.stack)
        slopes = [_slope(one, np.shape(value_of(one)), like) for one in parts]
        return Dual(function([value_of(one) for one in parts], axis=axis), function(slopes, axis=axis % dims))

    return of


def _where(condition: Any, a: Any, b: Any) -> Dual:
    like = a if isinstance(a, Dual) else b
    value = np.where(condition, value_of(a), value_of(b))
    chosen = np.broadcast_to(condition, value.shape)[..., None]
    return Dual(value, np.where(chosen, _slope(a, value.shape, like), _slope(b, value.shape, like)))


_FUNCTIONS: dict[Any, Callable[..., Any]] = {
    np.concatenate: _joined(np.concatenate),
    np.stack: _joined(np.stack),
    np.where: _where,
    np.cumsum: _both(np.cumsum),
    np.roll: _both(np.roll),
    np.repeat: _both(np.repeat),
    np.broadcast_to: lambda a, shape: Dual(
        value := np.broadcast_to(a.value, shape), _slope(a, value.shape, a)
    ),
    np.shape: lambda a: a.shape,
    np.ndim: lambda a: a.ndim,
}


def value_of(a: Any) -> Any:
    """The numbers without their derivatives."""
    return a.value if isinstance(a, Dual) else np.asarray(a)


def slope_of(a: Any, count: int) -> Floats:
    """The derivatives (..., P) by ``count`` numbers, zero of what has none."""
    return a.slope if isinstance(a, Dual) else np.zeros((*np.shape(a), count))


def _slope(a: Any, shape: tuple[int, ...], like: Dual) -> Floats:
    """Derivatives of a where it is broadcast to a shape."""
    of = slope_of(a, like.slope.shape[-1])
    lifted = of.reshape(*(1,) * (len(shape) - of.ndim + 1), *of.shape)
    return np.broadcast_to(lifted, (*shape, of.shape[-1]))


def columns(values: Any) -> Any:
    """Numbers, or one number (nr,) a run, side by side as the last axis: (k,) or (nr, k)."""
    if not isinstance(values, (list, tuple)):
        return values
    if all(isinstance(one, (int, float)) for one in values):
        return np.array(values, dtype=np.float64)
    size = (
        max(np.size(value_of(one)) for one in values if np.ndim(one)) if any(map(np.ndim, values)) else None
    )
    if any(isinstance(one, Dual) for one in values):
        shape = () if size is None else (size,)
        return np.stack([np.broadcast_to(one, shape) for one in values], axis=-1)
    out = np.empty((len(values),) if size is None else (size, len(values)))
    for k, one in enumerate(values):
        out[..., k] = one
    return out


def alike(*values: Any) -> list[Any]:
    """Numbers, or one number (nr,) a run, all as (nr,)."""
    rows = columns(values)
    rows = rows if rows.ndim > 1 else rows[None]
    return [rows[:, k] for k in range(len(values))]


def dot(rows: Any, weights: Any) -> Any:
    """Sums (Q,) of the rows (Q, n) with weights (n,) or (Q, n), added in their order: the same bits however many
    rows."""
    total = np.zeros(len(rows))
    for k in range(rows.shape[1]):
        total = total + rows[:, k] * weights[..., k]
    return total
