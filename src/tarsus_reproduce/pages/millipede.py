"""Validation of the walking millipede: every trend of section 4.4.1 beside ours, the curves behind it, and Fig. 4.7."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import count
from pathlib import Path

from tarsus.files.store import package_version, write_text
from tarsus.measure import STANDSTILL
from tarsus.report.html import (
    MISSING,
    Cell,
    Column,
    Markup,
    amount,
    escape,
    figure,
    number,
    page,
    table,
    warning,
)
from tarsus.report.style import figure_style
from tarsus_reproduce.millipede import EXAMPLES, TRENDS, Judged, MillipedeValidation
from tarsus_reproduce.pages.millipede_figures import swept_figure, walks_figure
from tarsus_reproduce.trends import CRITERION, Verdict

FIGURES = {
    "millipede-electrostatics": ("Fig. 4.8: electrostatics", "$C_e$"),
    "millipede-film": ("Fig. 4.9: squeeze film, both readings of its unit", "$C_{sfd}$"),
    "millipede-adhesion": ("Fig. 4.10: growth of adhesion", "$C_{adh}$"),
    "millipede-payload": ("Fig. 4.11: payload", "mass of the body"),
}
"""Study -> what its figure shows and the symbol of what varies."""

__all__ = ["millipede_html", "write_millipede_report"]


def write_millipede_report(validation: MillipedeValidation, path: str | Path) -> Path:
    """Write a millipede's validation as one self-contained HTML file and return its path.

    Raises InputError if `path` cannot be written.
    """
    target = Path(path)
    write_text(target, millipede_html(validation))
    return target


def millipede_html(validation: MillipedeValidation) -> str:
    """The page as text; see `write_millipede_report`."""
    with figure_style():
        body = "".join(_sections(validation))
    return page(f"{validation.device} – validation", body)


def _sections(validation: MillipedeValidation) -> Iterator[str]:
    numbers = count(1)
    yield (
        f"<h1>Validation of {escape(validation.device)}</h1>\n"
        '<p class="lede">What the source says of its simulations of walking (section 4.4.1, Figs. 4.7–4.11) and what '
        f"ours do; Tarsus {escape(package_version())}.</p>\n"
    )
    yield from map(warning, validation.problems)
    yield "<h2>Trends</h2>\n"
    yield (
        "<p>The source prints no numbers, only trends in words, and neither masses nor stiffness of its model. Each "
        "trend is judged on the measure of its figure, in bold, and on others that its words could mean; replicates "
        f"are the restitutions of Table 4.2. {escape(CRITERION)}</p>\n"
    )
    yield _summary(validation)
    for outcome in validation.outcomes:
        yield f"<p><b>{escape(outcome.variant.name.capitalize())}</b>: {escape(outcome.variant.about)}.</p>\n"
    yield _trends(validation)
    yield "<h2>Over ground and payload</h2>\n"
    for study, (title, symbol) in FIGURES.items():
        curves = [
            (outcome.variant.name, one)
            for outcome in validation.outcomes
            for one in outcome.swept
            if one.study == study
        ]
        yield figure(swept_figure(curves, title, symbol), next(numbers))
    yield "<h2>Two grounds in time</h2>\n"
    yield _grounds()
    for outcome in validation.outcomes:
        if all(one.run.ok for one in outcome.examples) and outcome.examples:
            yield figure(walks_figure(outcome.examples, outcome.variant.name.capitalize()), next(numbers))
    yield _comparisons(validation)
    yield f"<footer><p>Made by Tarsus {escape(package_version())}.</p></footer>"


def _summary(validation: MillipedeValidation) -> str:
    columns = [Column("by the measure of each figure", number=False), *(Column(one.value) for one in Verdict)]
    rows: list[list[Cell]] = [
        [outcome.variant.name, *(str(outcome.count(verdict)) for verdict in Verdict)]
        for outcome in validation.outcomes
    ]
    return table(columns, rows)


def _trends(validation: MillipedeValidation) -> str:
    columns = [
        Column("figure", number=False),
        Column("the source", number=False),
        Column("measure", number=False),
    ]
    columns += [Column(outcome.variant.name, number=False) for outcome in validation.outcomes]
    found = [{(one.trend, one.measure): one for one in outcome.trends} for outcome in validation.outcomes]
    rows: list[list[Cell]] = []
    for trend in TRENDS:
        for measure in trend.measures:
            shown = escape(measure.replace("_", " "))
            first = measure == trend.measures[0]
            rows.append(
                [
                    trend.figure if first else "",
                    f"{trend.quantity} {trend.says}" if first else "",
                    Markup(f"<b>{shown}</b>" if first else shown),
                    *(_judged(one.get((trend, measure))) for one in found),
                ]
            )
    return table(columns, rows)


def _judged(one: Judged | None) -> Cell:
    if one is None:
        return MISSING
    finding = one.finding
    ends = f"{_shown(finding.first, one.unit)} to {_shown(finding.last, one.unit)}"
    return _verdict(finding.verdict, f"{finding.words}; {ends}")


def _shown(value: float, unit: str) -> str:
    """A value for reading; lengths of rounding are 0."""
    return amount(0.0 if unit == "m" and abs(value) < STANDSTILL else value, unit, 3)


def _verdict(verdict: Verdict, why: str = "") -> Markup:
    kind = ' class="off"' if verdict is Verdict.CONTRADICTS else ""
    small = f"<br><small>{escape(why).replace('-', '−')}</small>" if why else ""
    return Markup(f"<td{kind}>{escape(verdict.value)}{small}</td>")


def _grounds() -> str:
    paths = list(next(iter(EXAMPLES.values())))
    columns = [Column("ground", number=False), *(Column(path.removeprefix("ground.")) for path in paths)]
    rows: list[list[Cell]] = [
        [f"({name})", *(number(ground[path]) for path in paths)] for name, ground in EXAMPLES.items()
    ]
    return table(columns, rows) + "<p>In SI; the film's unit read as in erratum E4.</p>\n"


def _comparisons(validation: MillipedeValidation) -> str:
    columns = [
        Column("variant", number=False),
        Column("the source", number=False),
        Column("ours", number=False),
        Column("vertical amplitude", number=False),
    ]
    rows: list[list[Cell]] = [
        [outcome.variant.name, one.says, _verdict(one.verdict), one.words]
        for outcome in validation.outcomes
        for one in outcome.comparisons
    ]
    swings: list[list[Cell]] = [
        [outcome.variant.name, f"({one.name})", _shown(one.amplitude, "m"), _shown(one.stride, "m")]
        for outcome in validation.outcomes
        for one in outcome.examples
    ]
    about = [
        Column("variant", number=False), Column("ground", number=False), Column("vertical amplitude"), Column("stride"),
    ]  # fmt: skip
    note = "<p>'Much more' is read as at least twice.</p>\n"
    return table(columns, rows) + note + table(about, swings)
