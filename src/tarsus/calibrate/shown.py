"""A calibration as a table, for notebooks."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tarsus.tables.table import ROW, Column, Table

if TYPE_CHECKING:
    from tarsus.calibrate.calibrating import Calibrated

__all__ = ["calibration_html"]


def calibration_html(result: Calibrated) -> str:
    """The unknowns of the best branch, with the middle of the ensemble and what the data say of each."""
    solution, study = result.solution, result.described.study
    place = solution.best
    units = solution.problem.unknowns.units
    rows = [(one.name, one.best, (one.low, one.high), one.word) for one in solution.ranges[place]]
    weight = float(solution.fit.weights[place])
    title = (
        f"{study.name}: best of {len(solution.kept)} branches kept, weight {weight:.2g}; {solution.sets} sets"
    )
    columns = ("unknown", Column("best", ROW), Column("ensemble", ROW), "the data say")
    return Table(title, columns, rows, units=units).html()
