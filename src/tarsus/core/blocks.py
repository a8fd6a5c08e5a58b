"""Real block-diagonal form of x' = A x: 2 x 2 blocks, one a mode, in a fixed order of operations.

A mode may be underdamped (a complex pair), overdamped (two real eigenvalues), critically damped or a rigid body
(a defective pair, double zero): all are general real 2 x 2 blocks here, whose exponential has a closed form
(native/base/matrix2.hpp).
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from tarsus.base.linear import EPS, cholesky, condition_of, eig, eigh, inverse, length, product, solve, svd

Floats = NDArray[np.float64]


class DefectiveStructureError(ValueError):
    """The structure has coinciding modes that cannot be separated; the message says which."""


def split_modes(mass: Floats, damping: Floats, stiffness: Floats) -> tuple[Floats, Floats]:
    """Blocks and basis of M q'' + C q' + K q = 0.

    Parameters: mass, damping, stiffness (n, n), mass symmetric positive definite.
    Returns: blocks (n, 2, 2) and basis V (2n, 2n) with [q; q'] = V [y1; y2], y' = diag(blocks) y,
    where column r of the first half and column r of the second half belong to block r.
    Raises DefectiveStructureError where coinciding modes cannot be separated.
    """
    n = mass.shape[0]
    if n == 0:
        return np.zeros((0, 2, 2)), np.zeros((0, 0))
    root = inverse(cholesky(mass))
    k, c = (product(root, part, root.T) for part in (stiffness, damping))
    if np.abs(k - k.T).max() <= 1e-10 * max(np.abs(k).max(), 1e-300):
        square, u = eigh(k)
        modal_c = product(u.T, c, u)
        rates = modal_c.diagonal()
        if np.abs(modal_c - np.diag(rates)).max() <= 1e-12 * max(np.abs(modal_c).max(), 1e-300):
            # rigid and undamped is what is below the rounding of its own terms: a soft mode of a structure with a very stiff one is not
            sizes = np.abs(u)
            stiff, damped = (1e-14 * n * (sizes * product(np.abs(part), sizes)).sum(axis=0) for part in (k, c))
            square, rates = (
                np.where(np.abs(square) <= stiff, 0.0, square),
                np.where(np.abs(rates) <= damped, 0.0, rates),
            )
            return _classical(*_slow_again(square, rates, product(root.T, u), (mass, damping, stiffness)))
    return _general(mass, damping, stiffness)


def _slow_again(
    square: Floats, rates: Floats, shapes: Floats, pencil: tuple[Floats, ...]
) -> tuple[Floats, Floats, Floats]:
    """Squares, rates and shapes (n, n) of modes, those that are slow compared with the fastest by what no fast one hides: they are
    the largest of K^-1 M, in coordinates that are each counted by its own stiffness."""
    slow = square < SLOW**2 * square.max(initial=0.0)
    mass, damping, stiffness = pencil
    if not slow.any() or square.min() <= 0.0 or stiffness.diagonal().min() <= 0.0:
        return (
            square,
            rates,
            shapes,
        )  # a motion without a stiffness would be found as the slowest of all, by its rounding
    unit = 1.0 / np.sqrt(stiffness.diagonal())
    try:
        root = inverse(cholesky(unit[:, None] * stiffness * unit))
    except np.linalg.LinAlgError:  # motions without a stiffness
        return square, rates, shapes
    root = root * unit
    squares, u = eigh(product(root, mass, root.T))  # of periods
    kept = np.argsort(-squares, kind="stable")[: slow.sum()]
    square, rates, shapes = square.copy(), rates.copy(), shapes.copy()
    square[slow] = 1.0 / squares[kept]
    shapes[:, slow] = product(root.T, u[:, kept]) / np.sqrt(squares[kept])
    rates[slow] = (shapes[:, slow] * product(damping, shapes[:, slow])).sum(axis=0)
    return square, rates, shapes


def _classical(square: Floats, rate: Floats, shapes: Floats) -> tuple[Floats, Floats]:
    """Modal damping: q_r'' + rate_r q_r' + square_r q_r = 0, each in a well-scaled real basis."""
    n = len(square)
    blocks = np.zeros((n, 2, 2))
    basis = np.zeros((2 * n, 2 * n))
    for r in range(n):
        sigma = -0.5 * rate[r]
        disc = sigma * sigma - square[r]
        if disc < 0.0 and -disc > 1e-6 * square[r]:
            omega = np.sqrt(-disc)  # q = y1, q' = sigma y1 + omega y2: a scaled rotation
            blocks[r] = [[sigma, omega], [-omega, sigma]]
            second = (sigma, omega)
        else:  # overdamped, near critical or rigid: companion form, scaled to comparable sizes
            w = max(np.sqrt(abs(square[r])), abs(rate[r]), 0.0) or 1.0
            blocks[r] = [[0.0, w], [-square[r] / w, -rate[r]]]
            second = (0.0, w)
        basis[:n, r] = shapes[:, r]
        basis[n:, r] = shapes[:, r] * second[0]
        basis[n:, n + r] = shapes[:, r] * second[1]
    return blocks, basis


def _general(mass: Floats, damping: Floats, stiffness: Floats) -> tuple[Floats, Floats]:
    """General damping: invariant planes of the state matrix, rigid-body chains split off first."""
    n = mass.shape[0]
    per_mass = solve(mass, np.hstack([stiffness, damping]))
    state = np.zeros((2 * n, 2 * n))
    state[:n, n:] = np.eye(n)
    state[n:, :n] = -per_mass[:, :n]
    state[n:, n:] = -per_mass[:, n:]
    # Balance displacement against velocity so that both halves have comparable size.
    w = np.sqrt(max(np.abs(per_mass[:, :n]).max(), 1e-300))
    scale = np.concatenate([np.ones(n), np.full(n, w)])
    state = state * scale[None, :] / scale[:, None]
    rigid = _rigid_motions(stiffness, damping)
    pencil = (mass, damping, stiffness)
    try:
        planes = _rigid_planes(rigid, w) + _elastic_planes(state, rigid, pencil, w)
    except np.linalg.LinAlgError:  # an elastic motion rests, too: they are found together
        planes = _planes(state, pencil, w)
    basis = np.zeros((2 * n, 2 * n))
    blocks = np.zeros((n, 2, 2))
    apart = np.hstack([_orthonormal(pair)[0] for pair, _ in planes])
    for r, (pair, block) in enumerate(planes):
        basis[:, r], basis[:, n + r] = pair[:, 0], pair[:, 1]
        blocks[r] = block
    off = max((np.abs(product(state, p) - product(p, b)).max() / np.abs(p).max() for p, b in planes), default=0.0)
    if len(planes) != n or condition_of(apart) > 1e9 or off > MISSED * np.abs(state).max():
        raise DefectiveStructureError(
            "two or more modes of the damped structure coincide and cannot be separated; "
            "change one damping value slightly (1e-6 relative is enough) or give modal damping"
        )
    return blocks, basis * scale[:, None]


def _rigid_motions(stiffness: Floats, damping: Floats) -> Floats:
    """Motions (n, nr) that meet no force of springs and dampers."""
    both = np.vstack([stiffness / max(np.abs(stiffness).max(), 1e-300), damping / max(np.abs(damping).max(), 1e-300)])
    sizes, ways = svd(both)
    return ways[:, sizes <= 1e-12]


def _rigid_planes(rigid: Floats, w: float) -> list[tuple[Floats, Floats]]:
    """Their planes (2n, 2), displacement and velocity, and the block on each."""
    n, planes = len(rigid), []
    for way in rigid.T:
        pair = np.zeros((2 * n, 2))
        pair[:n, 0] = pair[n:, 1] = way
        planes.append((pair, np.array([[0.0, w], [0.0, 0.0]])))
    return planes


def _elastic_planes(state: Floats, rigid: Floats, pencil: tuple[Floats, ...], w: float) -> list[tuple[Floats, Floats]]:
    """The other planes of a state matrix and its block on each, of motions mass-orthogonal to the rigid ones.

    What these exert on the rigid motions, as dampers may that take from one side alone, moves them along: of the state
    A [R L] = [R L] [[J, X], [0, E]], with R the rigid and L the elastic motions, a plane P of E with the block B is
    one of A as L P + R Z, where J Z + X P = Z B and J J = 0.
    """
    n, count = rigid.shape
    if count == n:
        return []
    elastic = np.eye(n) if count == 0 else svd(product(rigid.T, pencil[0]))[1][:, count:]
    lift = np.kron(np.eye(2), elastic)
    reduced = tuple(product(elastic.T, part, elastic) for part in pencil)
    forces = [product(rigid.T, part) / max(np.abs(part).max(), 1e-300) for part in pencil[1:]]
    if np.abs(forces).max(initial=0.0) <= 1e-10:
        return [(product(lift, pair), block) for pair, block in _planes(product(lift.T, state, lift), reduced, w)]
    base = np.kron(np.eye(2), rigid)
    parts = solve(np.hstack([base, lift]), product(state, lift))
    onto, rest = parts[: 2 * count], parts[2 * count :]
    chain = np.kron(np.array([[0.0, w], [0.0, 0.0]]), np.eye(count))
    planes = []
    for pair, block in _planes(rest, reduced, w):
        once = solve(block.T, product(onto, pair).T).T
        along = once + product(chain, solve(block.T, once.T).T)
        planes.append((product(lift, pair) + product(base, along), block))
    return planes


MISSED = 1e-7
"""Part of the state matrix by which a plane may fail to be one of its own: the root of rounding, to which two coinciding
modes are known. More is a motion of another structure."""

SLOW = 1e-3
"""Eigenvalues below this part of the largest are found again one by one: the state matrix knows them to 1e-16 of the
largest only, and the slow rates of a structure damped by ratios of 1e4 lie 1e9 below its fast ones."""


def _planes(state: Floats, pencil: tuple[Floats, ...], w: float) -> list[tuple[Floats, Floats]]:
    """Invariant planes (2n, 2) of a state matrix and its block on each; pencil: M, C, K, and w its unit of velocity."""
    values, vectors = eig(state)
    scale = np.abs(values).max()
    known = np.full(len(values), scale)  # what the rounding of each goes by
    for r in np.flatnonzero(np.abs(values) < SLOW * scale):
        value, vector = _refined(values[r], pencil, w)
        if abs(value - values[r]) > 1e-10 * scale:
            value, vector = _alone(values[r], np.delete(values, r), pencil, w)
            if not abs(value - values[r]) < 1e-7 * scale:
                continue  # two that coincide: the state matrix knows these to the root of its rounding only
        values[r], vectors[:, r], known[r] = value, vector, max(abs(value), 1e-16 * scale)
    real = np.abs(values.imag) <= 1e-7 * known
    planes = []
    for r in np.flatnonzero(values.imag > 1e-7 * known):
        a, b = values[r].real, values[r].imag
        pair = np.stack([vectors[:, r].real, vectors[:, r].imag], axis=1)
        planes.append((pair, np.array([[a, b], [-b, a]])))
    order = np.flatnonzero(real)[np.argsort(values[real].real)]
    if len(order) % 2:
        raise DefectiveStructureError(
            "a mode of the damped structure lies on the edge of overdamping; change one damping value slightly"
        )
    for first, second in zip(order[::2], order[1::2], strict=True):
        close = values[[second, first]].real  # the slower one first: its vector is the first of the plane
        own_scale = np.ones(len(state))
        if _known_apart(close, vectors[: len(state) // 2, [second, first]].real, pencil):
            # velocities count by the pair's own rate: by a much faster one the two vectors would hardly differ
            own_scale[len(state) // 2 :] = w / min(np.abs(close).max(), w)
        tall = vectors[:, [second, first]].real * own_scale[:, None]
        pair, own = _orthonormal(tall / length(tall))
        if abs(own[1, 1]) > 1e-4:
            block = [[close[0], (close[1] - close[0]) * own[0, 1] / own[1, 1]], [0.0, close[1]]]
            planes.append((pair / own_scale[:, None], np.array(block)))
            continue
        # An orthonormal basis of the plane is well conditioned even where the two nearly coincide.
        pair = svd(product(*(state - rate * np.eye(len(state)) for rate in close)))[1][:, -2:]
        planes.append((pair, product(pair.T, state, pair)))
    return planes


def _known_apart(rates: Floats, shapes: Floats, pencil: tuple[Floats, ...]) -> bool:
    """Whether two real rates are those of s^2 M + s C + K, and not what rounding leaves of a double zero: of its terms at
    the pair's own rate nothing is left for either shape, of columns (n, 2)."""
    mass, damping, stiffness = pencil
    fastest = np.abs(rates).max()
    inert, damped, sprung = (product(part, shapes) for part in (mass, damping, stiffness))
    left = inert * rates**2 + damped * rates + sprung
    size = fastest**2 * np.abs(inert).max(axis=0) + fastest * np.abs(damped).max(axis=0)
    return bool((np.abs(left).max(axis=0) < 1e-6 * size).all())


def _own_units(value: complex, mass: Floats, stiffness: Floats, w: float) -> Floats:
    """Units (n,) of the coordinates in which the terms of s^2 M + s C + K are of one size; of one that has none, where
    a motion at rest has no stiffness, by the rate w."""
    inert = mass.diagonal()
    size = np.abs(stiffness.diagonal()) + abs(value) ** 2 * inert
    return 1.0 / np.sqrt(np.where(size > 0.0, size, w * w * inert))


def _refined(value: complex, pencil: tuple[Floats, ...], w: float) -> tuple[complex, NDArray[np.complex128]]:
    """An eigenvalue of M q'' + C q' + K q = 0 by Newton's method on the pencil itself, and its vector [q; q' / w].

    There nothing fast hides a slow rate: s^2 M + s C + K has terms of the size of K, and of each coordinate those of its
    own K by the unit in which it is counted.
    """
    unit = _own_units(value, pencil[0], pencil[2], w)
    mass, damping, stiffness = (unit[:, None] * part * unit for part in pencil)
    for _ in range(4):
        matrix = value * value * mass + value * damping + stiffness
        left, right = _least_moved(matrix.T), _least_moved(matrix)
        slope = product(left, 2.0 * value * mass + damping, right)
        if slope == 0.0:
            break
        change = product(left, matrix, right) / slope
        value = complex(value - change)
        if abs(change) <= 1e-15 * abs(value):
            break
    return value, _with_velocity(value, unit * right, w)


def _with_velocity(value: complex, shape: NDArray[np.complex128], w: float) -> NDArray[np.complex128]:
    """[q; q' / w] of a motion at an eigenvalue, of length one."""
    vector = np.concatenate([shape, value / w * shape])
    return vector / length(vector)


def _alone(
    value: complex, others: NDArray[np.complex128], pencil: tuple[Floats, ...], w: float
) -> tuple[complex, NDArray[np.complex128]]:
    """As `_refined`, with the other eigenvalues divided out (Aberth's method): next to a rate some 1e10 times less than
    the fastest, a rate of zero is found as zero. NaN where it does not converge."""
    nearest, fastest = np.abs(others).min(), np.abs(others).max()
    unit = _own_units(value, pencil[0], pencil[2], min(nearest, w))
    mass, damping, stiffness = (unit[:, None] * part * unit for part in pencil)
    none = 1e-16 * fastest  # what is left of a rate of zero
    for _ in range(20):
        matrix, apart = value * value * mass + value * damping + stiffness, value - others
        if not apart.all():
            break
        try:
            steep = np.trace(solve(matrix, 2.0 * value * mass + damping + 0.0j))  # slope of the determinant, over it
        except np.linalg.LinAlgError:  # singular to the last bit
            return value, _with_velocity(value, unit * _least_moved(matrix + 0.0j), w)
        steep -= (1.0 / apart).sum()
        if steep == 0.0:
            break
        value = complex(value - 1.0 / steep)
        if 1e-12 * max(abs(value), none) * abs(steep) >= 1.0:
            matrix = value * value * mass + value * damping + stiffness
            return value, _with_velocity(value, unit * _least_moved(matrix + 0.0j), w)
    return complex(math.nan), np.zeros(2 * len(unit), dtype=complex)


def _least_moved(matrix: NDArray[np.complex128]) -> NDArray[np.complex128]:
    """A vector (n,) of length one that a matrix all but takes to zero: three steps of inverse iteration."""
    vector = 1.0 + np.arange(len(matrix)) % 3 + 0.0j
    pivot = (
        4.0 * EPS * np.abs(matrix).max()
    )  # where the matrix is singular to the last bit, a neighbouring one in every digit
    for _ in range(3):
        try:
            vector = solve(matrix, vector)
        except np.linalg.LinAlgError:
            vector = solve(matrix + pivot * np.eye(len(matrix)), vector)
        vector = vector / np.abs(vector).max()
        vector = vector / length(vector)
    return vector


def _orthonormal(pair: Floats) -> tuple[Floats, Floats]:
    """Q (n, 2) and the triangle R (2, 2) of Q R = pair, by Gram and Schmidt's method, twice."""
    first = float(length(pair[:, 0]))
    q = pair[:, 0] / first
    second, share = pair[:, 1], 0.0
    for _ in range(2):
        more = float(product(q, second))
        second, share = second - more * q, share + more
    left = float(length(second))
    other = second / left if left > 0.0 else second
    return np.stack([q, other], axis=1), np.array([[first, share], [0.0, left]])
