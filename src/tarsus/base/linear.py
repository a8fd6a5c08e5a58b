"""Linear algebra of small matrices with a fixed order of operations, for everything that decides an event.

LAPACK and BLAS choose their order of summation by the processor: their results differ in the last bit from machine to
machine, and a motion with impacts makes another motion of it. Here every number comes from additions, multiplications,
divisions and square roots in an order that depends on the shapes alone (`native/linear.cpp`, compiled without fused
operations): the same bits everywhere. Meant for structures of up to a hundred coordinates.
"""

from __future__ import annotations

from functools import reduce
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tarsus.base import _linear
from tarsus.base.arrays import Floats

Array = NDArray[Any]

EPS = float(np.finfo(float).eps)


def product(*factors: Array) -> Array:
    """``a @ b @ c ...`` from the left, real or complex: of matrices (..., n, k), (k, m), and a vector (k,) as first or
    last of them; the terms of each entry are added in the order of k."""
    return reduce(_product, factors)


def _product(a: Array, b: Array) -> Any:
    complex_ = a.dtype.kind == "c" or b.dtype.kind == "c"
    multiply: Any = _linear.complex_product if complex_ else _linear.product
    kind: Any = np.complex128 if complex_ else np.float64
    out = multiply(np.ascontiguousarray(a, kind), np.ascontiguousarray(b, kind))
    return out if a.ndim + b.ndim > 2 else kind(out)


def _typed(real: Any, complex_: Any, *arrays: Array) -> tuple[Any, list[Array]]:
    """The function for the kind of numbers in these arrays, and them as it takes them."""
    if any(np.iscomplexobj(one) for one in arrays):
        return complex_, [np.ascontiguousarray(one, np.complex128) for one in arrays]
    return real, [np.ascontiguousarray(one, np.float64) for one in arrays]


def length(a: Array) -> Any:
    """Euclidean lengths of the columns (n, m) -> (m,), or that of a vector."""
    real, imag = np.real(a), np.imag(a)
    return np.sqrt((real * real + imag * imag).sum(axis=0))


def solve(a: Array, b: Array) -> Array:
    """x with ``a x = b``, b (n,) or (n, m), both real or complex, by elimination with partial pivoting.

    Raises numpy's LinAlgError where a pivot is zero.
    """
    find, (matrix, right) = _typed(_linear.solve, _linear.complex_solve, a, b)
    found = find(matrix, right if b.ndim == 2 else right[:, None])
    if found is None:
        raise np.linalg.LinAlgError("singular matrix")
    return found.reshape(b.shape)


def inverse(a: Array) -> Array:
    """Inverse of a matrix, real or complex."""
    return solve(a, np.eye(len(a)))


def cholesky(a: Array) -> Array:
    """Lower triangle L with ``L L^T = a``, a symmetric; raises numpy's LinAlgError unless it is positive definite."""
    left, out = np.array(a, dtype=np.result_type(a, float)), np.zeros_like(a, dtype=np.result_type(a, float))
    for k in range(len(a)):
        if not left[k, k].real > 0.0:
            raise np.linalg.LinAlgError("not positive definite")
        out[k:, k] = left[k:, k] / np.sqrt(left[k, k])
        left[k:, k:] -= out[k:, k, None] * out[k:, k]
    return out


def eigh(a: Floats) -> tuple[Floats, Floats]:
    """Eigenvalues (n,), ascending, and orthonormal eigenvectors, columns of (n, n), of the symmetric part of a matrix.

    Jacobi's method: of a positive definite matrix that is scaled well small eigenvalues are as accurate as large ones
    (Demmel and Veselic 1992).
    """
    return _linear.eigh(np.ascontiguousarray(a, np.float64))


def svd(a: Floats) -> tuple[Floats, Floats]:
    """Singular values (n,), descending, and right singular vectors, the columns of (n, n), of a matrix (m, n).

    Columns of ``a`` are turned until they are orthogonal (Hestenes): those of ``product(a, v)`` are as long as the
    singular values, and the last columns of v span what a does not see.
    """
    return _linear.svd(np.ascontiguousarray(a, np.float64))


def eig(a: Floats) -> tuple[Array, Array]:
    """Eigenvalues (n,) and eigenvectors of length one, the columns of (n, n), of a real matrix; complex.

    Values that are not real are exact conjugates, in pairs; the largest entry of a vector is real and positive.
    Balanced by powers of two, brought to a Hessenberg matrix by Householder's reflections and to a triangle by QR steps
    with Wilkinson's shift; the vectors from the triangle. Raises numpy's LinAlgError where that does not converge.
    """
    found: Any = _linear.eig(np.ascontiguousarray(a, np.float64))
    if found is None:
        raise np.linalg.LinAlgError("eigenvalues did not converge")
    return found


def pseudoinverse(a: Floats, least: float | None = None) -> Floats:
    """Pseudoinverse (n, m) of a matrix (m, n); singular values below ``least`` times the largest, or rounding, are
    zero."""
    sizes, vectors = svd(a)
    rank = rank_of(a, least, sizes)
    sizes, vectors = sizes[:rank], vectors[:, :rank]
    return product(vectors / sizes, (product(a, vectors) / sizes).T)


def rank_of(a: Floats, least: float | None = None, sizes: Floats | None = None) -> int:
    """Rank of a matrix (m, n): singular values above ``least`` times the largest, or above the rounding of its entries;
    sizes: its singular values, where they are known."""
    sizes = svd(a)[0] if sizes is None else sizes
    return int((sizes > (EPS * max(a.shape) if least is None else least) * sizes.max(initial=0.0)).sum())


def condition_of(a: Floats) -> float:
    """Largest over smallest singular value of a square matrix; infinite where it is singular."""
    sizes = svd(a)[0]
    return float(sizes[0] / sizes[-1]) if sizes[-1] > 0.0 else float("inf")


def modes_of(mass: Floats, stiffness: Floats) -> tuple[Floats, Floats]:
    """Squared angular frequencies (n,) [1/s^2], ascending, and shapes (n, n), columns P with P^T M P = 1, of a mass
    matrix and the symmetric part of a stiffness matrix. Raises numpy's LinAlgError unless that is positive definite.
    """
    root = inverse(cholesky(mass))
    squared, vectors = eigh(product(root, stiffness, root.T))
    return squared, product(root.T, vectors)


def largest_of(a: Floats) -> float:
    """Size of the largest eigenvalue of a matrix, to some per cent, by the power method."""
    return _linear.largest_of(np.ascontiguousarray(a, np.float64))
