"""Comparison against a table of experiments: every row with its errors, a figure, and the summary."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import count
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator

from tarsus.files.version import package_version
from tarsus.files.whole import write_text
from tarsus.report.figures import Plate
from tarsus.report.html import MISSING, Cell, Column, Markup, escape, figure, number, page, sentences, table
from tarsus.report.sheet import Sheet, plate
from tarsus.report.style import BLUE, INK, ORANGE, RULE

NOTABLE = 0.30
"""Relative error beyond which a cell is coloured; the source counts cases below it."""


@dataclass(frozen=True)
class _Quantity:
    key: str
    title: str
    unit: str


QUANTITIES = (
    _Quantity("bounces", "bounces", ""),
    _Quantity("peak_um", "peak", "µm"),
    _Quantity("contact_ms", "contact", "ms"),
)

COMPARISONS = {
    "source": "source's model against measured",
    "ours": "Tarsus against measured",
    "ours_against_source": "Tarsus against source's model",
}
"""Names in a summary -> what they compare."""

MERITS = {
    "existence_right": "presence of bounces right (cases)",
    "count_right": "number of bounces right (cases)",
    "count_cases": "cases with a number of bounces",
    "mean_count_error": "mean error of the number of bounces",
    "peak.cases": "peak: cases compared",
    "peak.below_30_percent": "peak: cases with error below 30 %",
    "contact.cases": "contact: cases compared",
    "contact.below_30_percent": "contact: cases with error below 30 %",
    "peak_within_15_percent": "peak within 15 % (cases)",
    "contact_within_30_percent_or_1_ms": "contact within 30 % or 1 ms (cases)",
}
"""Figures of merit whose key alone would not say enough."""

MODELS = (("measured", "measured"), ("source", "source's model"), ("ours", "Tarsus"))


def write_cantilever_report(result: Mapping[str, Any], path: str | Path) -> Path:
    """Write a reproduction as one self-contained HTML file and return its path.

    `result` is what `tarsus reproduce --json` prints: `device`, `rows` (each `freq_hz`, `volt_v`, `wave`, and
    `source`, `measured` (either may be None), `ours`, each with `bounces`, `peak_um`, `contact_ms`) and
    `summary`. Raises InputError if `path` cannot be written.
    """
    target = Path(path)
    write_text(target, cantilever_html(result))
    return target


def cantilever_html(result: Mapping[str, Any]) -> str:
    """The page as text; see `write_cantilever_report`."""
    device = str(result["device"])
    parts = [
        f"<h1>Reproduction of {escape(device)}</h1>\n",
        f'<p class="lede">{len(result["rows"])} periodic drives; Tarsus {escape(package_version())}.</p>\n',
        "<h2>Summary</h2>\n",
        summary_table(result["summary"]),
        _calibration_section(result.get("calibration")),
        "<h2>Row by row</h2>\n",
    ]
    parts.append(rows_section(result["rows"], count(1)))
    parts.append(
        f"<footer><p>Made by Tarsus {escape(package_version())}. Bounces are flights above 0.1 µm that "
        "follow a contact shorter than 0.5 ms or a tenth of the period, however they began; peak is the "
        "height above contact level after break-off, contact the time per drive period on the ground."
        "</p></footer>"
    )
    return page(f"{device} – reproduction", "".join(parts))


def _calibration_section(calibration: Mapping[str, Any] | None) -> str:
    """What the calibration says of fitted rows and of each row left out; nothing without one."""
    if calibration is None:
        return ""
    parts = [("calibrated on", calibration["training"]), ("left out", calibration["left_out"])]
    parts = [(title, part) for title, part in parts if part is not None]
    columns = [Column("measure", number=False)]
    keys = (("mean_relative_error", "relative error"), ("held", "in 80 %"), ("brier", "Brier"))
    columns += [Column(words) for _ in parts for _, words in keys]
    body: list[list[Cell]] = []
    for name in calibration["training"]["measures"]:
        cells: list[Cell] = [name]
        for _, part in parts:
            for key, _ in keys:
                value = part["measures"][name][key]
                percent = key != "brier"
                cells.append(
                    MISSING if value is None else f"{100 * value:.0f} %" if percent else f"{value:.2f}"
                )
        body.append(cells)
    note = (
        "<p>The mixture's medians against the measurement over the rows it was fitted to, and over each row as it was "
        "predicted by a search that never had it: mean absolute relative error, values in the 80 % interval, "
        "and the Brier score of existence (a coin has 0.25).</p>\n"
    )
    shown = table(columns, body, over=[("", 1), *((title, len(keys)) for title, _ in parts)])
    told = sentences(calibration.get("told", ()))
    return f"<h2>Calibrated on and left out</h2>\n{shown}{note}{told}"


def rows_section(rows: Sequence[Mapping[str, Any]], numbers: Iterator[int]) -> str:
    """Figure and table of reproduction rows."""
    return f"{figure(comparison(rows), next(numbers))}{_rows_table(rows)}"


def comparison(rows: Sequence[Mapping[str, Any]]) -> Plate:
    """Every case as one line, measured, source's model and ours as dots; one panel per quantity."""
    words = [_case(row) for row in rows]

    def draw(sheet: Sheet) -> None:
        panels = sheet.grid(len(QUANTITIES), 0.25 * len(rows))
        for axes, quantity in zip(panels, QUANTITIES, strict=True):
            _compared(axes, rows, quantity)
            axes.set_yticks(range(len(rows)), words)
            axes.set_ylim(len(rows) - 0.5, -0.5)
        sheet.legend(panels[1])

    return plate(
        draw,
        "Bounces per period, peak after break-off and contact duration per period of every case, bars are our 80 % "
        "intervals; the axis of contact durations is linear below 1 ms and logarithmic above.",
    )


