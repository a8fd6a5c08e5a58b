"""The walking millipede: every trend of section 4.4.1 beside ours, the curves behind it, and Fig. 4.7."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import count
from pathlib import Path

from tarsus.files.version import package_version
from tarsus.files.whole import write_text
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
from tarsus_reproduce.millipede import Judged, MillipedeReproduction
from tarsus_reproduce.millipede_trends import DIRECTIONAL, TRENDS, examples, scored_trends
from tarsus_reproduce.packaged_readings import packaged_readings
from tarsus_reproduce.pages.millipede_figures import readings_figure, swept_figure, walks_figure
from tarsus_reproduce.readings import CHOICES, RANGES, Readings
from tarsus_reproduce.trends import CRITERION, Verdict

FIGURES = {
    "millipede-electrostatics": ("Fig. 4.8: electrostatics", "$C_e$"),
    "millipede-film-nano": ("Fig. 4.9: squeeze film in nN m² s", "$C_{sfd}$"),
    "millipede-film-micro": ("Fig. 4.9: squeeze film in µN m² s", "$C_{sfd}$"),
    "millipede-adhesion": ("Fig. 4.10: growth of adhesion", "$C_{adh}$"),
    "millipede-payload": ("Fig. 4.11: payload", "mass of the body"),
}
"""Study -> what its figure shows and the symbol of what varies."""

__all__ = ["millipede_html", "write_millipede_report"]


def write_millipede_report(
    reproduction: MillipedeReproduction, path: str | Path, readings: Readings | None = None
) -> Path:
    """Write a millipede's reproduction as one self-contained HTML file and return its path.

    It shows the distribution over `readings`, the packaged ones when absent. Raises InputError if `path` cannot be
    written.
    """
    target = Path(path)
    write_text(target, millipede_html(reproduction, readings))
    return target


def millipede_html(reproduction: MillipedeReproduction, readings: Readings | None = None) -> str:
    """The page as text; see `write_millipede_report`."""
    body = "".join(_sections(reproduction, readings or packaged_readings()))
    return page("millipede – reproduction", body)


def _sections(reproduction: MillipedeReproduction, readings: Readings) -> Iterator[str]:
    numbers = count(1)
    yield (
        "<h1>The walking millipede</h1>\n"
        '<p class="lede">What the dissertation says of its simulations of walking (section 4.4.1, Figs. 4.7–4.11) and '
        f"what ours do; Tarsus {escape(package_version())}.</p>\n"
    )
    yield from map(warning, reproduction.problems)
    yield "<h2>Trends</h2>\n"
    yield (
        "<p>The dissertation prints no numbers, only trends in words, and neither masses nor stiffness of its model: "
        "the devices below are readings of it, none is the device. Each trend is judged on the measure of its figure, "
        "in bold, and on others that its words could mean; captions say maximum, so heights, travel and contact are "
        "those of the whole run, and every rebound counts, however low. Replicates are the restitutions of Table 4.2. "
        f"{escape(CRITERION)} White noise nearly always has local extrema; the {DIRECTIONAL} directional trends, which "
        "it rarely has, are counted apart.</p>\n"
    )
    yield _summary(reproduction)
    for outcome in reproduction.outcomes:
        yield f"<p><b>{escape(outcome.name)}</b>: {escape(outcome.about)}.</p>\n"
    yield "<h2>Random readings of what is not printed</h2>\n"
    yield from _readings(reproduction, readings, numbers)
    yield _trends(reproduction)
    yield "<h2>Over ground and payload</h2>\n"
    for study, (title, symbol) in FIGURES.items():
        curves = [
            (outcome.name, one)
            for outcome in reproduction.outcomes
            for one in outcome.swept
            if one.study == study
        ]
        yield figure(swept_figure(curves, title, symbol), next(numbers))
    yield "<h2>Two grounds in time</h2>\n"
    yield _grounds(reproduction)
    for outcome in reproduction.outcomes:
        if all(one.run.ok for one in outcome.examples) and outcome.examples:
            yield figure(walks_figure(outcome.examples, outcome.name), next(numbers))
    yield _comparisons(reproduction)
    yield f"<footer><p>Made by Tarsus {escape(package_version())}.</p></footer>"


def _summary(reproduction: MillipedeReproduction) -> str:
    columns = [Column("15 trends and Fig. 4.7", number=False), *(Column(one.value) for one in Verdict)]
    columns.append(Column("directional trends that agree"))
    rows: list[list[Cell]] = []
    for outcome in reproduction.outcomes:
        one = outcome.score
        counts = (one.agree, one.contradict, one.insensitive, one.not_determined)
        directional = f"{one.directional_agree} of {one.directional_total}"
        rows.append([outcome.name, *map(str, counts), directional])
    note = (
        "<p>By the measure of each figure, the film in the device's own reading of its unit. Insensitive means that "
        "nothing changes over the printed range: that tells of the device, not of the dissertation.</p>\n"
    )
    return f"{table(columns, rows)}{note}"


def _readings(
    reproduction: MillipedeReproduction, readings: Readings, numbers: Iterator[int]
) -> Iterator[str]:
    judged = len(readings.scores)
    if not judged:
        yield "<p>No reading could be judged.</p>\n"
        return
    yield (
        f"<p>{len(readings.readings)} readings drawn from the ranges below (seed {readings.seed}), {judged} of which "
        "could be run; what is printed stays as printed. The bars are the honest score of the model, the marks are the "
        "named devices: one far to the right was found by choosing, not by luck. Readings are judged on fewer values "
        "and three restitutions, which makes agreement a little easier.</p>\n"
    )
    yield figure(readings_figure(readings, reproduction), next(numbers))
    columns = [
        Column("not printed", number=False),
        Column("from"),
        Column("to"),
        Column("because", number=False),
    ]
    rows: list[list[Cell]] = [
        [one.name, amount(one.low, one.unit, 3), amount(one.high, one.unit, 3), one.why] for one in RANGES
    ]
    yield table(columns, rows)
    head = (
        Column("not printed", number=False),
        Column("one of", number=False),
        Column("because", number=False),
    )
    yield table(head, [[one.name, " or ".join(one.options), one.why] for one in CHOICES])


def _trends(reproduction: MillipedeReproduction) -> str:
    columns = [
        Column("figure", number=False),
        Column("the source", number=False),
        Column("measure", number=False),
    ]
    columns += [Column(outcome.name, number=False) for outcome in reproduction.outcomes]
    found = [{(one.trend, one.measure): one for one in outcome.trends} for outcome in reproduction.outcomes]
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
                    *(
                        _judged(one.get((trend, measure)), trend in scored_trends(outcome.reading))
                        for one, outcome in zip(found, reproduction.outcomes, strict=True)
                    ),
                ]
            )
    return table(columns, rows)


def _judged(one: Judged | None, scored: bool) -> Cell:
    if one is None:
        return MISSING
    finding = one.finding
    ends = f"{_shown(finding.first, one.unit)} to {_shown(finding.last, one.unit)}"
    other = "" if scored else "; not this device's reading of the film"
    return _verdict(finding.verdict, f"{finding.words}; {ends}{other}")


def _shown(value: float, unit: str) -> str:
    """A value for reading; lengths of rounding are 0."""
    return amount(0.0 if unit == "m" and abs(value) < STANDSTILL else value, unit, 3)


def _verdict(verdict: Verdict, why: str = "") -> Markup:
    kind = ' class="off"' if verdict is Verdict.CONTRADICTS else ""
    small = f"<br><small>{escape(why).replace('-', '−')}</small>" if why else ""
    return Markup(f"<td{kind}>{escape(verdict.value)}{small}</td>")


def _grounds(reproduction: MillipedeReproduction) -> str:
    out = ""
    for reading in dict.fromkeys(outcome.reading for outcome in reproduction.outcomes):
        grounds = examples(reading)
        paths = list(grounds["a"])
        columns = [Column("ground", number=False), *(Column(path.removeprefix("ground.")) for path in paths)]
        rows: list[list[Cell]] = [
            [f"({name})", *(number(ground[path]) for path in paths)] for name, ground in grounds.items()
        ]
        out += f"{table(columns, rows)}<p>In SI; the film's unit read as {escape(reading.value)} (erratum E4).</p>\n"
    return out


def _comparisons(reproduction: MillipedeReproduction) -> str:
    columns = [
        Column("variant", number=False),
        Column("the source", number=False),
        Column("ours", number=False),
        Column("vertical amplitude", number=False),
    ]
    rows: list[list[Cell]] = [
        [outcome.name, one.says, _verdict(one.verdict), one.words]
        for outcome in reproduction.outcomes
        for one in outcome.comparisons
    ]
    swings: list[list[Cell]] = [
        [outcome.name, f"({one.name})", _shown(one.amplitude, "m"), _shown(one.stride, "m")]
        for outcome in reproduction.outcomes
        for one in outcome.examples
    ]
    about = [
        Column("variant", number=False), Column("ground", number=False), Column("vertical amplitude"), Column("stride"),
    ]  # fmt: skip
    note = (
        "<p>'Much more' is read as at least twice. That electrostatics cause it contradicts Fig. 4.8, which says that "
        "attraction lowers the amplitude (erratum E15); both are computed, and only the first line is scored.</p>\n"
    )
    return f"{table(columns, rows)}{note}{table(about, swings)}"
