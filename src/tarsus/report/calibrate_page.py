"""The report of a calibration: rows with fitted and excluded predictions, hypotheses, choices, ranges of the unknowns."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from tarsus.calibrate.results import found_sentence, options_word
from tarsus.report import calibrate_figures
from tarsus.report.calibrate_figures import row_name
from tarsus.report.pages import page, rendered, write_page
from tarsus.tables.numbers import interval, spaced
from tarsus.tables.table import ROW, Column, Table

STRONG = 0.6
"""Correlations of at least this are listed: below it they explain less than a third of the variance."""


def write_calibration_report(result: Mapping[str, Any], path: str | Path) -> Path:
    """Write a calibration as one self-contained HTML file and return its path.

    result: the table of `tarsus.calibrate.results.calibration_json`. Raises InputError if `path` cannot be written.
    """
    return write_page(calibration_html(result), path)


def calibration_html(result: Mapping[str, Any]) -> str:
    """The page as text; see `write_calibration_report`."""
    kept = sorted((one for one in result["branches"] if not one["dropped"]), key=lambda one: one["cost"])
    names = list(result["discrepancy"])
    body = rendered(
        "calibrate.html", result=result, summary=_summary(result), rows=_rows(result, names),
        rows_figure=calibrate_figures.rows_figure(result, names), branches=_branches(result),
        ranges=calibrate_figures.ranges(kept),
        kept=[(options_word(one), found_sentence(one), _unknowns(one), _strong(one)) for one in kept],
    )  # fmt: skip
    return page(f"{result['study']} – calibration", body)


def _summary(result: Mapping[str, Any]) -> Table:
    found = [
        (name, spaced(what), one)
        for what, summary in result["summary"].items()
        for name, one in (summary or {"measures": {}})["measures"].items()
    ]
    columns = (
        "measure", "rows", "cells", Column("mean relative error", "%", 2), Column("mean error", ROW, 3),
        Column("in 80 % interval", "%", 2), Column("Brier score of existence", digits=2),
    )  # fmt: skip
    keys = ("cells", "mean_relative_error", "mean_absolute_error", "held", "brier")
    rows = [(name, what, *(one[key] for key in keys)) for name, what, one in found]
    return Table("", columns, rows, units=[one["unit"] for _, _, one in found])


def _rows(result: Mapping[str, Any], names: list[str]) -> Table:
    """Every row of the table; an interval that does not hold the measured value is flagged."""
    titles = ("measured", "fitted", "excluded", "80 % interval")
    columns = ["row", *(Column(title, digits=3, over=name) for name in names for title in titles)]
    body, flagged = [], []
    for row in result["rows"]:
        cells: list[Any] = [row_name(row)]
        for name in names:
            fitted = (row.get("training") or {}).get(name)
            new = (row.get("left_out") or row.get("predicted") or {}).get(name)
            shown: Mapping[str, Any] = new or fitted or {}
            cells += [
                shown.get("observed"),
                fitted and fitted["median"],
                new and new["median"],
                _interval(shown),
            ]
            flagged += [(len(body), len(cells) - 1)] * (shown.get("holds") is False)
        body.append(cells)
    return Table("", columns, body, flagged=flagged)


def _interval(entry: Mapping[str, Any]) -> str:
    """The interval, the probability of a bounce where it is one, and marks that the page explains."""
    bounce = "" if entry["p_bounce"] is None else f", P {entry['p_bounce']:.2f}"
    marks = "*" * entry["several_modes"] + "†" * (not entry["decidable"])
    return interval(entry["low"], entry["high"], digits=3) + bounce + marks


def _branches(result: Mapping[str, Any]) -> Table:
    rows = [
        (
            options_word(one), one["cost"], None if one["dropped"] else one["weight"], one["dropped"] or one["file"],
            "; ".join(f"{c['name']}: {c['cost']:.2g}" for c in one.get("constraints", ()) if c["cost"] > 0.0)
            or "kept",
        )
        for one in sorted(result["branches"], key=lambda one: one["cost"])
    ]  # fmt: skip
    return Table("", ("hypothesis", "cost", Column("weight", digits=2), "device", "constraints"), rows)


def _unknowns(branch: Mapping[str, Any]) -> Table:
    found = branch["unknowns"]
    rows = [
        (
            f"{name}\n{one['meaning']}" if one.get("meaning") else name, one["best"], (one["low"], one["high"]),
            tuple(one["bounds"]), one["determined"],
        )
        for name, one in found.items()
    ]  # fmt: skip
    columns = (
        "unknown",
        Column("best", ROW),
        Column("90 % range", ROW, 3),
        Column("bounds", ROW, 3),
        "data say",
    )
    return Table("", columns, rows, units=[one["unit"] for one in found.values()])


def _strong(branch: Mapping[str, Any]) -> list[tuple[str, float]]:
    """Pairs of unknowns that hang together."""
    return [(pair, value) for pair, value in branch["correlations"].items() if abs(value) >= STRONG]
