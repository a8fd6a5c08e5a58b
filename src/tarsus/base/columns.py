"""Numbers of many runs side by side: one number, or one a run."""

from __future__ import annotations

from typing import Any

import numpy as np


def columns(values: Any) -> Any:
    """Numbers, or one number (nr,) a run, side by side as the last axis: (k,) or (nr, k)."""
    if not isinstance(values, (list, tuple)):
        return values
    if all(isinstance(one, (int, float)) for one in values):
        return np.array(values, dtype=np.float64)
    size = max((np.size(one) for one in values if np.ndim(one)), default=None)
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
