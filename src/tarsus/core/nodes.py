"""Gauss-Lobatto nodes of the collocation and the constant matrices that go with them.

Every smooth input of a step (film momentum, smooth force, drive force) is the polynomial of degree 7 through
its values at the ``N = 8`` Lobatto nodes ``TAU`` of the step, scaled to [0, 1]. All matrices here act on such
nodal values.

They are made by whole numbers, each entry rounded once: what a linear algebra library makes of an inverse of
condition 1e5 is another 1e-12 on every processor, and event times with it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from itertools import accumulate
from math import comb, cos, lcm, pi, prod
from operator import mul

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

N = 8  # nodes of a step, the order of the collocation; native/base has the same
_GRID = 1 << 53  # nodes are whole numbers over it
_FINE = 1 << 160  # and zeros of Legendre polynomials known to a few times one over that


def _zeros(at: Callable[[int], tuple[int, int]], first: Iterable[float]) -> list[int]:
    """Zeros over `_FINE` of a polynomial near first guesses, by Newton's method; at: value and slope at such a place."""
    found = []
    for guess in first:
        place = int(guess * _FINE)
        for _ in range(6):  # the digits of a guess, two, double
            value, slope = at(place)
            place -= value * _FINE // slope
        found.append(place)
    return found


def _legendre(n: int, x: int) -> tuple[int, int, int]:
    """P_n, P_n' and P_n'' at a place inside (-1, 1), all over `_FINE`."""
    before, value = _FINE, x
    for d in range(2, n + 1):
        before, value = value, ((2 * d - 1) * x * value // _FINE - (d - 1) * before) // d
    inside = _FINE - x * x // _FINE
    slope = n * (before - x * value // _FINE) * _FINE // inside
    return value, slope, (2 * x * slope // _FINE - n * (n + 1) * value) * _FINE // inside


def _lobatto() -> list[int]:
    """The N Gauss-Lobatto points over `_GRID`: both ends of [0, 1] and the zeros of P'_{N-1}; the lower half is exactly
    one less the upper, which are the nearest doubles."""
    guesses = [cos(pi * j / (N - 1)) for j in range(N // 2 - 1, 0, -1)]  # Chebyshev's, which lie near them
    upper = [int((_FINE + x) / (2 * _FINE) * _GRID) for x in _zeros(lambda x: _legendre(N - 1, x)[1:], guesses)]
    return [0, *(_GRID - t for t in reversed(upper)), *upper, _GRID]


_NODES = _lobatto()
_BELOW = [prod(own - other for other in _NODES if other != own) for own in _NODES]  # of each Lagrange polynomial


def _lagrange(p: int, q: int) -> list[float]:
    """Values (N,) of the Lagrange polynomials at a place p / q."""
    away = [p * _GRID - t * q for t in _NODES]
    before = list(accumulate(away[:-1], mul, initial=1))
    behind = list(accumulate(away[:0:-1], mul, initial=1))[::-1]
    whole = q ** (N - 1)
    return [a * b / (below * whole) for a, b, below in zip(before, behind, _BELOW, strict=True)]


def interpolation(points: Iterable[float]) -> Floats:
    """Matrix (points, nodes): values at ``points`` of the polynomial through nodal values."""
    return np.array([_lagrange(*float(p).as_integer_ratio()) for p in points])


def _powers() -> list[list[int]]:
    """Numerators over `_BELOW` of the coefficients of powers of the scaled time, of each Lagrange polynomial."""
    out = []
    for own in _NODES:
        line = [1]
        for other in _NODES:
            if other != own:
                line = [a - other * b for a, b in zip([0, *line], [*line, 0], strict=True)]
        out.append([c << 53 * n for n, c in enumerate(line)])
    return out


_POWERS = _powers()


def _nodal(terms: list[tuple[int, int, int]], first: int) -> Floats:
    """Values (N, nodes) at the nodes of sum factor / divisor c s^power; terms: (factor, divisor, power) of each coefficient
    c from number ``first`` on."""
    whole, top = lcm(*(divisor for _, divisor, _ in terms)), terms[-1][2]
    weights = [[f * (whole // d) * t**n << 53 * (top - n) for f, d, n in terms] for t in _NODES]
    below = [b * whole << 53 * top for b in _BELOW]
    return np.array([[sum(map(mul, p[first:], w)) / b for p, b in zip(_POWERS, below, strict=True)] for w in weights])


TAU: Floats = np.array([t / _GRID for t in _NODES])
# Monomial coefficients on [0, 1] from nodal values: p(s) = sum_k (MONOMIAL @ values)[k] s^k.
MONOMIAL: Floats = np.array([[p[k] / below for p, below in zip(_POWERS, _BELOW, strict=True)] for k in range(N)])
# Highest Legendre coefficient of nodal values: the truncation tail that controls the step. That of the power n of the scaled
# time is one over (2n over n).
TAIL: Floats = np.array([p[-1] / (below * comb(2 * N - 2, N - 1)) for p, below in zip(_POWERS, _BELOW, strict=True)])
# Derivative with respect to the scaled time, nodal values to nodal values.
DERIVATIVE: Floats = _nodal([(n, 1, n - 1) for n in range(1, N)], 1)
# Row j: integrals from 0 to every node of the Lagrange polynomial of node j, once and twice.
ONCE: Floats = np.ascontiguousarray(_nodal([(1, n + 1, n + 1) for n in range(N)], 0).T)
TWICE: Floats = np.ascontiguousarray(_nodal([(1, (n + 1) * (n + 2), n + 2) for n in range(N)], 0).T)
# Values on the left and right half of a step, from the nodal values of the whole step.
LEFT: Floats = np.array([_lagrange(t, 2 * _GRID) for t in _NODES])
RIGHT: Floats = np.array([_lagrange(t + _GRID, 2 * _GRID) for t in _NODES])
# Values at TAU on [0, TAU[j]], from the nodal values of the whole step.
PARTIAL: Floats = np.array([[_lagrange(t * u, _GRID**2) for u in _NODES] for t in _NODES])
# Widest spacing of two neighbouring nodes, for the envelope of the motion between them.
SPACING: float = float(np.max(np.diff(TAU)))


def _gauss(n: int) -> tuple[Floats, Floats]:
    """The n Gauss points on [0, 1] (n even) and their weights."""
    guesses = [cos(pi * (g + 0.75) / (n + 0.5)) for g in range(n // 2)]
    upper = _zeros(lambda x: _legendre(n, x)[:2], guesses)
    slopes = [_legendre(n, x)[1] for x in upper]
    weights = [_FINE**4 / ((_FINE**2 - x * x) * d * d) for x, d in zip(upper, slopes, strict=True)]
    points = [(_FINE + x) / (2 * _FINE) for x in (*(-x for x in upper), *reversed(upper))]
    return np.array(points), np.array(weights + weights[::-1])


# Gauss points on [0, 1] for integrals over a step that resolves every mode, their weights, and values at them from nodal
# values.
GAUSS, GAUSS_WEIGHTS = _gauss(16)
AT_GAUSS: Floats = interpolation(GAUSS)
