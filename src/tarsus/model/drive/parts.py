"""From a track and polynomials in the voltage to pieces in time, to 1e-12 of each channel's span."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tarsus.base.arrays import counted
from tarsus.base.errors import InputError
from tarsus.base.linear import product
from tarsus.model.drive.pieces import TERMS, Channels
from tarsus.model.drive.track import Floats, Ints, Track, shifted

_NODES = 16
"""Chebyshev nodes of a part: `TERMS` of its terms are kept, and those above show what it misses."""
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
"""Share of a force's span that a piece may miss: a fifth of the 1e-12 that drives are held to."""
_MOST_PIECES = 4_000_000
"""A drive with more is refused: their coefficients alone would take 0.4 GB."""
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


def whole_parts(track: Track, law: Any, kink: NDArray[np.bool_] | None = None) -> Parts:
    """One part for each stretch, with the cubic `law` (4,) or (S, 4)."""
    count = track.count
    ones = np.ones(count)
    rows = np.broadcast_to(law, (count, 4))
    return Parts(np.arange(count), -ones, ones, rows, track.kink if kink is None else kink)


def to_pieces(track: Track, parts: Parts) -> Channels:
    """Polynomials in time of the parts: one channel for each run."""
    stretch, law, kink = parts.stretch, parts.law, parts.kink
    runs = len(track.loops)
    run = track.run[stretch]
    sine = np.zeros(runs, dtype=bool)
    if track.amplitude is not None:
        sine[track.run[~np.isnan(track.amplitude)]] = True
    exact = ~sine & (_degrees(law, run, runs) * _degrees(track.inner, track.run, runs) < TERMS)
    if exact.all():
        source, low = np.arange(len(stretch)), parts.low
        coef = _composed(track, stretch, low, parts.high, law)
    elif not exact.any():
        coef, source, low = _fitted(track, stretch, parts.low, parts.high, law)
    else:
        own, others = (np.flatnonzero(exact[run] == chosen) for chosen in (True, False))
        pick = [(stretch[at], parts.low[at], parts.high[at], law[at]) for at in (own, others)]
        fit, of, low = _fitted(track, *pick[1])
        source = np.concatenate([own, others[of]])
        order = np.argsort(source, kind="stable")
        coef = np.concatenate([_composed(track, *pick[0]), fit])[order]
        source, low = source[order], np.append(pick[0][1], low)[order]
    fresh = np.ones(len(source), dtype=bool)
    fresh[1:] = source[1:] != source[:-1]
    stretch, law, kink = stretch[source], law[source], kink[source] & fresh
    flat = ~((law[:, 1:] != 0.0).any(axis=1) & (track.inner[stretch, 1:] != 0.0).any(axis=1))
    if flat.any():
        volts, c = track.first[stretch], law
        level = ((c[:, 3] * volts + c[:, 2]) * volts + c[:, 1]) * volts + c[:, 0]
        level = np.where(np.arange(TERMS) == 0, level[:, None], 0.0)
        coef = np.where(flat[:, None], level, coef)
    left, right = track.begin[stretch], track.end[stretch]
    begin = np.where(low == -1.0, left, left + 0.5 * (low + 1.0) * (right - left))
    if not all(np.isfinite(one).all() for one in (begin, right, coef)):
        raise InputError("the drive overflows: its voltage, gain or period is out of any physical range")
    return _without_slivers(track, stretch, begin, coef, kink)


def _without_slivers(track: Track, stretch: Ints, begin: Any, coef: Any, kink: NDArray[np.bool_]) -> Channels:
    """The pieces without those that are shorter than the resolution of time."""
    run = track.run[stretch]
    close = track.end[track.runs[1:] - 1]
    until = _ends(begin, run, close)
    long = until > begin
    if not long.all():
        kept = np.flatnonzero(long)
        opens = np.append(True, run[kept][1:] != run[kept][:-1])  # a run's first piece begins where the run does
        since = np.where(opens, np.searchsorted(run, run[kept]), np.append(0, kept[:-1] + 1))
        kink = np.logical_or.reduceat(kink, since)
        coef, stretch, begin, run = coef[kept], stretch[kept], begin[kept], run[kept]
        until = _ends(begin, run, close)
    counts = np.bincount(run, minlength=len(track.loops))
    first = np.cumsum(counts) - counts
    loops = np.searchsorted(stretch, track.runs[:-1] + np.maximum(track.loops, 0)) - first
    loops = np.where(track.loops >= 0, loops, -1)
    return Channels(counts, loops, begin, until, coef, np.array(kink), track.periods)


def _ends(begin: Floats, run: Ints, close: Floats) -> Floats:
    """Ends (Q,) of pieces, where the next one of the run begins or, of its last, at the close (nr,) of the run."""
    last = np.append(run[1:] != run[:-1], True)
    return np.where(last, close[run], np.roll(begin, -1))


def _degrees(rows: Any, run: Ints, runs: int) -> Ints:
    """Highest power in the polynomials (Q, K) of each run (nr,)."""
    out = np.zeros(runs, dtype=np.intp)
    for k in range(1, rows.shape[1]):
        out[run[rows[:, k] != 0.0]] = k
    return out


