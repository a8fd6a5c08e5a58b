"""From a track and polynomials in the voltage to pieces in time, to 1e-12 of the channel's span."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tarsus.base.errors import InputError
from tarsus.model.drive.pieces import TERMS, Pieces
from tarsus.model.drive.track import Floats, Ints, Track, shifted

_NODES = 16
_ANGLE = (np.arange(_NODES) + 0.5) * np.pi / _NODES
_XI = np.cos(_ANGLE)
_TO_CHEBYSHEV = np.cos(np.arange(_NODES)[:, None] * _ANGLE) * (2.0 / _NODES)
_TO_CHEBYSHEV[0] *= 0.5
_TO_MONOMIAL = np.zeros((TERMS, TERMS))
"""Column j: T_j in monomials, from T_j = 2 x T_{j-1} - T_{j-2}."""
_TO_MONOMIAL[0, 0] = _TO_MONOMIAL[1, 1] = 1.0
for _j in range(2, TERMS):
    _TO_MONOMIAL[1:, _j] = 2.0 * _TO_MONOMIAL[:-1, _j - 1]
    _TO_MONOMIAL[:, _j] -= _TO_MONOMIAL[:, _j - 2]

_TOLERANCE = 2e-13
_MOST_PIECES = 4_000_000
_SLIVER = 1e-4
"""A part of a stretch this short (of 2) is a sliver."""

IDENTITY = np.array([0.0, 1.0, 0.0, 0.0])
"""The polynomial V."""


@dataclass(frozen=True)
class Parts:
    """Q parts of stretches on each of which the channel is one cubic of the voltage."""

    stretch: Ints
    """(Q,) stretch of the track, ascending."""
    low: Floats
    """(Q,) local coordinate in [-1, 1] where the part starts."""
    high: Floats
    """(Q,) and where it ends."""
    law: Floats
    """(Q, 4): value = sum_k law[k] V**k."""
    kink: NDArray[np.bool_]
    """(Q,)."""


def whole_parts(track: Track, law: Floats, kink: NDArray[np.bool_] | None = None) -> Parts:
    """One part for each stretch, with the cubic `law` (4,) or (S, 4)."""
    count = track.count
    rows = np.broadcast_to(law, (count, 4))
    ones = np.ones(count)
    return Parts(np.arange(count), -ones, ones, rows, track.kink if kink is None else kink)


def to_pieces(track: Track, parts: Parts, loop_stretch: int) -> Pieces:
    """Polynomials in time of the parts; the loop starts at `loop_stretch` (-1: the last value is held)."""
    stretch, low, high, law, kink = parts.stretch, parts.low, parts.high, parts.law, parts.kink
    exact = track.amplitude is None and _degree(law) * _degree(track.inner) < TERMS
    if exact:
        coef = _compose(track, stretch, low, high, law)
    else:
        coef, source, low, high = _fit(track, stretch, low, high, law)
        fresh = np.ones(len(source), dtype=bool)
        fresh[1:] = source[1:] != source[:-1]
        stretch, law, kink = stretch[source], law[source], kink[source] & fresh
    flat = ~(law[:, 1:].any(axis=1) & track.inner[stretch, 1:].any(axis=1))
    if flat.any():
        volts = track.first[stretch[flat]]
        c = law[flat]
        coef[flat] = 0.0
        coef[flat, 0] = ((c[:, 3] * volts + c[:, 2]) * volts + c[:, 1]) * volts + c[:, 0]
    left, right = track.start[stretch], track.start[stretch + 1]
    start = np.append(np.where(low == -1.0, left, left + 0.5 * (low + 1.0) * (right - left)), track.start[-1])
    if not (np.isfinite(start).all() and np.isfinite(coef).all()):
        raise InputError("the drive overflows: its voltage, gain or period is out of any physical range")
    long = np.diff(start) > 0.0
    if not long.all():  # pieces shorter than the resolution of time
        start = np.append(start[:-1][long], start[-1])
        begins = np.concatenate([[0], np.flatnonzero(long)[:-1] + 1])
        kink = np.logical_or.reduceat(kink, begins)
        coef, stretch = coef[long], stretch[long]
    loop = -1
    if loop_stretch >= 0:
        loop = int(np.searchsorted(stretch, loop_stretch))
    return Pieces(start, np.ascontiguousarray(coef), np.array(kink), loop)


def _degree(rows: Floats) -> int:
    """Highest power in polynomials (Q, K)."""
    return max([k for k in range(1, rows.shape[1]) if rows[:, k].any()], default=0)


def _compose(track: Track, stretch: Ints, low: Floats, high: Floats, law: Floats) -> Floats:
    """Coefficients (Q, 12) of law(q(xi)), with xi mapped to the part: exact, where its degree is 11 at most."""
    q = shifted(track.inner[stretch], low, high)
    degree, inner_degree = _degree(law), _degree(q)
    coef = np.zeros((len(stretch), TERMS))
    coef[:, 0] = law[:, degree]
    for k in range(degree - 1, -1, -1):
        product = coef * q[:, :1]
        for j in range(1, inner_degree + 1):
            product[:, j:] += coef[:, :-j] * q[:, j : j + 1]
        product[:, 0] += law[:, k]
        coef = product
    return coef


def _fit(
    track: Track, stretch: Ints, low: Floats, high: Floats, law: Floats
) -> tuple[Floats, Ints, Floats, Floats]:
    """Chebyshev fits of law(V) on the parts, each cut into as many pieces as degree 11 needs.

    Returns coefficients, the part each piece came from (ascending), and the pieces' local ranges.
    """
    source = np.arange(len(stretch))
    values, size = _sample(track, stretch, low, high, law)
    tolerance = max(_TOLERANCE * float(np.ptp(values)), 4e-15 * size)
    chebyshev = _chebyshev(values)
    before = np.full(len(source), np.inf)
    while True:
        miss = np.abs(chebyshev[:, TERMS:]).sum(axis=1)
        bad = (miss > tolerance) & (
            miss < 0.5 * before
        )  # a cut that gained nothing met the rounding of the values
        if not bad.any():
            break
        cuts = np.ones(len(source), dtype=np.intp)
        cuts[bad] = np.clip(np.ceil((miss[bad] / tolerance) ** (1.0 / TERMS)), 2, 8)
        total = int(cuts.sum())
        if total > _MOST_PIECES:
            raise InputError(
                f"the drive needs more than {_MOST_PIECES} pieces: shorten it or lower its frequency"
            )
        rank = np.arange(total) - np.repeat(np.cumsum(cuts) - cuts, cuts)
        many = np.repeat(cuts, cuts)
        left, width = np.repeat(low, cuts), np.repeat(high - low, cuts)
        end = np.repeat(high, cuts)
        again = np.repeat(bad, cuts)
        source = np.repeat(source, cuts)
        low = np.where(rank == 0, left, left + width * (rank / many))
        high = np.where(rank == many - 1, end, left + width * ((rank + 1) / many))
        chebyshev = np.repeat(chebyshev, cuts, axis=0)
        before = np.repeat(np.where(bad, miss, 0.0), cuts)
        part = source[again]
        values, _ = _sample(track, stretch[part], low[again], high[again], law[part])
        chebyshev[again] = _chebyshev(values)
    # on a sliver the high coefficients are rounding, which would grow where the engine continues the piece
    rest = np.cumsum(np.abs(chebyshev[:, ::-1]), axis=1)[:, ::-1]
    chebyshev[(high - low < _SLIVER)[:, None] & (rest <= 4e-15 * size)] = 0.0
    return _combined(chebyshev[:, :TERMS], _TO_MONOMIAL), source, low, high


def _combined(values: Floats, matrix: Floats) -> Floats:
    """Each row (k,) of values (Q, k) through a matrix (r, k), added up in order: event times go by these numbers to
    the last bit, and a library's product has another one on every processor."""
    out = values[:, :1] * matrix[:, 0]
    for j in range(1, matrix.shape[1]):
        out += values[:, j : j + 1] * matrix[:, j]
    return out


def _chebyshev(values: Floats) -> Floats:
    """Chebyshev coefficients (Q, 16) of the values (Q, 16) at the nodes; the mean is kept out of the sums."""
    middle = values[:, _NODES // 2].copy()
    coef = _combined(values - middle[:, None], _TO_CHEBYSHEV)
    coef[:, 0] += middle
    return coef


def _sample(track: Track, stretch: Ints, low: Floats, high: Floats, law: Floats) -> tuple[Floats, float]:
    """Values (Q, 16) of law(V) at the Chebyshev nodes of the parts, and the size of their largest term."""
    mid, half = 0.5 * (low + high), 0.5 * (high - low)
    volts = track.values(stretch, mid[:, None] + half[:, None] * _XI)
    c = law[:, :, None]
    values = ((c[:, 3] * volts + c[:, 2]) * volts + c[:, 1]) * volts + c[:, 0]
    top = float(np.abs(volts).max(initial=0.0))
    size = float((np.abs(law) @ top ** np.arange(4)).max(initial=0.0))
    return values, size
