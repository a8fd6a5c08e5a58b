"""Intervals of a mode's frequency and damping from the scatter between repeats, channels or lines."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

import numpy as np
from numpy.typing import NDArray
from scipy.stats import t

from tarsus.modes.refine import LocalFit

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]

_DRAWS = 1000
"""Draws of a bootstrap: ends of a 95 % interval are then good to 2 % of it."""
_SEED = 20130
"""Of the draws: the same responses always have the same intervals."""
_FEWEST_REPEATS = 4
"""Repeats that are drawn; of three draws only ten differ."""
_FEWEST_CHANNELS = 3.0
"""Channels, by their weight, whose scatter can tell that of a pole."""


class Basis(Enum):
    """What an interval was drawn over."""

    REPEATS = "repeats"
    CHANNELS = "channels"
    LINES = "lines of a single response"


@dataclass(frozen=True)
class Interval:
    """A number with its 95 % interval: value; low, high; std: its standard error; n: how many independent groups, in
    effect, it was drawn over."""

    value: float
    low: float
    high: float
    std: float
    n: float

    def __str__(self) -> str:
        return f"{self.value:.6g} [{self.low:.6g}, {self.high:.6g}]"


def pole_intervals(
    fit: LocalFit, values: Complexes, repeats: Complexes | None, line: float
) -> tuple[Interval, Interval, Basis]:
    """Intervals of natural frequency [Hz] and damping ratio [1] of a local fit, and what they were drawn over.

    Four or more repeats are drawn; without them channels, where at least three of them count; without these the lines,
    in blocks of a quarter of a half-power band, since misfits of neighbouring lines are alike.

    Parameters
    ----------
    fit
        Of the mode.
    values
        Responses it was fitted to, in its lines (nc, nl).
    repeats
        The same of single repeats (nr, nc, nl), or None.
    line
        Spacing of the lines [Hz].
    """
    known = np.isfinite(fit.noise)
    slopes, misfit = fit.slopes[known], fit.misfit[known]
    by_channel = slopes.transpose(0, 2, 1) @ slopes
    if repeats is not None and len(repeats) >= _FEWEST_REPEATS:
        count = len(repeats)
        score = _scores(fit, values, repeats) / count
        information = np.broadcast_to(by_channel.sum(axis=0) / count, (count, 2, 2))
        return *bootstrap_pole(fit.pole, information, score), Basis.REPEATS
    weight = np.trace(by_channel, axis1=1, axis2=2)
    if weight.sum() ** 2 >= _FEWEST_CHANNELS * np.sum(weight**2):
        score = np.einsum("cfa,cf->ca", slopes, misfit)
        return *bootstrap_pole(fit.pole, by_channel, score), Basis.CHANNELS
    pairs = slopes.reshape(len(slopes), 2, -1, 2)
    starts = np.arange(0, pairs.shape[2], max(1, round(abs(fit.pole.real) / (2.0 * np.pi * line))))
    information = np.add.reduceat(np.einsum("crfa,crfb->cfab", pairs, pairs), starts, axis=1).reshape(
        -1, 2, 2
    )
    by_line = np.einsum("crfa,crf->cfa", pairs, misfit.reshape(pairs.shape[:3]))
    score = np.add.reduceat(by_line, starts, axis=1).reshape(-1, 2)
    return *bootstrap_pole(fit.pole, information, score), Basis.LINES


def pole_shifts(fit: LocalFit, values: Complexes, repeats: Complexes) -> Complexes:
    """How far [rad/s] each repeat (nr, nc, nl) alone would move the pole of a fit to their mean ``values`` (nc, nl), by
    one Gauss-Newton step: (nr,)."""
    slopes = fit.slopes[np.isfinite(fit.noise)].reshape(-1, 2)
    moved = np.linalg.solve(slopes.T @ slopes, _scores(fit, values, repeats).T)
    return moved[0] + 1.0j * moved[1]


def _scores(fit: LocalFit, values: Complexes, repeats: Complexes) -> Floats:
    """Score (nr, 2) of each repeat about real and imaginary part of the pole."""
    known = np.isfinite(fit.noise)
    off = (repeats - values)[:, known] / fit.noise[known][:, None]
    parts = np.concatenate([off.real, off.imag], axis=2)
    return parts.reshape(len(repeats), -1) @ fit.slopes[known].reshape(-1, 2)


def bootstrap_pole(pole: complex, information: Floats, score: Floats) -> tuple[Interval, Interval]:
    """Intervals of natural frequency [Hz] and damping ratio [1] of a pole.

    Groups (repeats, channels or lines) are drawn with replacement, a thousand times; each draw moves the pole by one
    Gauss-Newton step from the fit to all. The standard deviation over draws is enlarged for the few groups there are
    (n / (n - 1) in the variance, Student's quantile with n - 1), where n counts a group by the information it has.

    Parameters
    ----------
    pole
        The fit to all groups [rad/s].
    information, score
        Of each group about real and imaginary part of the pole, (ng, 2, 2) and (ng, 2).
    """
    random = np.random.default_rng(_SEED)
    count = len(score)
    drawn = random.multinomial(count, np.full(count, 1.0 / count), size=_DRAWS).astype(float)
    matrices = np.einsum("dg,gab->dab", drawn, information)
    total = information.sum(axis=0)
    matrices = matrices + 1e-6 * total
    moved = np.linalg.solve(matrices, (drawn @ score)[..., None])[..., 0]
    radius, angle = abs(pole), -pole.real / abs(pole)
    # f = |p| / 2 pi, zeta = -Re p / |p|
    to_f = np.array([pole.real, pole.imag]) / radius / (2.0 * np.pi)
    to_damping = np.array([-1.0 / radius + pole.real**2 / radius**3, pole.real * pole.imag / radius**3])
    inverse = np.linalg.inv(total)
    out = []
    for value, slope in ((radius / (2.0 * np.pi), to_f), (angle, to_damping)):
        pull = inverse @ slope
        share = np.einsum("a,gab,b->g", pull, information, pull)
        n = float(share.sum() ** 2 / np.sum(share**2))
        if n <= 1.5:
            out.append(Interval(value, -np.inf, np.inf, np.inf, n))
            continue
        std = float(np.std(moved @ slope)) * float(np.sqrt(n / (n - 1.0)))
        half = float(t.ppf(0.975, n - 1.0)) * std
        out.append(Interval(value, value - half, value + half, std, n))
    return out[0], out[1]
