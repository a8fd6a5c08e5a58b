"""The report of a calibration: rows with fitted and left-out predictions, branches, choices, ranges of the unknowns."""

from __future__ import annotations

import math
from collections.abc import Mapping
from itertools import count
from pathlib import Path
from typing import Any

from tarsus.calibrate.account import options_word
from tarsus.files.store import package_version, write_text
from tarsus.report import calibrate_figures
from tarsus.report.calibrate_figures import row_name
from tarsus.report.html import MISSING, Cell, Column, Markup, code, escape, figure, number, page, table
from tarsus.report.style import figure_style

__all__ = ["calibration_html", "write_calibration_report"]

TOLD = 0.6
"""Correlations of at least this are listed: below it they explain less than a third of the variance."""


def write_calibration_report(result: Mapping[str, Any], path: str | Path) -> Path:
    """Write a calibration as one self-contained HTML file and return its path.

    result: the table of `tarsus.calibrate.account.calibration_table`. Raises InputError if `path` cannot be written.
    """
    target = Path(path)
    write_text(target, calibration_html(result))
    return target


def calibration_html(result: Mapping[str, Any]) -> str:
    """The page as text; see `write_calibration_report`."""
    name = str(result["study"])
    kept = sorted((one for one in result["branches"] if not one["dropped"]), key=lambda one: one["cost"])
    names = list(result["discrepancy"])
    numbers = count(1)
    parts = [
        f"<h1>Calibration: {escape(name)}</h1>\n",
        f'<p class="lede">Device {escape(str(result["device"]))}; {result["sets"]} sets of unknowns; {len(kept)} of '
        f"{len(result['branches'])} branches kept; seed {result['seed']}; Tarsus {escape(package_version())}.</p>\n",
        "<h2>How good</h2>\n",
        _summary(result),
        "<h2>Rows</h2>\n",
    ]
    with figure_style():
        parts += [figure(calibrate_figures.rows_figure(result, names), next(numbers)), _rows(result, names)]
        parts += ["<h2>Branches</h2>\n", _branches(result), _choices(result)]
        parts += ["<h2>Unknowns</h2>\n", figure(calibrate_figures.ranges(kept), next(numbers))]
    parts += [_unknowns(one) for one in kept]
    parts.append(_footer(result))
    return page(f"{name} – calibration", "".join(parts))


def _summary(result: Mapping[str, Any]) -> str:
    rows: list[list[Cell]] = []
    for what, summary in result["summary"].items():
        for name, one in (summary or {"measures": {}})["measures"].items():
            rows.append(
                [
                    name,
                    what.replace("_", " "),
                    str(one["cells"]),
                    _percent(one["mean_relative_error"]),
                    f"{number(one['mean_absolute_error'], 3)} {one['unit']}".removesuffix(" 1"),
                    _percent(one["held"]),
                    number(one["brier"], 2),
                ]
            )
    head = (
        Column("measure", number=False), Column("rows", number=False), Column("cells"), Column("mean relative error"),
        Column("mean error"), Column("in 80 % interval"), Column("Brier score of existence"),
    )  # fmt: skip
    return table(head, rows)


def _rows(result: Mapping[str, Any], names: list[str]) -> str:
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
    note = (
        "<p>P is the probability of a bounce, left out; intervals in colour do not hold the measured value. Rows "
        "without a fitted value are predictions. An asterisk: the members fall into several modes; a dagger: flights "
        "too low for the instrument, not decidable.</p>\n"
    )
    return table(columns, body, over=over) + note


def _interval(entry: Mapping[str, Any]) -> Markup:
    shown = f"{number(entry['low'], 3)} to {number(entry['high'], 3)}"
    if entry["p_bounce"] is not None:
        shown += f", P {entry['p_bounce']:.2f}"
    shown += "*" * entry["several_modes"] + "†" * (not entry["decidable"])
    kind = "n off" if entry.get("holds") is False else "n"
    return Markup(f'<td class="{kind}">{escape(shown)}</td>')


def _branches(result: Mapping[str, Any]) -> str:
    rows: list[list[Cell]] = [
        [
            options_word(one),
            number(one["cost"], 4),
            MISSING if one["dropped"] else f"{one['weight']:.2f}",
            code(one["file"]) if not one["dropped"] else escape(one["dropped"]),
            "; ".join(f"{c['name']}: {c['cost']:.2g}" for c in one.get("constraints", ()) if c["cost"] > 0.0)
            or "kept",
        ]
        for one in sorted(result["branches"], key=lambda one: one["cost"])
    ]
    within = result["within"]
    note = (
        f"<p>A branch is kept when its cost is within {within['value']:g} residual scales of the best "
        f"({escape(within['reason'])}); the residual scale is {result['residual_scale']:.2f} tolerances, "
        f"for {result['effective_unknowns']:.1f} unknowns that the table's cells determine.</p>\n"
    )
    head = (
        Column("branch", number=False), Column("cost"), Column("weight"), Column("device", number=False),
        Column("constraints", number=False),
    )  # fmt: skip
    return table(head, rows, wrap=True) + note


def _choices(result: Mapping[str, Any]) -> str:
    said = []
    for name, one in result["choices"].items():
        weights = ", ".join(f"{escape(option)} {weight:.2f}" for option, weight in one["weights"].items())
        verdict = "open: the data do not decide" if one["open"] else "decided"
        said.append(f"<p><b>{escape(name)}</b>: {weights} ({verdict}).</p>\n")
    return "".join(said)


def _unknowns(branch: Mapping[str, Any]) -> str:
    rows: list[list[Cell]] = [
        [
            name, number(one["best"], 4), f"{number(one['low'], 3)} to {number(one['high'], 3)}",
            f"{number(one['bounds'][0], 3)} to {number(one['bounds'][1], 3)}", one["unit"], one["determined"],
        ]
        for name, one in branch["unknowns"].items()
    ]  # fmt: skip
    strong = [f"{pair} {value:+.2f}" for pair, value in branch["correlations"].items() if abs(value) >= TOLD]
    said = f"<p>Correlated: {escape('; '.join(strong))}.</p>\n" if strong else ""
    head = (
        Column("unknown", number=False), Column("best"), Column("90 % range"), Column("bounds"),
        Column("unit", number=False), Column("data say", number=False),
    )  # fmt: skip
    return f"<h3>{escape(options_word(branch))}</h3>\n{table(head, rows)}{said}"


def _footer(result: Mapping[str, Any]) -> str:
    sigma = "; ".join(f"{name} {one['sigma']:.2f}" for name, one in result["discrepancy"].items())
    return (
        f"<footer><p>Made by Tarsus {escape(package_version())}. Intervals hold 80 %: spread of the unknowns, of "
        f"windows and draws, and the discrepancy of the model, in tolerances: {escape(sigma)}. Left out: refitted "
        "without the row.</p></footer>"
    )


def _percent(value: float | None) -> str:
    return MISSING if value is None or not math.isfinite(value) else f"{100.0 * value:.0f} %"
