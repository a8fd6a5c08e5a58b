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
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

__all__ = ["FAILED", "Branch", "Cells", "Costs", "Limit", "Objective", "existence", "tolerance"]

Floats = NDArray[np.float64]

FAILED = 1e3
"""Residual of a run that did not reach its end: beyond every other, and finite, so that a search can go on."""


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

    def at(self, rows: Sequence[int]) -> Cells:
        """Cells of some of the rows."""
        chosen = list(rows)
        return replace(self, observed=self.observed[chosen], absolute=self.absolute[chosen])


@dataclass(frozen=True)
class Branch:
    """One combination of options: its run branch, and the channel that each measure of the table is (nk,)."""

    options: dict[str, str]
    run: int
    columns: tuple[int, ...]

    @property
    def name(self) -> str:
        """Its options in words."""
        return ", ".join(f"{choice} {option}" for choice, option in self.options.items()) or "the only one"


@dataclass(frozen=True)
class Limit:
    """A channel stays between bounds in some of the simulated rows (places among them)."""

    name: str
    rows: tuple[int, ...]
    channel: int
    low: float
    high: float
    softness: float


@dataclass(frozen=True)
class Costs:
    """Costs of ns sets: by row of the table (ns, nr), by constraint (ns, nl); residuals (ns, nr, nk), NaN where
    unknown; pulls (ns, nr, nk): residuals over the root of 1 + s^2, tolerance and scatter of a window together;
    missed (ns, nr, nk): residuals seen from the model's side, observed less model in tolerances of the model's value;
    wrong (ns, nr, nk): probability that the model gives to the other state of existence, NaN where that is none;
    misfit (ns, nr): the part of a row's cost that pulls make, without those of scatter and existence."""

    rows: Floats
    limits: Floats
    residuals: Floats
    pulls: Floats
    missed: Floats
    wrong: Floats
    misfit: Floats


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
    """Costs of readings against cells and constraints."""

    cells: Cells
    limits: tuple[Limit, ...] = ()
    robust: float = 3.0

    def only(self, row: int) -> Objective:
        """Of one row of the table, without constraints."""
        return replace(self, cells=self.cells.at([row]), limits=())

    def without(self, row: int) -> Objective:
        """Of the other rows of the table, and of constraints in other runs than its."""
        kept = self.cells.at([n for n in range(len(self.cells.observed)) if n != row])
        limits = [
            replace(one, rows=tuple(n - (n > row) for n in one.rows if n != row)) for one in self.limits
        ]
        return replace(self, cells=kept, limits=tuple(one for one in limits if one.rows))

    def __call__(self, readings: NDArray[np.floating], branch: Branch) -> Costs:
        """Costs of readings (ns, rows, channels, samples), of which the first nr rows are those of the table."""
        seen = np.asarray(readings, dtype=float)
        nr = len(self.cells.observed)
        table = seen[:, :nr][:, :, list(branch.columns)]
        z, scatter, missed = self._residuals(table)
        known = np.isfinite(self.cells.observed)
        pulls = z / np.sqrt(1.0 + scatter)
        misfit = self.soft(pulls**2)
        cost = misfit + np.log1p(scatter)
        wrong = np.full(z.shape, np.nan)
        for k in np.flatnonzero(self.cells.exists):
            there = self.cells.observed[:, k] > 0.0
            p, careful = existence(table[:, :, k]), existence(table[:, :, k], 0.5)
            wrong[:, :, k] = np.where(there, 1.0 - p, p)
            cost[:, :, k] -= 2.0 * np.log(np.where(there, careful, 1.0 - careful))
        cost = np.where(known, cost, 0.0) * self.cells.weight
        return Costs(
            cost.sum(axis=-1),
            np.stack([self._limit(seen, one) for one in self.limits], axis=-1)
            if self.limits
            else np.zeros((len(seen), 0)),
            np.where(known, z, np.nan),
            np.where(known, pulls, np.nan),
            np.where(known, missed, np.nan),
            np.where(known, wrong, np.nan),
            (np.where(known, misfit, 0.0) * self.cells.weight).sum(axis=-1),
        )

    def soft(self, square: Floats) -> Floats:
        """Cost of squared residuals."""
        return self.robust**2 * np.log1p(square / self.robust**2)

    def scaled(self, table: Floats) -> tuple[Floats, Floats, Floats]:
        """Values (ns, nr, nk, samples) as ratios to the observed ones, the scale (nr, nk) of their logarithms, and the
        derivative (ns, nr, nk, samples) of the scaled logarithm by the value; one that is not there counts as zero."""
        a, o = self.cells.absolute, np.nan_to_num(self.cells.observed)
        tau = tolerance(o, a, self.cells.relative)
        scale = np.divide(o + a, tau, out=np.ones_like(tau), where=tau > 0.0)
        whole = np.where(o + a > 0.0, o + a, 1.0)[:, :, None]
        floor = np.where(o + a > 0.0, 1e-6 * (o + a), 1.0)[:, :, None]
        values = np.maximum(np.where(np.isfinite(table), table, 0.0), 0.0)
        held = np.maximum(values + a[:, :, None], floor)
        moves = (values > 0.0) & (held > floor)
        return held / whole, scale, np.where(moves, scale[:, :, None] / held, 0.0)

    def _residuals(self, table: Floats) -> tuple[Floats, Floats, Floats]:
        """Mean residual, its variance over the windows, and the residual on the model's own scale (ns, nr, nk); a
        measure that is not there counts as zero."""
        a, o = self.cells.absolute, np.nan_to_num(self.cells.observed)
        ratio, scale, _ = self.scaled(table)
        failed = np.isinf(table).any(axis=-1)
        u = np.log(ratio) * scale[:, :, None]
        z = np.where(failed, FAILED, u.mean(axis=-1))
        mean = np.log(ratio).mean(axis=-1)  # of log((v + a) / (o + a))
        shifted = np.exp(mean) * (o + a)
        own = tolerance(np.maximum(shifted - a, 0.0), a, self.cells.relative)
        missed = -mean * np.divide(shifted, own, out=np.ones_like(own), where=own > 0.0)
        return z, np.where(failed, 0.0, u.var(axis=-1)), np.where(failed, FAILED, missed)

    def _limit(self, seen: Floats, limit: Limit) -> Floats:
        part = seen[:, list(limit.rows), limit.channel]
        failed = np.isinf(part).any(axis=-1)
        values = np.where(np.isfinite(part), part, 0.0)
        over = np.maximum(values.max(axis=-1) - limit.high, limit.low - values.min(axis=-1))
        excess = np.where(failed, FAILED, np.maximum(over, 0.0) / limit.softness)
        return self.soft(excess**2).sum(axis=-1)
