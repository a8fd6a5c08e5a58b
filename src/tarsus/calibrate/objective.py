"""How well readings fit a table: residuals in tolerances, existence as a likelihood, constraints as soft bounds.

A cell with value o and tolerance ``tau = sqrt(a^2 + (r o)^2)`` (a absolute, r relative) is compared on the scale
``u(v) = log(v + a) (o + a) / tau``: for small errors the residual ``z = u(model) - u(o)`` is (model - o) / tau, for
large ones it grows with their logarithm, upwards as downwards. The model's reading scatters from window to window;
with mean z and variance s^2 over the windows the cost of a cell is

    c^2 log(1 + z^2 / ((1 + s^2) c^2)) + log(1 + s^2),

minus twice a log-likelihood (constants dropped), Gaussian for \\|z\\| << c and with the tail of Cauchy's beyond c
tolerances, so that one cell that the model cannot reach does not decide. Existence adds -2 log p, p the smoothed
fraction of windows that have it, half a window added to either side. A constraint costs (excess / softness)^2 with
the same tail.

No piece of the cost is below zero. Their roots are the residuals of a least-squares fit, that of the misfit with the
sign of its pull, and the cost is the sum of their squares.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from tarsus.base.arrays import Floats
from tarsus.fit.residuals import FAILED


@dataclass(frozen=True)
class Cells:
    """The measured part of a table: nr rows, nk measures.

    names (nk,); units (nk,) of the columns; observed (nr, nk) in SI, NaN where unknown; absolute (nr, nk) and relative
    (nk,) tolerances; weight (nk,); exists (nk,) True where existence is a likelihood.
    """

    names: tuple[str, ...]
    units: tuple[str, ...]
    observed: Floats
    absolute: Floats
    relative: Floats
    weight: Floats
    exists: NDArray[np.bool_]

    @property
    def known(self) -> NDArray[np.bool_]:
        """Which cells (nr, nk) hold a value."""
        return np.isfinite(self.observed)

    def at(self, rows: Sequence[int]) -> Cells:
        """Cells of some of the rows."""
        chosen = list(rows)
        return replace(self, observed=self.observed[chosen], absolute=self.absolute[chosen])


@dataclass(frozen=True)
class Hypothesis:
    """One combination of options: the number of its runs' variant, and the channel that each measure of the table is
    (nk,)."""

    options: dict[str, str]
    run: int
    columns: tuple[int, ...]

    @property
    def name(self) -> str:
        """Its options in words."""
        return ", ".join(f"{choice} {option}" for choice, option in self.options.items()) or "the only one"


@dataclass(frozen=True)
class SoftLimit:
    """A channel stays between bounds in some of the rows that are simulated for constraints, after those of the table
    (places among them)."""

    name: str
    rows: tuple[int, ...]
    channel: int
    low: float
    high: float
    softness: float


def tolerance(values: Floats, absolute: Floats, relative: Floats) -> Floats:
    """Tolerance of values."""
    return np.sqrt(absolute**2 + (relative * values) ** 2)


def existence(readings: Floats, extra: float = 0.0) -> Floats:
    """Fraction (...,) of windows that have something, from readings (..., samples); failed ones count half.

    extra: windows added to either side, for a probability that is never 0 or 1.
    """
    some = np.where(np.isinf(readings), 0.5, np.nan_to_num(readings) > 0.0)
    return (some.sum(axis=-1) + extra) / (readings.shape[-1] + 2.0 * extra)


@dataclass(frozen=True)
class Objective:
    """Costs of readings against cells and constraints; robust: residual, in tolerances, beyond which a cell loses
    influence."""

    cells: Cells
    limits: tuple[SoftLimit, ...] = ()
    robust: float = 3.0

    def without(self, row: int) -> Objective:
        """The objective of somebody who does not have this row of the table."""
        return replace(self, cells=self.cells.at([n for n in range(len(self.cells.observed)) if n != row]))

    def only(self, row: int) -> Objective:
        """The objective of this row of the table alone, without constraints."""
        return replace(self, cells=self.cells.at([row]), limits=())

    def pieces(self, readings: NDArray[np.floating], hypothesis: Hypothesis) -> ReadingCosts:
        """Pieces of the cost of readings (ns, rows, channels, samples), of which the first nr rows are those of the
        table."""
        return ReadingCosts(self, hypothesis, np.asarray(readings, dtype=float))

    def soft(self, square: Floats) -> Floats:
        """Cost of squared residuals."""
        return self.robust**2 * np.log1p(square / self.robust**2)


class ReadingCosts:
    """The pieces of a cost by readings (ns, rows, channels, samples), and their roots.

    Attributes
    ----------
    failed : (ns, nr, nk)
        Whether the run of a reading did not reach its end.
    mean, scatter, pull : (ns, nr, nk)
        Mean residual z, a reading that is not there counted as zero, its variance over the windows, and z over the root
        of 1 + s^2.
    """

    def __init__(self, objective: Objective, hypothesis: Hypothesis, readings: Floats) -> None:
        self.objective, self.hypothesis, self.readings = objective, hypothesis, readings
        self.cells = objective.cells
        self.table = readings[:, : len(self.cells.observed)][:, :, list(hypothesis.columns)]
        self.failed = np.asarray(np.isinf(self.table).any(axis=-1))
        self._log, scale = self._scaled()
        u = self._log * scale[:, :, None]
        self.scatter = np.where(self.failed, 0.0, u.var(axis=-1))
        self.mean = np.where(self.failed, FAILED, u.mean(axis=-1))
        self.pull = self.mean / np.sqrt(1.0 + self.scatter)

    def _scaled(self) -> tuple[Floats, Floats]:
        """Logarithms of the values' ratios to the observed ones (ns, nr, nk, samples), and their scale (nr, nk)."""
        a, o = self.cells.absolute, np.nan_to_num(self.cells.observed)
        tau = tolerance(o, a, self.cells.relative)
        scale = np.divide(o + a, tau, out=np.ones_like(tau), where=tau > 0.0)
        whole = np.where(o + a > 0.0, o + a, 1.0)[:, :, None]
        floor = np.where(o + a > 0.0, 1e-6 * (o + a), 1.0)[:, :, None]  # a reading of zero, where nothing else is added
        values = np.maximum(np.where(np.isfinite(self.table), self.table, 0.0), 0.0)
        return np.log(np.maximum(values + a[:, :, None], floor) / whole), scale

    @cached_property
    def _pieces(self) -> Floats:
        """Costs (3, ns, nr, nk) of the cells: misfit, scatter, existence; zero where nothing is known."""
        there = np.zeros(self.pull.shape)
        for k in np.flatnonzero(self.cells.exists):
            p = existence(self.table[:, :, k], 0.5)
            there[:, :, k] = -2.0 * np.log(np.where(self.cells.observed[:, k] > 0.0, p, 1.0 - p))
        every = np.stack([self.objective.soft(self.pull**2), np.log1p(self.scatter), there])
        return np.where(self.cells.known, self.cells.weight * every, 0.0)

    @property
    def roots(self) -> Floats:
        """Residuals (ns, n): misfits, scatters, existences, constraints; the cost is the sum of their squares."""
        misfit, *others = np.sqrt(self._pieces)
        cells = [one[:, self.cells.known] for one in (np.sign(self.pull) * misfit, *others)]
        limits = [np.sqrt(self.objective.soft(self._excess(one) ** 2)) for one in self.objective.limits]
        return np.concatenate([*cells, *limits], axis=1)

    def _excess(self, limit: SoftLimit) -> Floats:
        """Excess (ns, rows) over a constraint in its softness."""
        part = self.readings[:, len(self.cells.observed) :][:, list(limit.rows), limit.channel]
        values = np.where(np.isfinite(part), part, 0.0)
        over = np.maximum(values.max(axis=-1) - limit.high, limit.low - values.min(axis=-1))
        return np.where(np.isinf(part).any(axis=-1), FAILED, np.maximum(over, 0.0) / limit.softness)

    @property
    def rows(self) -> Floats:
        """Cost of every row of the table (ns, nr)."""
        return self._pieces.sum(axis=(0, -1))

    @property
    def misfit(self) -> Floats:
        """The part of every row's cost that pulls make (ns, nr), without those of scatter and existence."""
        return self._pieces[0].sum(axis=-1)

    @property
    def limits(self) -> list[Floats]:
        """Cost of every constraint (ns,)."""
        return [self.objective.soft(self._excess(one) ** 2).sum(axis=-1) for one in self.objective.limits]

    @property
    def wrong(self) -> Floats:
        """Probability (ns, nr, nk) that the model gives to the other state of existence; NaN where that is none."""
        wrong = np.full(self.pull.shape, np.nan)
        for k in np.flatnonzero(self.cells.exists):
            p = existence(self.table[:, :, k])
            wrong[:, :, k] = np.where(self.cells.observed[:, k] > 0.0, 1.0 - p, p)
        return np.where(self.cells.known, wrong, np.nan)

    @property
    def missed(self) -> Floats:
        """Residuals (ns, nr, nk) seen from the model's side, observed less model in tolerances of the model's value;
        NaN where nothing is known."""
        a, o = self.cells.absolute, np.nan_to_num(self.cells.observed)
        mean = self._log.mean(axis=-1)  # of log((v + a) / (o + a))
        shifted = np.exp(mean) * (o + a)
        own = tolerance(np.maximum(shifted - a, 0.0), a, self.cells.relative)
        missed = -mean * np.divide(shifted, own, out=np.ones_like(own), where=own > 0.0)
        return np.where(self.cells.known, np.where(self.failed, FAILED, missed), np.nan)
