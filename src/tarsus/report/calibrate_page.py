"""The report of a calibration: rows with fitted and excluded predictions, hypotheses, choices, ranges of unknowns."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from tarsus.calibrate.results import (
    calibration_table,
    errors_table,
    found_sentence,
    options_word,
    unknowns_table,
)
from tarsus.report import calibrate_figures
from tarsus.report.calibrate_figures import row_name
from tarsus.report.pages import page, rendered
from tarsus.tables.numbers import interval
from tarsus.tables.table import Column, Table

STRONG = 0.6
"""Correlations of at least this are listed: below it they explain less than a third of the variance."""


def calibration_html(result: Mapping[str, Any]) -> str:
    """The page of a result, as text."""
    kept = sorted((one for one in result["branches"] if not one["dropped"]), key=lambda one: one["cost"])
    names = list(result["discrepancy"])
    body = rendered(
        "calibrate.html", result=result, summary=errors_table(result["summary"]).bare(), rows=_rows(result, names),
        rows_figure=calibrate_figures.predictions_figure(result, names), branches=calibration_table(result).bare(),
        ranges=calibrate_figures.ranges(kept),
        kept=[
            (options_word(one), found_sentence(one), unknowns_table(one, meanings=True).bare(), _strong(one))
            for one in kept
        ],
    )  # fmt: skip
    return page(f"{result['study']} – calibration", body)


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


def _strong(branch: Mapping[str, Any]) -> list[tuple[str, float]]:
    """Pairs of unknowns that hang together."""
    return [(pair, value) for pair, value in branch["correlations"].items() if abs(value) >= STRONG]