def _composed(track: Track, stretch: Ints, low: Floats, high: Floats, law: Any) -> Any:
    """Coefficients (Q, 12) of law(q(xi)), with xi mapped to the part: exact, where its degree is 11 at most."""
    q = track.inner[stretch]
    if (low != -1.0).any() or (high != 1.0).any():
        q = shifted(q, low, high)
    degree, inner = (
        max((k for k in range(1, one.shape[1]) if (one[:, k] != 0.0).any()), default=0) for one in (law, q)
    )
    terms = [law[:, degree]]
    for k in range(degree - 1, -1, -1):
        longer = [None] * (len(terms) + inner)
        for j in range(inner + 1):
            for i, term in enumerate(terms):
                part = term * q[:, j]
                longer[i + j] = part if longer[i + j] is None else longer[i + j] + part
        terms = [longer[0] + law[:, k], *longer[1:]]
    none = np.zeros(len(stretch))
    return np.stack([*terms[:TERMS], *[none] * (TERMS - len(terms))], axis=-1)


def _fitted(track: Track, stretch: Ints, low: Floats, high: Floats, law: Any) -> tuple[Any, Ints, Floats]:
    """Chebyshev fits of law(V) on the parts, each cut into as many pieces as degree 11 needs.

    Returns coefficients, the part each piece came from (ascending), and where in it the piece begins.
    """
    source, run = np.arange(len(stretch)), track.run[stretch]
    values, size, span = _sampled(track, stretch, low, high, law)
    tolerance = np.maximum(_TOLERANCE * span, 4e-15 * size)
    chebyshev = _chebyshev(values)
    before = np.full(len(source), np.inf)
    while True:
        miss = np.abs(chebyshev[:, TERMS:]).sum(axis=1)
        allowed = tolerance[run[source]]
        # a cut that gained nothing met the rounding of the values
        bad = (miss > allowed) & (miss < 0.5 * before)
        if not bad.any():
            break
        cuts = np.ones(len(source), dtype=np.intp)
        cuts[bad] = np.clip(np.ceil((miss[bad] / allowed[bad]) ** (1.0 / TERMS)), 2, 8)
        if np.bincount(run[source], cuts).max() > _MOST_PIECES:
            raise InputError(f"the drive needs more than {_MOST_PIECES} pieces: shorten it or lower its frequency")
        rank = counted(cuts)
        many = np.repeat(cuts, cuts)
        left, width = np.repeat(low, cuts), np.repeat(high - low, cuts)
        end = np.repeat(high, cuts)
        again = np.repeat(bad, cuts)
        own = np.repeat(np.arange(len(source)), cuts)
        source = source[own]
        low = np.where(rank == 0, left, left + width * (rank / many))
        high = np.where(rank == many - 1, end, left + width * ((rank + 1) / many))
        before = np.repeat(np.where(bad, miss, 0.0), cuts)
        part = source[again]
        fresh = _chebyshev(_sampled(track, stretch[part], low[again], high[again], law[part])[0])
        place = np.where(again, len(chebyshev) + np.cumsum(again) - 1, own)
        chebyshev = np.concatenate([chebyshev, fresh])[place]
    # on a sliver the high coefficients are rounding, which would grow where the engine continues the piece
    rest = np.cumsum(np.abs(chebyshev[:, ::-1]), axis=1)[:, ::-1]
    lost = (high - low < _SLIVER)[:, None] & (rest <= 4e-15 * size[run[source]][:, None])
    return _mapped(np.where(lost, 0.0, chebyshev)[:, :TERMS], _TO_MONOMIAL), source, low


def _mapped(rows: Any, matrix: Floats) -> Any:
    """Rows (Q, k) by a matrix (n, k): (Q, n)."""
    return product(rows, matrix.T)


def _chebyshev(values: Any) -> Any:
    """Chebyshev coefficients (Q, 16) of the values (Q, 16) at the nodes; the mean is kept out of the sums."""
    middle = values[:, _NODES // 2][:, None]
    return _mapped(values - middle, _TO_CHEBYSHEV) + np.where(np.arange(_NODES) == 0, middle, 0.0)


def _sampled(track: Track, stretch: Ints, low: Floats, high: Floats, law: Any) -> tuple[Any, Floats, Floats]:
    """Values (Q, 16) of law(V) at the Chebyshev nodes of the parts; of each run the size (nr,) of their largest
    term, and their range (nr,)."""
    mid, half = 0.5 * (low + high), 0.5 * (high - low)
    volts = track.values(stretch, mid[:, None] + half[:, None] * _XI)
    c = law[:, :, None]
    values = ((c[:, 3] * volts + c[:, 2]) * volts + c[:, 1]) * volts + c[:, 0]
    run = track.run[stretch]
    there, begin = np.unique(run, return_index=True)

    def of_runs(function: Any, rows: Floats) -> Floats:
        out = np.zeros(len(track.loops))
        out[there] = function.reduceat(rows, begin)
        return out

    top = of_runs(np.maximum, np.abs(volts).max(axis=1))[run]
    terms = np.abs(law)
    size = of_runs(np.maximum, ((terms[:, 0] + terms[:, 1] * top) + terms[:, 2] * top**2) + terms[:, 3] * top**3)
    return values, size, of_runs(np.maximum, values.max(axis=1)) - of_runs(np.minimum, values.min(axis=1))
