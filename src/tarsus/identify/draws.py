"""Draws of an estimate: over blocks of its own data, and along with what earlier steps do not know."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import stdtrit

from tarsus.base.arrays import Floats

DRAWS = 400
"""Draws of every step."""

_FACTOR = 0.5
"""Spread over the value from which on a number is known to a factor: added to it, two such deviations reach zero."""
_KEPT = 0.999
"""Share of the variance of earlier numbers that is carried: what is left widens an interval by 0.05 %."""
NORMAL = 1.959964
"""Normal 97.5 % quantile."""
_ROUNDING = 1e-12
"""Relative size below which a part of an information matrix is rounding: products of its entries leave 1e-15."""


def student(groups: float) -> float:
    """Factor on deviations of draws over few groups: n / (n - 1) in the variance, and Student's 97.5 % quantile."""
    if groups <= 1.5:
        return np.inf
    return float(np.sqrt(groups / (groups - 1.0)) * stdtrit(groups - 1.0, 0.975) / NORMAL)


def drawn_level(level: tuple[float, float], seed: int) -> Floats:
    """Draws (draws,) of a contact level with its standard error [m]: with one seed the same for all numbers."""
    return level[0] + level[1] * np.random.default_rng([seed, 7]).standard_normal(DRAWS)


def by_group(groups: ArrayLike, *rows: Floats) -> tuple[Floats, ...]:
    """Sums (ng, ...) of rows (n, ...) over the groups that they are of, by the number (n,) of each."""
    numbers, which = np.unique(groups, return_inverse=True)
    parts = [which == k for k in range(len(numbers))]
    return tuple(np.array([one[part].sum(axis=0) for part in parts]) for one in rows)


def sandwich_draws(levels: Sequence[tuple[Floats, Floats]], seed: int, prior: Floats | None = None) -> Floats:
    """Deviations (draws, p) of an estimate, of the covariance of which `sandwich_root` gives a root: by the triangular
    one, which alone is no matter of rounding where directions are equally uncertain."""
    triangle = np.linalg.qr(sandwich_root(levels, prior).T).R
    triangle *= np.where(np.diag(triangle) < 0.0, -1.0, 1.0)[:, None]
    return np.random.default_rng([seed, 11]).standard_normal((DRAWS, len(triangle))) @ triangle


def sandwich_root(levels: Sequence[tuple[Floats, Floats]], prior: Floats | None = None) -> Floats:
    """A root (p, p) of the covariance of an estimate, from the scatter of its score between groups of its data.

    With ``A`` the whole information the covariance is ``A^-1 sum_g (s_g - s) (s_g - s)^T A^-1``. Each parameter's
    deviation is brought to Student's 97.5 % quantile over the normal one with the degrees of freedom that its variance
    has when the scores are normal (Bell and McCaffrey 2002), and divided by the share of the variance that is left when
    the estimate has taken its own: n - 1 and (n - 1) / n for n groups alike. Where the scatter of a few groups is by
    chance smaller than what their noise leaves of a direction, and where there is one group, which has none, noise adds
    the rest. Of several ways to group the data the widest counts in every direction.

    Parameters
    ----------
    levels
        For every way to group the data: information and score of each group about the parameters at the estimate,
        (g, p, p) and (g, p), in units of the noise.
    prior
        Information (p, p) that was known beforehand: it does not scatter, and leaves what it leaves.
    """
    total = levels[0][0].sum(axis=0) + (0.0 if prior is None else prior)
    inverse = np.linalg.inv(total)
    root, noise = np.zeros_like(inverse), inverse  # of the data and, where they tell nothing, of what was known before
    for information, score in levels:
        covariance = np.zeros_like(inverse)
        if len(score) > 1:
            moves = (score - score.mean(axis=0)) @ inverse
            wider = [_widening(information, inverse, row) for row in inverse]
            covariance = moves.T @ moves * np.outer(wider, wider)
        root = _at_least(covariance, noise)
        noise = root @ root.T
    if prior is not None:
        root = _at_most(root, prior)
    return root


def _widening(information: Floats, inverse: Floats, row: Floats) -> float:
    """Factor on the deviation of the parameter with this row of the inverse information, from groups' scores."""
    parts = information @ row
    # covariance of the groups' parts in the deviation: each group's own, less what the estimate has taken of it
    linked = np.diag(parts @ row) - parts @ inverse @ parts.T
    own, left = float(np.sum(parts @ row)), float(np.trace(linked))
    if not left > _ROUNDING * own:  # one group has all of the information: noise alone counts
        return 0.0
    freedom = left**2 / float(np.sum(linked**2))
    # less than one degree is none: what was known beforehand has most of the variance, and bounds it
    return float(np.sqrt(own / left) * stdtrit(max(freedom, 1.0), 0.975) / NORMAL)


