"""Linear algebra of small matrices with a fixed order of operations, for everything that decides an event.

LAPACK and BLAS choose their order of summation by the processor, so their results differ in the last bit from machine to
machine, and a motion with impacts makes another motion of it. Here every number comes from elementwise additions,
multiplications, divisions and square roots in an order that depends on the shapes alone: real results are the same bits
under every BLAS and on every processor with IEEE arithmetic. (Complex products of numpy may be fused on some processors;
only `eig` uses them.) Meant for structures of up to a hundred coordinates; matrices (n, n) and right sides may be complex
where it says so.
"""

from __future__ import annotations

from functools import reduce
from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = [
    "cholesky", "condition_of", "eig", "eigh", "inverse", "largest_of", "length", "modes_of", "product", "pseudoinverse",
    "rank_of", "solve", "svd",
]  # fmt: skip

Floats = NDArray[np.float64]
Array = NDArray[Any]

EPS = float(np.finfo(float).eps)
SWEEPS = 60
"""Sweeps of Jacobi's method at most: it converges quadratically, in six to ten."""
ROUNDS = 60
"""QR iterations at most for one eigenvalue, two to four on average; after each tenth an exceptional shift."""


def product(*factors: Array) -> Array:
    """``a @ b @ c ...`` from the left: of matrices (..., n, k), (k, m), and a vector (k,) as first or last of them; the terms of
    each entry are added in the order of k."""
    return reduce(_product, factors)


def _product(a: Array, b: Array) -> Array:
    if b.ndim == 1:
        return (a * b).sum(axis=-1)
    out = np.zeros((*a.shape[:-1], b.shape[1]), np.result_type(a, b))
    for column, row in zip(np.moveaxis(a, -1, 0), b, strict=True):
        out += column[..., None] * row
    return out


def length(a: Array) -> Any:
    """Euclidean lengths of the columns (n, m) -> (m,), or that of a vector."""
    return np.sqrt((a.real * a.real + a.imag * a.imag).sum(axis=0))


def solve(a: Array, b: Array) -> Array:
    """x with ``a x = b``, b (n,) or (n, m), both real or complex, by elimination with partial pivoting.

    Raises numpy's LinAlgError where a pivot is zero.
    """
    n = len(a)
    work = np.concatenate([a, b if b.ndim > 1 else b[:, None]], axis=1).astype(np.result_type(a, b, float))
    for k in range(n):
        best = k + int(np.argmax(np.abs(work[k:, k])))
        if work[best, k] == 0.0:
            raise np.linalg.LinAlgError("singular matrix")
        if best != k:
            work[[k, best]] = work[[best, k]]
        work[k + 1 :, k:] -= (work[k + 1 :, k] / work[k, k])[:, None] * work[k, k:]
    for k in reversed(range(n)):
        work[k, n:] /= work[k, k]
        work[:k, n:] -= work[:k, k, None] * work[k, n:]
    return work[:, n:].reshape(b.shape)


def inverse(a: Array) -> Array:
    """Inverse of a matrix, real or complex."""
    return solve(a, np.eye(len(a)))


def cholesky(a: Array) -> Array:
    """Lower triangle L with ``L L^T = a``, a symmetric and positive definite; raises numpy's LinAlgError where it is not."""
    left, out = np.array(a, dtype=np.result_type(a, float)), np.zeros_like(a, dtype=np.result_type(a, float))
    for k in range(len(a)):
        if not left[k, k].real > 0.0:
            raise np.linalg.LinAlgError("not positive definite")
        out[k:, k] = left[k:, k] / np.sqrt(left[k, k])
        left[k:, k:] -= out[k:, k, None] * out[k:, k]
    return out


