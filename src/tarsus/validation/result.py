"""What a validation found: rows, verdicts of the claims, and the tables made of them."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from tarsus.files.version import package_version
from tarsus.tables.numbers import spaced
from tarsus.tables.table import ROW, Column, Table, Tabled
from tarsus.validation.experiment import PublishedExperiment
from tarsus.validation.selection import Selection
from tarsus.validation.verdict import ClaimOutcome, ClaimVerdict, Compared, Criterion, Figures


@dataclass(frozen=True, repr=False)
class Validation(Tabled):
    """A published experiment compared with what is computed of it.

    experiment: what was compared; compared: every measured number with the computed one; verdicts: of the claims, in
    the order of their file.
    """

    experiment: PublishedExperiment
    compared: tuple[Compared, ...]
    verdicts: tuple[ClaimVerdict, ...]

    def __repr__(self) -> str:
        ended = ", ".join(f"{one.name} {one.outcome.value}" for one in self.verdicts)
        return f"<Validation '{self.experiment.name}': {len(self.compared)} numbers; {ended}>"

    @property
    def ok(self) -> bool:
        """Whether every claim came out as it was stated: those known to fail do, and all others hold."""
        return all(one.outcome.expected for one in self.verdicts)

    @property
    def problems(self) -> list[str]:
        """A sentence for every claim that did not come out as it was stated, and for every one without rows."""
        said = ((one.name, one.outcome.sentence) for one in self.verdicts)
        return [f"{self.experiment.name}: the claim '{name}' {words}" for name, words in said if words]

    def of(self, column: str) -> list[Compared]:
        """The compared numbers of a measured column."""
        return [one for one in self.compared if one.column == column]

    def claim_of(self, one: Compared) -> str:
        """Name of the first claim about a number; "" where none is."""
        own = (v.name for v in self.verdicts if v.column == one.column and Selection(v.claim.rows)(one.row))
        return next(own, "")

    def band(self, column: str) -> float | None:
        """The relative error that a claim about a column allows most rows; the widest, None where no claim says one."""
        own = [one.claim for one in self.verdicts if one.column == column]
        return max((one.within.error for one in own if one.within is not None), default=None)

    def outside(self) -> list[Compared]:
        """Numbers outside the bands of their columns, and rows without a computed number."""
        return [one for one in self.compared if not abs(one.error) <= (self.band(one.column) or float("inf"))]

    def figures(self) -> dict[str, Figures]:
        """How well each measured column agrees."""
        return {name: Figures.of(self.of(name)) for name in self.experiment.claims.measured if self.of(name)}

    def table(self) -> Table:
        """The claims with their verdicts, then how well each column agrees."""
        one = self.experiment
        return Table(f"{one.name}: {one.claims.title}", (), (), (), (claims_table(self), self.columns_table()))

    def columns_table(self) -> Table:
        """How well each measured column agrees."""
        rows = [
            (
                self.experiment.claims.measured[name].words,
                found.rows,
                found.closes,
                found.median_error,
                found.bias,
                found.mean_deviation,
            )
            for name, found in self.figures().items()
        ]
        columns = (
            "measured",
            "rows",
            Column("with a number", "%", 3),
            Column("median error", "%", 3),
            Column("bias", "%", 3),
            Column("mean deviation", ROW, 3),
        )
        return Table("", columns, rows, units=[self.experiment.claims.measured[name].si for name in self.figures()])

    def rows_table(self, compared: list[Compared]) -> Table:
        """Compared numbers, each row by its cells."""
        measured = self.experiment.claims.measured
        rows = [
            (
                one.line,
                self.experiment.measured.words(one.number, measured),
                measured[one.column].words,
                one.measured,
                one.computed,
                one.error,
                one.ended,
            )
            for one in compared
        ]
        columns = (
            "line",
            "row",
            "what",
            Column("measured", ROW),
            Column("computed", ROW),
            Column("error", "%", 3),
            "remark",
        )
        return Table("", columns, rows, units=[measured[one.column].si for one in compared])

    def csv(self) -> str:
        """Every row with its cells, the measured and the computed number [SI]."""
        known = self.experiment.measured.columns
        out = io.StringIO()
        writer = csv.writer(out, lineterminator="\n")
        writer.writerow([*known, "what", "unit", "measured_si", "computed_si", "error"])
        for one in self.compared:
            unit = self.experiment.claims.measured[one.column].si
            cells = [one.row.get(name, "") for name in known]
            writer.writerow([*cells, one.column, unit, one.measured, one.computed, one.error])
        return out.getvalue()

    def to_dict(self) -> dict[str, Any]:
        """Plain data: claims with verdicts, how well each column agrees, and every row."""
        one = self.experiment
        return {
            "tarsus": package_version(),
            "name": one.name,
            "title": one.claims.title,
            "ok": self.ok,
            "source": one.claims.source.model_dump(),
            "parameters": one.claims.parameters.model_dump(),
            "rows": len(one.measured),
            "numbers": len(self.compared),
            "claims": [verdict.to_dict() for verdict in self.verdicts],
            "columns": {
                name: {
                    "words": one.claims.measured[name].words,
                    "unit": one.claims.measured[name].si,
                    "rows": found.rows,
                    "closes": found.closes,
                    "median_error": found.median_error,
                    "bias": found.bias,
                    "mean_deviation": found.mean_deviation,
                    "r2": found.r2,
                }
                for name, found in self.figures().items()
            },
            "variants": dict(one.claims.variants),
            "compared": [
                {
                    "line": row.line,
                    "column": row.column,
                    "row": dict(row.row),
                    "measured": row.measured,
                    "spread": row.spread,
                    "computed": row.computed,
                    "error": row.error,
                }
                for row in self.compared
            ],
        }


def claims_table(found: Validation) -> Table:
    """The claims of an experiment, a row a criterion: what was found, what was claimed, and the verdict."""
    rows: list[tuple[Any, ...]] = []
    flagged: list[tuple[int, int]] = []
    for one in found.verdicts:
        words = found.experiment.claims.measured[one.column].words
        for place, criterion in enumerate(one.criteria):
            head = (one.name, words, one.figures.rows, one.claim.seen.value, one.claim.when)
            shown, claimed = _criterion(criterion)
            verdict = one.outcome.value if place == 0 else ""
            rows.append((*(head if place == 0 else ("", "", None, "", "")), criterion.words, shown, claimed, verdict))
            if place == 0 and one.outcome is not ClaimOutcome.HOLDS:
                flagged.append((len(rows) - 1, len(rows[-1]) - 1))
    columns = ("claim", "of", "rows", "seen", "written", "figure", "found", "claimed", "verdict")
    return Table("", columns, rows, flagged=flagged)


def _criterion(one: Criterion) -> tuple[str, str]:
    """What was found, and what was claimed, in words."""
    column = Column("", one.unit, 3)
    least, most = (None if end is None else column.shown(end, one.unit) for end in (one.least, one.most))
    claimed = f"{least} to {most}" if least and most else f"at least {least}" if least else f"at most {most}"
    return column.shown(one.found, one.unit) if math.isfinite(one.found) else "none", claimed


@dataclass(frozen=True, repr=False)
class Suite(Tabled):
    """Several experiments, by name."""

    validations: Mapping[str, Validation]

    def __repr__(self) -> str:
        return f"<Suite of {len(self.validations)} experiments, {self.numbers} numbers>"

    @property
    def ok(self) -> bool:
        """Whether every claim of every experiment came out as it was stated."""
        return all(one.ok for one in self.validations.values())

    @property
    def problems(self) -> list[str]:
        """Those of all."""
        return [said for one in self.validations.values() for said in one.problems]

    @property
    def numbers(self) -> int:
        """Measured numbers that were compared, formulas aside."""
        return sum(len(rows) for one in self.validations.values() for rows in _of_others(one).values())

    def table(self) -> Table:
        """A row a claim of every experiment, with its verdict."""
        rows, flagged = [], []
        for name, one in self.validations.items():
            for verdict in one.verdicts:
                found, words = verdict.figures, one.experiment.claims.measured[verdict.column].words
                if verdict.outcome is not ClaimOutcome.HOLDS:
                    flagged.append((len(rows), 7))
                rows.append(
                    (
                        name,
                        spaced(verdict.name),
                        words,
                        found.rows,
                        found.closes,
                        found.median_error,
                        found.bias,
                        verdict.outcome.value,
                    )
                )
        columns = (
            "experiment",
            "claim",
            "of",
            "rows",
            Column("with a number", "%", 3),
            Column("median error", "%", 3),
            Column("bias", "%", 3),
            "verdict",
        )
        fitted = sum(len(one.experiment.claims.parameters.fitted) for one in self.validations.values())
        said = f"{len(self.validations)} experiments, {self.numbers} measured numbers, {fitted} fitted"
        return Table(said, columns, rows, flagged=flagged)

    def to_dict(self) -> dict[str, Any]:
        """Plain data by experiment."""
        experiments = {name: one.to_dict() for name, one in self.validations.items()}
        return {"tarsus": package_version(), "ok": self.ok, "numbers": self.numbers, "experiments": experiments}


def _of_others(one: Validation) -> dict[str, list[Compared]]:
    """Compared numbers by measured column, without those of formulas."""
    measured = one.experiment.claims.measured
    return {name: one.of(name) for name in measured if not measured[name].formula}