def _compared(axes: Axes, rows: Sequence[Mapping[str, Any]], quantity: _Quantity) -> None:
    """One quantity of all cases."""
    looks = {
        "measured": {"marker": "o", "color": INK, "ms": 6.0, "mfc": "white", "mew": 1.2},
        "source": {"marker": "s", "color": ORANGE, "ms": 4.2, "mew": 0.0},
        "ours": {"marker": "D", "color": BLUE, "ms": 4.6, "mew": 0.0},
    }
    lines = np.arange(len(rows))
    axes.hlines(lines, 0.0, 1.0, transform=axes.get_yaxis_transform(), color=RULE, lw=0.6, zorder=0)
    ends = np.array([[_get(row, "ours", quantity.key, end) for end in ("low", "high")] for row in rows])
    axes.hlines(lines, ends[:, 0], ends[:, 1], color=BLUE, lw=1.1, zorder=3)
    for who, label in MODELS:
        values = np.array([_get(row, who, quantity.key) for row in rows])
        axes.plot(values, lines, ls="none", label=label, zorder=4 if who == "ours" else 3, **looks[who])
    axes.set_xlabel(f"{quantity.title} ({quantity.unit})" if quantity.unit else quantity.title)
    axes.spines["left"].set_visible(False)
    axes.tick_params(axis="y", length=0)
    if quantity.key == "bounces":
        axes.xaxis.set_major_locator(MaxNLocator(6, integer=True))
    if quantity.key == "contact_ms":
        _stretch(axes)
    else:
        axes.set_xlim(left=0.0 if quantity.key == "peak_um" else -0.4)


def _stretch(axes: Axes) -> None:
    """A scale that shows 0 and both 1 and 100 ms."""
    axes.set_xscale("symlog", linthresh=1.0, linscale=0.5)
    axes.set_xticks([0.0, 1.0, 3.0, 10.0, 30.0, 100.0], ["0", "1", "3", "10", "30", "100"])
    axes.set_xticks([], minor=True)
    axes.set_xlim(-0.2, max(140.0, axes.get_xlim()[1]))