def _rounds(n: int) -> list[tuple[NDArray[np.intp], NDArray[np.intp]]]:
    """Pairs of a sweep in rounds of disjoint pairs, each pair once: a tournament of n players."""
    players = [*range(n), *([-1] if n % 2 else [])]
    out = []
    for _ in range(len(players) - 1):
        half = len(players) // 2
        pairs = [
            tuple(sorted(pair))
            for pair in zip(players[:half], players[: -half - 1 : -1], strict=True)
            if min(pair) >= 0
        ]
        out.append(tuple(np.array(side, dtype=np.intp) for side in zip(*pairs, strict=True)))
        players = [players[0], players[-1], *players[1:-1]]
    return out  # pyright: ignore[reportReturnType]


def _rotation(p: Floats, q: Floats, between: Floats) -> tuple[Floats, Floats]:
    """Cosines and sines that make ``between`` zero in symmetric matrices [[p, between], [between, q]]."""
    tau = 0.5 * (q - p)
    size = np.abs(tau) + np.sqrt(tau * tau + between * between)
    tangent = np.where(tau < 0.0, -between, between) / np.where(size > 0.0, size, 1.0)
    cosine = 1.0 / np.sqrt(1.0 + tangent * tangent)
    return cosine, tangent * cosine


def _turn(a: Array, p: NDArray[np.intp], q: NDArray[np.intp], cosine: Floats, sine: Floats) -> None:
    """Turn pairs of columns in place."""
    first, second = a[:, p], a[:, q]
    a[:, p], a[:, q] = cosine * first - sine * second, sine * first + cosine * second


def eigh(a: Floats) -> tuple[Floats, Floats]:
    """Eigenvalues (n,), ascending, and orthonormal eigenvectors, the columns of (n, n), of a symmetric matrix.

    Jacobi's method: of a positive definite matrix that is scaled well small eigenvalues are as accurate as large ones
    (Demmel and Veselic 1992).
    """
    a, n = 0.5 * (a + a.T), len(a)
    vectors, rounds = np.eye(n), _rounds(n) if n > 1 else []
    floor = EPS * EPS * np.abs(a).max(initial=0.0)
    for _ in range(SWEEPS):
        turned = False
        for p, q in rounds:
            between = a[p, q]
            small = np.abs(between) <= np.maximum(EPS * np.sqrt(np.abs(a[p, p] * a[q, q])), floor)
            a[p, q] = a[q, p] = between = np.where(small, 0.0, between)
            if small.all():
                continue
            turned = True
            cosine, sine = _rotation(a[p, p], a[q, q], between)
            for part in (a, a.T, vectors):
                _turn(part, p, q, cosine, sine)
            a[p, q] = a[q, p] = 0.0
        if not turned:
            break
    order = np.argsort(a.diagonal(), kind="stable")
    return a.diagonal()[order], vectors[:, order]


def svd(a: Floats) -> tuple[Floats, Floats]:
    """Singular values (n,), descending, and right singular vectors, the columns of (n, n), of a matrix (m, n).

    Columns of ``a`` are turned until they are orthogonal (Hestenes): ``product(a, v)`` has the singular values as lengths, and
    the last columns of v span what a does not see.
    """
    a, n = np.array(a, dtype=float), a.shape[1]
    vectors, rounds = np.eye(n), _rounds(n) if n > 1 else []
    for _ in range(SWEEPS):
        turned = False
        for p, q in rounds:
            both, squares = (a[:, p] * a[:, q]).sum(axis=0), (a * a).sum(axis=0)
            small = np.abs(both) <= EPS * np.maximum(squares[p], squares[q])  # turns by less than rounding
            if small.all():
                continue
            turned = True
            cosine, sine = _rotation(squares[p], squares[q], np.where(small, 0.0, both))
            for part in (a, vectors):
                _turn(part, p, q, cosine, sine)
        if not turned:
            break
    sizes = length(a)
    order = np.argsort(-sizes, kind="stable")
    return sizes[order], vectors[:, order]


def pseudoinverse(a: Floats, least: float | None = None) -> Floats:
    """Pseudoinverse (n, m) of a matrix (m, n); singular values below ``least`` times the largest, rounding unless given,
    count as zero."""
    sizes, vectors = svd(a)
    rank = rank_of(a, least, sizes)
    sizes, vectors = sizes[:rank], vectors[:, :rank]
    return product(vectors / sizes, (product(a, vectors) / sizes).T)


