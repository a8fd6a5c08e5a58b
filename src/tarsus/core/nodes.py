"""Gauss-Lobatto nodes of the collocation and the constant matrices that go with them.

Every smooth input of a step (film momentum, smooth force, drive force) is the polynomial of degree 7 through
its values at the ``N = 8`` Lobatto nodes ``TAU`` of the step, scaled to [0, 1]. All matrices here act on such
nodal values.
"""

from __future__ import annotations

import numpy as np
from numpy.polynomial import legendre
from numpy.typing import NDArray

Floats = NDArray[np.float64]

N = 8


def lobatto(n: int) -> Floats:
    """The ``n`` Gauss-Lobatto points on [0, 1]: both ends and the zeros of P'_{n-1}."""
    inner = legendre.legroots(legendre.legder([0.0] * (n - 1) + [1.0]))
    x = np.concatenate([[-1.0], inner, [1.0]])
    x = 0.5 * (x - x[::-1])  # exactly symmetric
    return 0.5 * (1.0 + x)


def _barycentric(x: Floats) -> Floats:
    return np.array([1.0 / np.prod(x[j] - np.delete(x, j)) for j in range(len(x))])


def interpolation(points: Floats, nodes: Floats | None = None) -> Floats:
    """Matrix (points, nodes): values at ``points`` of the polynomial through nodal values."""
    x = TAU if nodes is None else nodes
    weight = _barycentric(x)
    out = np.zeros((len(points), len(x)))
    for i, p in enumerate(points):
        d = p - x
        hit = np.flatnonzero(d == 0.0)
        if hit.size:
            out[i, hit[0]] = 1.0
        else:
            q = weight / d
            out[i] = q / q.sum()
    return out


TAU: Floats = lobatto(N)
# Monomial coefficients on [0, 1] from nodal values: p(s) = sum_k (MONOMIAL @ values)[k] s^k.
MONOMIAL: Floats = np.linalg.inv(np.vander(TAU, N, increasing=True))
# Highest Legendre coefficient of nodal values: the truncation tail that controls the step.
TAIL: Floats = np.linalg.inv(legendre.legvander(2.0 * TAU - 1.0, N - 1))[N - 1]
# Derivative with respect to the scaled time, nodal values to nodal values.
DERIVATIVE: Floats = np.vander(TAU, N, increasing=True)[:, : N - 1] @ (MONOMIAL[1:] * np.arange(1, N)[:, None])
_powers = np.arange(1, N + 1)
# Row j: integrals from 0 to every node of the Lagrange polynomial of node j, once and twice.
ONCE: Floats = np.ascontiguousarray((TAU[:, None] ** _powers @ (MONOMIAL / _powers[:, None])).T)
TWICE: Floats = np.ascontiguousarray(
    (TAU[:, None] ** (_powers + 1) @ (MONOMIAL / (_powers * (_powers + 1))[:, None])).T
)
# Values on the left and right half of a step, from the nodal values of the whole step.
LEFT: Floats = interpolation(0.5 * TAU)
RIGHT: Floats = interpolation(0.5 + 0.5 * TAU)
# Values at TAU on [0, TAU[j]], from the nodal values of the whole step.
PARTIAL: Floats = np.stack([interpolation(t * TAU) for t in TAU])
# Widest spacing of two neighbouring nodes, for the envelope of what happens between them.
SPACING: float = float(np.max(np.diff(TAU)))
# Gauss points on [0, 1] for integrals over a step that resolves every mode, their weights, and values at them from nodal
# values.
GAUSS, GAUSS_WEIGHTS = (0.5 * part for part in legendre.leggauss(16))
GAUSS = GAUSS + 0.5
AT_GAUSS: Floats = interpolation(GAUSS)
