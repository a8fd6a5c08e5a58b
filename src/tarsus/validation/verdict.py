"""Claims against compared rows: which criteria hold, with the figures that they go by."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tarsus.base.units import parse_quantity
from tarsus.validation.claims import MeasuredColumn, StatedClaim
from tarsus.validation.selection import Row


@dataclass(frozen=True)
class Compared:
    """A measured number compared with the computed one.

    number, line: of the row in its table and file; column: what was measured; measured, spread, computed [SI]; spread
    is None where none is stated, computed NaN where the run does not give the number; ended: how the run ended, where
    it stopped early.
    """

    number: int
    line: int
    row: Row
    column: str
    measured: float
    spread: float | None
    computed: float
    ended: str = ""

    @property
    def error(self) -> float:
        """Computed over measured, less one; NaN where there is no number, or 0 was measured."""
        return self.computed / self.measured - 1.0 if self.measured else math.nan


class ClaimOutcome(Enum):
    """What became of a claim; the value is a word for it."""

    HOLDS = "holds"
    FAILS = "fails"
    FAILS_AS_KNOWN = "fails, as known"
    HOLDS_UNEXPECTEDLY = "holds, though known to fail"
    NO_ROWS = "no rows"

    @property
    def expected(self) -> bool:
        """Whether the claim is as it was stated; one without rows is not judged."""
        return self not in (ClaimOutcome.FAILS, ClaimOutcome.HOLDS_UNEXPECTEDLY)

    @property
    def sentence(self) -> str:
        """What to say of a claim with this outcome, behind its name; "" where there is nothing to say."""
        return {
            ClaimOutcome.FAILS: "fails",
            ClaimOutcome.HOLDS_UNEXPECTEDLY: "holds, though it is known to fail",
            ClaimOutcome.NO_ROWS: "selects no rows and is not judged",
        }.get(self, "")


@dataclass(frozen=True)
class Figures:
    """How well rows agree.

    rows: how many; closes: share of them with a computed number; median_error of sizes, with a row without a number as
    the worst; bias: median error of the others; mean_deviation [SI]; r2: coefficient of determination of the computed
    numbers as they are; errors (n,): sizes, infinite without a number. A row of which 0 was measured has no relative
    error, and counts for closes, mean_deviation and r2 alone.
    """

    rows: int
    closes: float
    median_error: float
    bias: float
    mean_deviation: float
    r2: float
    errors: NDArray[np.float64]

    @classmethod
    def of(cls, compared: Sequence[Compared]) -> Figures:
        """Figures of some rows of one column; NaN where rows leave none."""
        if not compared:
            none = math.nan
            return cls(0, none, none, none, none, none, np.zeros(0))
        measured, computed = (np.array([getattr(one, name) for one in compared]) for name in ("measured", "computed"))
        there = np.isfinite(computed)
        relative = np.array([one.error for one in compared if one.measured])
        sizes = np.where(np.isfinite(relative), np.abs(relative), np.inf)
        signed = relative[np.isfinite(relative)]
        off = (computed - measured)[there]
        spread = float(np.sum((measured - measured.mean()) ** 2))
        return cls(
            len(compared),
            float(there.mean()),
            float(np.median(sizes)) if len(sizes) else math.nan,
            float(np.median(signed)) if len(signed) else math.nan,
            float(np.mean(np.abs(off))) if len(off) else math.nan,
            1.0 - float(np.sum(off**2)) / spread if spread and there.all() else math.nan,
            sizes,
        )

    def share_within(self, error: float) -> float:
        """Share of the rows with at most a relative error."""
        return float(np.mean(self.errors <= error)) if len(self.errors) else math.nan


@dataclass(frozen=True)
class Criterion:
    """One number that a claim bounds: words, found [unit], least and greatest that are claimed."""

    words: str
    found: float
    least: float | None
    most: float | None
    unit: str = "%"

    @property
    def met(self) -> bool:
        """Whether the number is there and within its bounds."""
        above = self.least is None or self.found >= self.least
        return math.isfinite(self.found) and above and (self.most is None or self.found <= self.most)


@dataclass(frozen=True)
class ClaimVerdict:
    """A claim with what became of it."""

    name: str
    claim: StatedClaim
    column: str
    figures: Figures
    criteria: tuple[Criterion, ...]

    @property
    def outcome(self) -> ClaimOutcome:
        """Whether it holds, and whether that was known."""
        if not self.figures.rows:
            return ClaimOutcome.NO_ROWS
        if all(one.met for one in self.criteria):
            return ClaimOutcome.HOLDS_UNEXPECTEDLY if self.claim.should_fail else ClaimOutcome.HOLDS
        return ClaimOutcome.FAILS_AS_KNOWN if self.claim.should_fail else ClaimOutcome.FAILS

    def to_dict(self) -> dict[str, Any]:
        """As plain data."""
        return {
            "name": self.name,
            "column": self.column,
            "where": self.claim.rows,
            "rows": self.figures.rows,
            "outcome": self.outcome.value,
            "expected": self.outcome.expected,
            "seen": self.claim.seen.value,
            "closes": self.figures.closes,
            "median_error": self.figures.median_error,
            "bias": self.figures.bias,
            "written": self.claim.written.isoformat(),
            "after_run": self.claim.after_run,
            "should_fail": self.claim.should_fail,
            "note": self.claim.note,
            "criteria": [
                {
                    "words": one.words,
                    "found": one.found,
                    "least": one.least,
                    "most": one.most,
                    "unit": one.unit,
                    "met": one.met,
                }
                for one in self.criteria
            ],
        }


def judged(
    name: str, claim: StatedClaim, column: str, measured: MeasuredColumn, compared: Sequence[Compared]
) -> ClaimVerdict:
    """A claim about a column, judged by its rows."""
    figures = Figures.of(compared)
    criteria: list[Criterion] = []
    if claim.median_error is not None:
        criteria.append(Criterion("median error", figures.median_error, None, claim.median_error))
    if (within := claim.within) is not None:
        words = f"within {100.0 * within.error:g} %"
        criteria.append(Criterion(words, figures.share_within(within.error), within.share, None))
    if claim.bias is not None:
        criteria.append(Criterion("bias", figures.bias, *claim.bias))
    if claim.mean_deviation is not None:
        most = parse_quantity(claim.mean_deviation, measured.si)
        criteria.append(Criterion("mean deviation", figures.mean_deviation, None, most, measured.si))
    if claim.closes is not None:
        criteria.append(Criterion("rows with a number", figures.closes, claim.closes, None))
    if claim.r2 is not None:
        criteria.append(Criterion("R²", figures.r2, claim.r2, None, "1"))
    return ClaimVerdict(name, claim, column, figures, tuple(criteria))
