"""The report of a calibration: rows with fitted and left-out predictions, branches, choices, ranges of the unknowns."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from tarsus.calibrate.results import found_sentence, options_word
from tarsus.files.store import write_text
from tarsus.report import calibrate_figures
from tarsus.report.calibrate_figures import row_name
from tarsus.report.html import MISSING, Cell, Column, Markup, code, number, page, table
from tarsus.report.render import rendered

__all__ = ["calibration_html", "write_calibration_report"]

TOLD = 0.6
"""Correlations of at least this are listed: below it they explain less than a third of the variance."""


def write_calibration_report(result: Mapping[str, Any], path: str | Path) -> Path:
    """Write a calibration as one self-contained HTML file and return its path.

    result: the table of `tarsus.calibrate.results.calibration_json`. Raises InputError if `path` cannot be written.
    """
    target = Path(path)
    write_text(target, calibration_html(result))
    return target


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


def _summary(result: Mapping[str, Any]) -> Markup:
    rows: list[list[Cell]] = []
    for what, summary in result["summary"].items():
        for name, one in (summary or {"measures": {}})["measures"].items():
            rows.append(
                [
                    name,
                    what.replace("_", " "),
                    str(one["cells"]),
                    _percent(one["mean_relative_error"]),
                    _with_unit(one["mean_absolute_error"], one["unit"]),
                    _percent(one["held"]),
                    number(one["brier"], 2),
                ]
            )
    head = (
        Column("measure", number=False), Column("rows", number=False), Column("cells"), Column("mean relative error"),
        Column("mean error"), Column("in 80 % interval"), Column("Brier score of existence"),
    )  # fmt: skip
    return table(head, rows)


def _rows(result: Mapping[str, Any], names: list[str]) -> Markup:
    columns = [Column("row", number=False)]
    over = [("", 1)]
    for name in names:
        columns += [Column("measured"), Column("fitted"), Column("left out"), Column("80 % interval")]
        over.append((name, 4))
    body = []
    for row in result["rows"]:
        cells: list[Cell] = [row_name(row)]
        for name in names:
            fitted = (row.get("training") or {}).get(name)
            new = (row.get("left_out") or row.get("predicted") or {}).get(name)
            shown: Mapping[str, Any] = new or fitted or {}
            cells += [
                number(shown.get("observed"), 3), number(fitted["median"], 3) if fitted else MISSING,
                number(new["median"], 3) if new else MISSING, _interval(shown),
            ]  # fmt: skip
        body.append(cells)
    return table(columns, body, over=over)


def _interval(entry: Mapping[str, Any]) -> Markup:
    shown = f"{number(entry['low'], 3)} to {number(entry['high'], 3)}"
    if entry["p_bounce"] is not None:
        shown += f", P {entry['p_bounce']:.2f}"
    shown += "*" * entry["several_modes"] + "†" * (not entry["decidable"])
    kind = "n off" if entry.get("holds") is False else "n"
    return Markup('<td class="{}">{}</td>').format(kind, shown)


def _branches(result: Mapping[str, Any]) -> Markup:
    rows: list[list[Cell]] = [
        [
            options_word(one),
            number(one["cost"], 4),
            MISSING if one["dropped"] else f"{one['weight']:.2f}",
            one["dropped"] or code(one["file"]),
            "; ".join(f"{c['name']}: {c['cost']:.2g}" for c in one.get("constraints", ()) if c["cost"] > 0.0)
            or "kept",
        ]
        for one in sorted(result["branches"], key=lambda one: one["cost"])
    ]
    head = (
        Column("branch", number=False), Column("cost"), Column("weight"), Column("device", number=False),
        Column("constraints", number=False),
    )  # fmt: skip
    return table(head, rows)


def _unknowns(branch: Mapping[str, Any]) -> Markup:
    rows: list[list[Cell]] = [
        [
            Markup("{}<small>{}</small>").format(name, one.get("meaning", "")), number(one["best"], 4),
            f"{number(one['low'], 3)} to {number(one['high'], 3)}",
            f"{number(one['bounds'][0], 3)} to {number(one['bounds'][1], 3)}", one["unit"].removesuffix("1"),
            one["determined"],
        ]
        for name, one in branch["unknowns"].items()
    ]  # fmt: skip
    head = (
        Column("unknown", number=False), Column("best"), Column("90 % range"), Column("bounds"),
        Column("unit", number=False), Column("data say", number=False),
    )  # fmt: skip
    return table(head, rows)


def _strong(branch: Mapping[str, Any]) -> list[tuple[str, float]]:
    """Pairs of unknowns that hang together."""
    return [(pair, value) for pair, value in branch["correlations"].items() if abs(value) >= TOLD]


def _with_unit(value: float, unit: str) -> str:
    """A number in the unit of its table, which may bear a prefix already."""
    return f"{number(value, 3)} {unit}".removesuffix(" 1")


def _percent(value: float | None) -> str:
    return MISSING if value is None or not math.isfinite(value) else f"{100.0 * value:.0f} %"
