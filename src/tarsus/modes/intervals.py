"""Intervals of a mode's numbers: from the scatter between repeats, channels or lines, and between ways to fit."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import ndtri, stdtrit

from tarsus.base.arrays import Floats
from tarsus.fit.ranges import Range
from tarsus.fit.verdict import LEVEL
from tarsus.modes.refine import LocalFit

FEWEST_REPEATS = 4
"""Repeats from which the scatter is taken: Student's quantile for three is twice that for four."""
_FEWEST_CHANNELS = 3.0
"""Channels, by their weight, whose scatter can be that of a pole."""
_FLOOR = 1e-9
"""Information, in parts of each unknown's own, that is added so that none is beyond rounding."""
_TAIL = 0.5 + 0.5 * LEVEL


class Basis(Enum):
    """Between what the scatter of an interval was taken."""

    REPEATS = "repeats"
    CHANNELS = "channels"
    LINES = "lines of a single response"


@dataclass(frozen=True)
class Scatter:
    """Groups of data with what each contributes to the unknowns of a least-squares fit.

    information (ng, k, k) and score (ng, k), in noise units: a step of Gauss and Newton for some of the groups is
    ``sum(information)^-1 sum(score)``; at the fit to all groups scores add up to zero.
    """

    information: Floats
    score: Floats

    def scaled(self) -> tuple[Floats, Scatter]:
        """Units of the unknowns (k,) in which each is known to about 1, and the same in these; an unknown of which the
        data say nothing has a unit of 1."""
        known = np.sqrt(np.diag(self.information.sum(axis=0)))
        unit = 1.0 / np.where(known > 0.0, known, 1.0)
        return unit, Scatter(self.information * unit * unit[:, None], self.score * unit)

    def range_of(self, value: float, slope: Floats, unit: str, spread: float = 0.0, least: float = 0.0) -> Range:
        """95 % interval of a number with derivatives ``slope`` (k,) by the unknowns.

        The variance is the jackknife's over groups (leave one out; Efron and Stein 1981), with Student's quantile for
        the groups that count, by their information about the number; ``spread``, a standard deviation, is that between
        ways to fit, and ``least`` what noise alone leaves: of few groups one in some hundred agree to a quarter of it.
        Infinite with one group.
        """
        units, scaled = self.scaled()
        slope, total = slope * units, scaled.information.sum(axis=0)
        floor = _FLOOR * np.eye(len(units))
        pull = np.linalg.solve(total + floor, slope)
        share = np.einsum("a,gab,b->g", pull, scaled.information, pull)
        count = float(share.sum() ** 2 / np.sum(share**2))
        if count <= 1.5:
            return Range(value, -np.inf, np.inf, unit=unit)
        groups = len(self.score)
        left = total - scaled.information + floor  # a group may hold nearly all
        off = np.linalg.solve(left, scaled.score[..., None])[..., 0] @ slope
        deviation = np.sqrt((groups - 1.0) / groups * np.sum((off - off.mean()) ** 2))
        own = max(stdtrit(count - 1.0, _TAIL) * deviation, ndtri(_TAIL) * least)
        half = float(np.hypot(own, ndtri(_TAIL) * spread))
        return Range(value, value - half, value + half, unit=unit)


def pole_ranges(
    pole: complex, scatter: Scatter, spread: ArrayLike = (0.0, 0.0), least: ArrayLike = (0.0, 0.0)
) -> tuple[Range, Range]:
    """Ranges of natural frequency [Hz] and damping ratio [1] of a pole [rad/s] whose real and imaginary part are the
    unknowns, with the standard deviations of both between ways to fit, and those that noise alone leaves."""
    spread, least = np.asarray(spread, dtype=float), np.asarray(least, dtype=float)
    radius, (frequency, ratio) = abs(pole), numbers_of(pole)
    to_frequency = np.array([pole.real, pole.imag]) / radius / (2.0 * np.pi)
    to_ratio = np.array([-1.0 / radius + pole.real**2 / radius**3, pole.real * pole.imag / radius**3])
    return (
        scatter.range_of(frequency, to_frequency, "Hz", spread[0], least[0]),
        scatter.range_of(ratio, to_ratio, "1", spread[1], least[1]),
    )


def numbers_of(pole: complex) -> tuple[float, float]:
    """Natural frequency [Hz] and damping ratio [1] of a pole [rad/s]."""
    return abs(pole) / (2.0 * np.pi), -pole.real / abs(pole)


def variances_of(fit: LocalFit, rows: NDArray[np.bool_] | slice = slice(None)) -> Floats:
    """Variances of frequency and damping ratio (2,) of a local fit by its misfit, were that white, in all of the
    responses or some."""
    slopes = fit.slopes[rows].reshape(-1, 2)
    of_pole = np.diag(np.linalg.pinv(slopes.T @ slopes))
    return np.array([of_pole[1] / (2.0 * np.pi) ** 2, of_pole[0] / abs(fit.pole) ** 2])


def scatter_between(
    slopes: Floats, misfit: Floats, off: Floats | None, width: int, channels: bool = True
) -> tuple[Scatter, Basis]:
    """Scatter of k unknowns of a fit, and between what: four or more repeats; without them channels, where at least
    three of them count; without these the lines, in blocks, since misfits of neighbouring lines are alike.

    Parameters
    ----------
    slopes, misfit
        (nc, 2 nl, k) and (nc, 2 nl): real over imaginary parts of the lines, over the noise.
    off
        Deviations of the lines of single repeats from their mean (nr, nc, 2 nl), or None.
    width
        Lines of a block.
    channels
        Whether channels may count as groups: where each determines the unknowns by itself.
    """
    size = slopes.shape[-1]
    if off is not None and len(off) >= FEWEST_REPEATS:
        count, flat = len(off), slopes.reshape(-1, size)
        information = np.broadcast_to(flat.T @ flat / count, (count, size, size))
        return Scatter(information, off.reshape(count, -1) @ flat / count), Basis.REPEATS
    by_channel = slopes.transpose(0, 2, 1) @ slopes
    weight = np.trace(by_channel, axis1=1, axis2=2)
    if channels and weight.sum() ** 2 >= _FEWEST_CHANNELS * np.sum(weight**2):
        return Scatter(by_channel, np.einsum("cfa,cf->ca", slopes, misfit)), Basis.CHANNELS
    pairs = slopes.reshape(len(slopes), 2, -1, size)
    starts = np.arange(0, pairs.shape[2], max(1, width))
    information = np.add.reduceat(np.einsum("crfa,crfb->fab", pairs, pairs), starts, axis=0)
    by_line = np.einsum("crfa,crf->fa", pairs, misfit.reshape(pairs.shape[:3]))
    return Scatter(information, np.add.reduceat(by_line, starts, axis=0)), Basis.LINES


def scatter_of(fit: LocalFit, off: Floats | None, line: float) -> tuple[Scatter, Basis]:
    """Scatter of the pole of a local fit, with ``off`` as in `scatter_between` and lines ``line`` [Hz] apart: blocks
    are a quarter of a half-power band."""
    return scatter_between(fit.slopes, fit.misfit, off, round(abs(fit.pole.real) / (2.0 * np.pi * line)))


def moved_by(slopes: Floats, off: Floats) -> Floats:
    """How far each repeat alone would move the k unknowns of a fit, by one Gauss-Newton step (nr, k); slopes and off as
    in `scatter_between`."""
    flat = slopes.reshape(-1, slopes.shape[-1])
    full = flat.T @ flat
    scale = np.sqrt(np.diag(full))
    return off.reshape(len(off), -1) @ flat / scale @ np.linalg.pinv(full / scale / scale[:, None]) / scale
