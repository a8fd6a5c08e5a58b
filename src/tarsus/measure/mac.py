"""How alike two shapes are: the modal assurance criterion."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tarsus.base.errors import InputError


def mac(a: ArrayLike, b: ArrayLike) -> NDArray[np.float64]:
    """Modal assurance criterion (Allemang) of shapes: ``|a^H b|^2 / ((a^H a) (b^H b))``, from 0 to 1.

    Parameters
    ----------
    a
        One shape (n,), or several as columns (n, p); real or complex.
    b
        One shape (n,), or several as columns (n, q).

    Returns
    -------
    array
        (p, q); an axis whose side was one shape (n,) is dropped, so that two single shapes give an array ().

    Raises
    ------
    InputError
        If the shapes have different numbers of points, or one of them is zero or not finite.
    """
    left, right = np.asarray(a), np.asarray(b)
    if left.ndim not in (1, 2) or right.ndim not in (1, 2) or left.shape[0] != right.shape[0]:
        raise InputError(
            f"expected shapes at the same points, one or several as columns, got {left.shape} and {right.shape}"
        )
    columns = [side.reshape(len(side), -1) for side in (left, right)]
    squares = [np.sum(np.abs(side) ** 2, axis=0) for side in columns]
    if not all(np.isfinite(square).all() and np.all(square > 0.0) for square in squares):
        raise InputError("a shape that is zero everywhere, or not finite, has no direction to compare")
    values = np.abs(columns[0].conj().T @ columns[1]) ** 2 / np.outer(*squares)
    return values.reshape(left.shape[1:] + right.shape[1:])
