"""The page of the cantilever: rows, errors, summary."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

from tarsus_reproduce.pages.cantilever import cantilever_html, write_cantilever_report
from unit.html_page import Page, plain_cells


def reproduction_row(hz: float = 50.0, measured: dict[str, float] | None = None) -> dict[str, Any]:
    medians = {"bounces": 1.0, "peak_um": 150.0, "contact_ms": 5.0}
    ours = {
        name: {"median": value, "low": 0.9 * value, "high": 1.1 * value} for name, value in medians.items()
    }
    return {
        "freq_hz": hz,
        "volt_v": 8.0,
        "wave": "sine",
        "source": {"bounces": 1.0, "peak_um": 140.0, "contact_ms": 5.1},
        "measured": measured,
        "ours": ours,
        "role": "predicted",
        "p_bounce": 0.25,
    }


def reproduction_result() -> dict[str, Any]:
    column = {
        "count_right": 9,
        "mean_count_error": 0.25,
        "peak": {"mean_absolute_percent": 18.6, "cases": 12},
    }
    rows = [
        reproduction_row(50.0, {"bounces": 1.0, "peak_um": 152.0, "contact_ms": 2.5}),
        reproduction_row(15.0, {"bounces": 0.0, "peak_um": 120.0, "contact_ms": 0.0}),
        reproduction_row(5.0),
    ]
    own = {"rows": 3, "source": column, "ours": column, "ours_against_source": {"peak_within_15_percent": 11}}
    return {"device": "cantilever <x>", "rows": rows, "summary": own | {"added_rows": own}}


def test_reproduction_page_has_rows_errors_and_summary(tmp_path: Path) -> None:
    path = write_cantilever_report(reproduction_result(), tmp_path / "reproduction.html")
    source = plain_cells(path.read_text(encoding="utf-8"))
    page = Page(source)
    assert "Reproduction of cantilever <x>" in page.text
    assert "18.6 %" in page.text
    assert "Added rows (3)" in page.text
    first, second, third = re.findall(r"<tr><td>\d+ Hz.*?</tr>", source.replace("\u00a0", " "))
    assert '<td class="n">+1 %</td>' in first, "peak 152 against 150"
    assert '<td class="n off">−100 %</td>' in first, "contact 2.5 against 5"
    assert second.endswith('<td class="n off">–</td><td class=n>25 %</td></tr>'), (
        "contact 0 against 5 has no relative error"
    )
    assert '<td class="n off">−1</td>' in second, "one bounce where none was seen"
    assert third.count("<td class=n>–</td>") == 6, "nothing measured"


def test_reproduction_of_rows_without_reference() -> None:
    result = reproduction_result()
    for row in result["rows"]:
        row["source"] = row["measured"] = None
    assert "50 Hz 8 V sine" in Page(cantilever_html(result)).text.replace("\u00a0", " ")


def test_page_puts_rows_left_out_beside_those_calibrated_on() -> None:
    def part(error: float, brier: float) -> dict[str, Any]:
        peak = {"mean_relative_error": error, "held": 0.75, "brier": None}
        return {"measures": {"peak": peak, "bounces": {**peak, "held": 0.5, "brier": brier}}, "held": 0.7}

    calibration = {"training": part(0.114, 0.16), "left_out": part(0.119, 0.24)}
    page = Page(cantilever_html(reproduction_result() | {"calibration": calibration}))
    assert "Calibrated on and left out" in page.text
    for told in ("11 %", "12 %", "75 %", "0.16", "0.24"):
        assert told in page.text
    alone = cantilever_html(reproduction_result() | {"calibration": calibration | {"left_out": None}})
    assert "0.16" in alone and "0.24" not in alone
    assert "left out" not in Page(cantilever_html(reproduction_result())).text.replace("rows left out", "")
