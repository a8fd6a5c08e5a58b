"""The report of a calibration: rows with fitted and excluded predictions, hypotheses, choices, ranges of unknowns."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import starmap
from typing import Any

from tarsus.calibrate.results import calibration_table, errors_table, found_sentence, options_word, unknowns_table
from tarsus.report import calibrate_figures
from tarsus.report.calibrate_figures import row_name
from tarsus.report.pages import Markup, Section, bullets, marked, sections_page
from tarsus.tables.numbers import interval, number
from tarsus.tables.table import Column, Table

STRONG = 0.6
"""Correlations of at least this are listed: below it they explain less than a third of the variance."""


def calibration_html(result: Mapping[str, Any]) -> str:
    """The page of a result, as text."""
    kept = sorted((one for one in result["branches"] if not one["dropped"]), key=lambda one: one["cost"])
    names, study = list(result["discrepancy"]), result["study"]
    sections = [
        Section("How good", errors_table(result["summary"]).bare()),
        Section("Rows", calibrate_figures.predictions_figure(result, names), _rows(result, names), ROWS),
        Section(
            "Hypotheses",
            calibration_table(result).bare(),
            _threshold(result),
            *starmap(_choice, result["choices"].items()),
            *_constraints(result["constraints"]),
        ),
        Section("How the sets were found", _search(result)),
        Section("Unknowns", calibrate_figures.ranges(kept), *map(_hypothesis, kept)),
    ]
    about = (
        f"Device {result['device']}; {result['sets']} sets of unknowns; {len(kept)} of {len(result['branches'])} "
        f"hypotheses kept; seed {result['seed']}."
    )
    title = f"Calibration: {study}"
    return sections_page(title, [about], sections, _definitions(result), head=f"{study} – calibration")


ROWS = """P is the probability of a bounce without the row; intervals in colour do not hold the measured value. Rows
without a fitted value are predictions. An asterisk: the members fall into several modes; a dagger: flights too low for
the instrument, not decidable."""


def _threshold(result: Mapping[str, Any]) -> str:
    """Which hypotheses are kept, and what the scale of residuals is."""
    within = result["within"]
    return (
        f"A hypothesis is kept when its cost is within {number(within['value'])} residual scales of the best "
        f"({within['reason']}); the residual scale is {number(result['residual_scale'], 3)} tolerances, for "
        f"{number(result['effective_unknowns'], 3)} unknowns that the table's cells determine."
    )


def _choice(name: str, choice: Mapping[str, Any]) -> Markup:
    """The weights of a choice's options."""
    weights = ", ".join(f"{option} {weight:.2f}" for option, weight in choice["weights"].items())
    decided = "open: the data do not decide" if choice["open"] else "decided"
    return marked("<b>{}</b>: {} ({}). {}", name, weights, decided, choice["meaning"])


def _constraints(constraints: Sequence[Mapping[str, Any]]) -> list[str | Markup]:
    if not constraints:
        return []
    known = (f"{one['name']}: {one['reason'] or 'the study gives no reason.'}" for one in constraints)
    return ["Known besides the table:", bullets(known)]


def _search(result: Mapping[str, Any]) -> str:
    """What was searched, and how often."""
    search, sets = result["search"], result["sets"]
    others = (
        f", and {sets - search['sets']} for as many searches as rows were excluded, each without the row from its "
        "beginning"
    )
    return (
        f"Every search begins from nothing but the bounds of the unknowns and seed {result['seed']}. It has "
        f"{search['prescreening']} sets spread evenly, {search['short']} generations of {search['population']} of "
        f"every hypothesis and {search['generations']} more of those that are not rejected. A local search of at most "
        f"{search['local_search']} steps follows, and chains of {search['spread']} generations. {search['sets']} sets "
        f"were visited for the whole table{others if sets > search['sets'] else ''}."
    )


def _hypothesis(branch: Mapping[str, Any]) -> Section:
    """The unknowns of a hypothesis, and pairs of them that hang together."""
    strong = [f"{pair} {number(by, 2)}" for pair, by in branch["correlations"].items() if abs(by) >= STRONG]
    correlated = f"Correlated: {'; '.join(strong)}." if strong else ""
    unknowns = unknowns_table(branch, meanings=True).bare()
    return Section(options_word(branch), found_sentence(branch), unknowns, correlated)


def _definitions(result: Mapping[str, Any]) -> str:
    """What the page's words mean."""
    sigmas = "; ".join(f"{name} {one['sigma']:.2f}" for name, one in result["discrepancy"].items())
    return (
        f"Intervals hold 80 %: spread of the unknowns, of windows and draws, and the discrepancy of the model, in "
        f"tolerances: {sigmas}. Excluded: by the same search without the row. Determined: the 95 % interval reaches no "
        "farther than a quarter to either side, and the data set both of its ends; undecided: it reaches farther, or a "
        "bound of the search set an end; assumed: its spread is that of its prior."
    )


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
            cells += [shown.get("observed"), fitted and fitted["median"], new and new["median"], _interval(shown)]
            flagged += [(len(body), len(cells) - 1)] * (shown.get("holds") is False)
        body.append(cells)
    return Table("", columns, body, flagged=flagged)


def _interval(entry: Mapping[str, Any]) -> str:
    """The interval, the probability of a bounce where it is one, and marks that the page explains."""
    bounce = "" if entry["p_bounce"] is None else f", P {entry['p_bounce']:.2f}"
    marks = "*" * entry["several_modes"] + "†" * (not entry["decidable"])
    return interval(entry["low"], entry["high"], digits=3) + bounce + marks