def _at_least(covariance: Floats, noise: Floats) -> Floats:
    """A square root (p, p) of a covariance, widened in every direction to that of the noise at least."""
    scale = np.sqrt(np.maximum(np.diag(noise), np.finfo(float).tiny))
    strength, ways = np.linalg.eigh(noise / np.outer(scale, scale))
    root = ways * np.sqrt(np.maximum(strength, _ROUNDING * strength[-1]))
    inner = np.linalg.solve(root, covariance / np.outer(scale, scale))
    inner = np.linalg.solve(root, inner.T)
    spread, turned = np.linalg.eigh(0.5 * (inner + inner.T))
    return scale[:, None] * (root @ turned) * np.sqrt(np.maximum(spread, 1.0))


def _at_most(root: Floats, prior: Floats) -> Floats:
    """The square root (p, p) of a covariance that leaves no direction more open than what was known beforehand."""
    known = np.linalg.cholesky(prior)
    ways, spread, turned = np.linalg.svd(known.T @ root)
    return np.asarray(np.linalg.solve(known.T, ways * np.minimum(spread, 1.0)) @ turned, dtype=np.float64)


def within(
    values: Floats, samples: Floats, bounds: ArrayLike
) -> tuple[Floats, Floats, tuple[tuple[float, float], ...]]:
    """An estimate (p,) and its draws (draws, p) for numbers of which physics leaves a part: draws beyond a bound lie on
    it; and of each number the bounds that the data do not exclude, beyond which 2.5 % of the draws were.

    An estimate outside is set on the bound if its draws reach the other side of it with 2.5 %, and else stays where it
    is, away from all draws.
    """
    values, samples = np.asarray(values, dtype=float), np.asarray(samples, dtype=float)
    low, high = np.reshape(np.asarray(bounds, dtype=float), (-1, 2)).T
    first, last = np.quantile(samples, [0.025, 0.975], axis=0)
    reached = ((values < low) & (low <= last)) | ((first <= high) & (high < values))
    ends = np.column_stack([np.where(first <= low, low, -np.inf), np.where(last >= high, high, np.inf)])
    values = np.where(reached, values.clip(low, high), values)
    return values, samples.clip(low, high), tuple((a, b) for a, b in ends.tolist())


def carried(estimate: Callable[[Floats], Floats], values: Floats, samples: Floats) -> Floats:
    """What the uncertainty of earlier parameters does to an estimate: deviations (draws, p), one a draw of theirs.

    The estimate is taken as linear in them over their spread, or in their logarithms where they are known to a factor
    only: it is formed again with the earlier parameters moved by one standard deviation along each principal direction
    of their draws.

    Parameters
    ----------
    estimate
        Estimate (p,) for earlier parameters (q,).
    values
        Of the earlier parameters (q,).
    samples
        Their draws (draws, q).
    """
    base = np.asarray(estimate(values), dtype=float)
    scaled = _by_factors(values, samples)

    def even(numbers: Floats) -> Floats:
        return np.where(scaled, np.log(np.where(scaled, np.abs(numbers), 1.0)), numbers)

    def back(numbers: Floats) -> Floats:
        return np.where(scaled, np.sign(values) * np.exp(np.where(scaled, numbers, 0.0)), numbers)

    off = even(samples) - even(values)
    size = np.sqrt(np.mean(off**2, axis=0))
    used = size > 0.0
    out = np.zeros((len(samples), len(base)))
    if not used.any():
        return out
    unit = off[:, used] / size[used]
    left, spread, right = np.linalg.svd(unit, full_matrices=False)
    share = np.cumsum(spread**2) / np.sum(spread**2)
    count = int(np.searchsorted(share, _KEPT)) + 1
    for k in range(min(count, len(spread))):
        one = spread[k] / np.sqrt(len(samples))
        direction = np.zeros(len(values))
        direction[used] = right[k] * one * size[used]
        moved = np.asarray(estimate(back(even(values) + direction)), dtype=float) - base
        out += np.outer(left[:, k] * np.sqrt(len(samples)), moved)
    return out


def _by_factors(values: Floats, samples: Floats) -> NDArray[np.bool_]:
    """Parameters (q,) that are known to a factor only: draws of one sign that spread by half the value or more. They
    move by factors, for one that is added would lead to where no draw lies."""
    wide = np.std(samples, axis=0) > _FACTOR * np.abs(values)
    return wide & np.all(samples * values > 0.0, axis=0)