def rank_of(a: Floats, least: float | None = None, sizes: Floats | None = None) -> int:
    """Rank of a matrix (m, n): singular values above ``least`` times the largest, the rounding of its entries unless given;
    sizes: its singular values, where they are known."""
    sizes = svd(a)[0] if sizes is None else sizes
    return int((sizes > (EPS * max(a.shape) if least is None else least) * sizes.max(initial=0.0)).sum())


def condition_of(a: Floats) -> float:
    """Largest over smallest singular value of a square matrix; infinite where it is singular."""
    sizes = svd(a)[0]
    return float(sizes[0] / sizes[-1]) if sizes[-1] > 0.0 else float("inf")


def modes_of(mass: Floats, stiffness: Floats) -> tuple[Floats, Floats]:
    """Squared angular frequencies (n,) [1/s^2], ascending, and shapes (n, n), columns P with P^T M P = 1, of a mass matrix and
    the symmetric part of a stiffness matrix. Raises numpy's LinAlgError where the mass is not positive definite."""
    root = inverse(cholesky(mass))
    squared, vectors = eigh(product(root, stiffness, root.T))
    return squared, product(root.T, vectors)


def eig(a: Floats) -> tuple[Array, Array]:
    """Eigenvalues (n,) and eigenvectors of length one, the columns of (n, n), of a real matrix; complex.

    Values that are not real are exact conjugates, in pairs; the largest entry of a vector is real and positive. Balanced by powers of two, then unshifted to a Hessenberg matrix by Householder's reflections and to a triangle by QR
    steps with Wilkinson's shift; the vectors from the triangle.
    """
    n = len(a)
    a, scale = _balanced(a)
    h, basis = _hessenberg(a.astype(complex))
    _triangle(h, basis)
    values, vectors = _paired(h.diagonal()), np.eye(n, dtype=complex)
    least = EPS * max(float(np.abs(h).max(initial=0.0)), np.finfo(float).tiny / EPS)
    for k in range(n):
        for i in reversed(range(k)):
            gap = values[k] - values[i]
            rest = (h[i, i + 1 : k + 1] * vectors[i + 1 : k + 1, k]).sum()
            vectors[i, k] = rest / (gap if abs(gap) > least else least)
    vectors = scale[:, None] * product(basis, vectors)
    vectors /= length(vectors)
    largest = vectors[np.abs(vectors).argmax(axis=0), np.arange(n)]
    return values, vectors * (largest.conj() / np.abs(largest))


def _paired(values: Array) -> Array:
    """Eigenvalues of a real matrix: each the mean of itself and of the conjugate of its nearest partner, which is itself where
    it is real."""
    out, left = values.copy(), list(np.argsort(-np.abs(values.imag), kind="stable"))
    while left:
        one = left.pop(0)
        near = min([one, *left], key=lambda other: abs(values[one].conjugate() - values[other]))
        out[one] = 0.5 * (values[one] + values[near].conjugate())
        if near != one:
            out[near] = out[one].conjugate()
            left.remove(near)
    return out


def largest_of(a: Floats) -> float:
    """Size of the largest eigenvalue of a matrix, to some per cent, by the power method."""
    x = 1.0 + np.arange(len(a)) % 3  # no motion of a regular structure is orthogonal to it
    size = 0.0
    for _ in range(40):
        x = product(a, x)
        size = float(np.abs(x).max(initial=0.0))
        if size == 0.0:
            break
        x /= size
    return size


