"""Exact motion of one leg in one direction over a step, as matrices between nodes (numpy only).

A foot on its spring and damper, with u its displacement and w = u' - P/m its rate without the momentum P of the film,

    u' = w + P/m,    w' = (-k u - c w + Q)/m - c P/m^2,    Q = k a + c a' + load,

is a 2 x 2 block y' = A y + b Q + d P. For Q and P that are polynomials of degree 7 within a step, given by their values
at the nodes, u and w at the nodes are linear in them and in u(0), w(0). The integrals of exp(A s) against the
polynomials are taken by Gauss quadrature on panels that halve towards s = 0, so that a fast decay is resolved.
"""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.typing import NDArray

from tarsus.core.blocks import block_exponential
from tarsus.core.nodes import TAU, N, interpolation
from tarsus.core.walk.arrays import Tables

Floats = NDArray[np.float64]

_POINTS = 14
_HALVINGS = 16
_OSCILLATION = 5.0  # radians of a leg's own oscillation in a step at most, so that the nodes see its turns


@cache
def _panels() -> tuple[Floats, Floats]:
    """Points s (ng,) of [0, 1] and what weighs exp(A s): (ng, N in, N out) of Lagrange values at node - s."""
    x, weight = np.polynomial.legendre.leggauss(_POINTS)
    edges = np.unique(np.concatenate([[0.0], 2.0 ** -np.arange(_HALVINGS + 1.0), TAU]))
    low, width = edges[:-1], np.diff(edges)
    points = (low[:, None] + 0.5 * width[:, None] * (x + 1.0)).ravel()
    weights = (0.5 * width[:, None] * weight).ravel()
    kernel = np.zeros((len(points), N, N))
    for j in range(1, N):
        below = points < TAU[j]
        kernel[below, :, j] = interpolation(TAU[j] - points[below]) * weights[below, None]
    return points, kernel


def step_tables(mass: Floats, stiffness: Floats, damping: Floats, lengths: Floats) -> Tables:
    """Tables of blocks (nt,) given by mass [kg], stiffness [N/m] and damping [N s/m], for step lengths (nk,) [s]."""
    nt, nk = len(mass), len(lengths)
    blocks = np.zeros((nt, 2, 2))
    blocks[:, 0, 1] = 1.0
    blocks[:, 1, 0] = -stiffness / mass
    blocks[:, 1, 1] = -damping / mass
    push = np.stack([np.zeros(nt), 1.0 / mass], axis=-1)
    film = np.stack([1.0 / mass, -damping / mass**2], axis=-1)
    points, kernel = _panels()
    flow = block_exponential(blocks, lengths[:, None] * points).transpose(0, 2, 1, 3, 4)  # (nk, nt, ng, 2, 2)
    inputs = np.stack([np.einsum("ktgij,tj->ktig", flow, b) for b in (push, film)])  # (2, nk, nt, 2, ng)
    response = inputs @ kernel.reshape(len(points), N * N) * lengths[:, None, None, None]
    response = response.reshape(2, nk, nt, 2, N, N)
    exact = block_exponential(blocks, lengths[:, None] * TAU).transpose(0, 2, 3, 4, 1)  # (nk, nt, 2, 2, N)
    natural = np.sqrt(stiffness / mass)
    turning = np.where(damping < 2.0 * mass * natural, natural, 0.0)
    longest = np.array([int(np.sum(lengths * rate > _OSCILLATION)) for rate in turning], dtype=np.int64)
    rate = np.maximum(natural, damping / mass)
    return Tables(
        lengths=np.ascontiguousarray(lengths), state=np.ascontiguousarray(exact.reshape(nk, nt, 4, N)),
        force=np.ascontiguousarray(response[0]), film=np.ascontiguousarray(response[1]),
        reach=np.ascontiguousarray(np.abs(response[:, :, :, 0].sum(axis=-2)).max(axis=-1).transpose(1, 2, 0)),
        rate=rate, longest=longest,
    )  # fmt: skip