def _rows_table(rows: Sequence[Mapping[str, Any]]) -> str:
    columns = [Column("case", number=False), Column("role", number=False)]
    over = [("", 2)]
    for quantity in QUANTITIES:
        columns += [Column("measured"), Column("source"), Column("Tarsus"), Column("80 %"), Column("error")]
        over.append((f"{quantity.title} ({quantity.unit})" if quantity.unit else quantity.title, 5))
    columns.append(Column("periods with a bounce"))
    over.append(("", 1))
    body: list[list[Cell]] = []
    for row in rows:
        cells: list[Cell] = [_case(row).replace(" ", "\u00a0"), str(row.get("role", ""))]
        for quantity in QUANTITIES:
            measured, ours = _get(row, "measured", quantity.key), _get(row, "ours", quantity.key)
            cells += [number(value, 3) for value in (measured, _get(row, "source", quantity.key), ours)]
            low, high = (number(_get(row, "ours", quantity.key, end), 3) for end in ("low", "high"))
            cells.append(f"{low}–{high}" if low != high else low)
            cells.append(_error_cell(measured, ours, relative=quantity.key != "bounces"))
        chance = row.get("p_bounce")
        cells.append(MISSING if chance is None else f"{100.0 * chance:.0f} %")
        body.append(cells)
    note = (
        "<p>Tarsus is the median over drive periods after transients, 80 % the interval that holds 80 % "
        "of them; for a mixture also over its members, and over what the model misses of rows left out. "
        "Error is (measured − Tarsus) / measured, as the source gives it, and a difference for bounces; "
        f"errors beyond {100 * NOTABLE:.0f} % are coloured.</p>\n"
    )
    return f"{table(columns, body, over=over)}{note}"


def _error_cell(measured: float, ours: float, *, relative: bool) -> Markup:
    difference = measured - ours
    if not math.isfinite(difference):
        return Markup(f"<td class=n>{MISSING}</td>")
    if not relative:
        shown, off = f"{difference:+.3g}" if difference else "0", abs(difference) >= 0.5
    elif difference == 0.0 or abs(difference) < 0.005 * measured:
        shown, off = "0 %", False
    elif measured == 0.0:
        shown, off = MISSING, True
    else:
        error = difference / measured
        shown, off = f"{100.0 * error:+.0f} %", abs(error) > NOTABLE
    kind = "n off" if off else "n"
    return Markup(f'<td class="{kind}">{shown.replace("-", "−")}</td>')


def summary_table(summary: Mapping[str, Any]) -> str:
    """Figures of merit of each comparison side by side; groups of rows (packaged, added) one table each."""
    own = {name: entry for name, entry in summary.items() if name in COMPARISONS}
    out = ""
    if own:
        flat = {name: dict(_flat(entry)) for name, entry in own.items()}
        keys = list(dict.fromkeys(key for entry in flat.values() for key in entry))
        columns = [Column("figure of merit", number=False), *(Column(COMPARISONS[name]) for name in own)]
        rows = [[_words(key), *(_merit(key, entry.get(key)) for entry in flat.values())] for key in keys]
        out += table(columns, rows)
    for name, entry in summary.items():
        if name not in COMPARISONS and isinstance(entry, Mapping):
            title = f"{name.replace('_', ' ').capitalize()} ({entry['rows']})" if "rows" in entry else name
            out += f"<h3>{escape(title)}</h3>\n{summary_table(entry)}"
    return out


def _flat(entry: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, Any]]:
    for name, value in entry.items():
        if isinstance(value, Mapping):
            yield from _flat(value, f"{prefix}{name}.")
        else:
            yield f"{prefix}{name}", value


def _merit(key: str, value: Any) -> str:
    if value is None:
        return MISSING
    return number(float(value), 3) + (" %" if key.endswith(("_signed_percent", "_absolute_percent")) else "")


def _words(key: str) -> str:
    if key in MERITS:
        return MERITS[key].replace(" %", "\u00a0%")
    for ending, words in (("_signed_percent", " signed error"), ("_absolute_percent", " absolute error")):
        key = key.replace(ending, words)
    return key.replace("_percent", " %").replace("_", " ").replace(".", ": ")


def _case(row: Mapping[str, Any]) -> str:
    return f"{number(float(row['freq_hz']))} Hz {number(float(row['volt_v']))} V {row['wave']}"


def _get(row: Mapping[str, Any], who: str, key: str, part: str = "median") -> float:
    """A number of a row; of ours its median, or an end of its interval."""
    entry = row.get(who)
    value = entry.get(key) if entry else None
    if isinstance(value, Mapping):
        value = value[part]
    return math.nan if value is None else float(value)


__all__ = ["cantilever_html", "comparison", "rows_section", "write_cantilever_report"]