def _balanced(a: Array) -> tuple[Array, Floats]:
    """D^-1 a D with rows and columns of comparable size, and the powers of two D (n,)."""
    a, scale = np.array(a), np.ones(len(a))
    for _ in range(20):
        size = np.abs(a)
        np.fill_diagonal(size, 0.0)
        column, row = size.sum(axis=0), size.sum(axis=1)
        changed = False
        for i in np.flatnonzero((column > 0.0) & (row > 0.0)):
            factor = 2.0 ** np.round(0.5 * np.log2(row[i] / column[i]))
            if factor * column[i] + row[i] / factor < 0.95 * (column[i] + row[i]):
                a[:, i] *= factor
                a[i] /= factor
                scale[i] *= factor
                size = np.abs(a)
                np.fill_diagonal(size, 0.0)
                column, row = size.sum(axis=0), size.sum(axis=1)
                changed = True
        if not changed:
            break
    return a, scale


def _hessenberg(h: Array) -> tuple[Array, Array]:
    """The similar matrix without entries below its first subdiagonal, and the unitary basis."""
    n = len(h)
    basis = np.eye(n, dtype=complex)
    for k in range(n - 2):
        mirror = h[k + 1 :, k].copy()
        size = length(mirror)
        if length(mirror[1:]) == 0.0:
            continue
        mirror[0] += size * (mirror[0] / abs(mirror[0]) if mirror[0] != 0.0 else 1.0)
        mirror /= length(mirror)
        h[k + 1 :] -= 2.0 * mirror[:, None] * product(mirror.conj(), h[k + 1 :])
        for part in (h, basis):
            part[:, k + 1 :] -= 2.0 * product(part[:, k + 1 :], mirror)[:, None] * mirror.conj()
        h[k + 2 :, k] = 0.0
    return h, basis


def _triangle(h: Array, basis: Array) -> None:
    """Turn a Hessenberg matrix (n, n) into a triangle in place, and the basis with it."""
    high, rounds = len(h) - 1, 0
    while high > 0:
        low = high
        while low > 0:
            beside = abs(h[low, low]) + abs(h[low - 1, low - 1])
            if abs(h[low, low - 1]) <= EPS * (beside or float(np.abs(h).max())):
                h[low, low - 1] = 0.0
                break
            low -= 1
        if low == high:
            high, rounds = high - 1, 0
            continue
        rounds += 1
        if rounds > ROUNDS:
            raise np.linalg.LinAlgError("eigenvalues did not converge")
        _qr_step(h, basis, low, high, _shift(h, high, rounds))


def _shift(h: Array, high: int, rounds: int) -> complex:
    """The eigenvalue of the last two rows that is nearer to the last entry; at times something else, against cycles."""
    a, b, c, d = h[high - 1, high - 1], h[high - 1, high], h[high, high - 1], h[high, high]
    if rounds % 10 == 0:
        return d + abs(c)
    half = 0.5 * (a - d)
    root = np.sqrt(half * half + b * c)
    below = half + root if abs(half + root) >= abs(half - root) else half - root
    return d - b * c / below if below != 0.0 else d


def _qr_step(h: Array, basis: Array, low: int, high: int, shift: complex) -> None:
    """One QR step on rows low to high of a Hessenberg matrix."""
    turns = []
    for k in range(low, high + 1):
        h[k, k] -= shift
    for k in range(low, high):
        x, y = h[k, k], h[k + 1, k]
        size = np.sqrt(x.real * x.real + x.imag * x.imag + y.real * y.real + y.imag * y.imag)
        c, s = (x / size, y / size) if size > 0.0 else (1.0 + 0.0j, 0.0j)
        above, under = h[k, k:].copy(), h[k + 1, k:]
        h[k, k:], h[k + 1, k:] = c.conjugate() * above + s.conjugate() * under, -s * above + c * under
        h[k + 1, k] = 0.0
        turns.append((c, s))
    for k, (c, s) in zip(range(low, high), turns, strict=True):
        for part, end in ((h, k + 2), (basis, len(basis))):
            left, right = part[:end, k].copy(), part[:end, k + 1]
            part[:end, k], part[:end, k + 1] = (
                left * c + right * s,
                -left * s.conjugate() + right * c.conjugate(),
            )
    for k in range(low, high + 1):
        h[k, k] += shift
