"""The report of one run: one HTML file that needs nothing else to be read."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from itertools import count
from pathlib import Path
from typing import Any

import numpy as np

from tarsus.base.events import EVENT_WORDS, IMPACTS, SLIDING
from tarsus.base.spec import float_paths
from tarsus.files.ledger import LEDGER_WORDS, ledger_lines
from tarsus.files.store import EVENTS_FILE, RunLike, counted, package_version, write_text
from tarsus.model.structure import Walker
from tarsus.report import figures
from tarsus.report.circular import circular
from tarsus.report.html import (
    MISSING,
    Cell,
    Column,
    Markup,
    amount,
    code,
    escape,
    figure,
    number,
    page,
    pair,
    table,
    tag,
    warning,
)
from tarsus.report.points import points_section
from tarsus.report.series import Series, joined, series_of
from tarsus.report.style import scale_of
from tarsus.report.values import grouped, value_rows
from tarsus.report.walk_page import walk_sections
from tarsus.study.impacts import creation_warning

MOST_EVENTS = 500
"""Rows of the event table in the page; all events are in `events.csv`."""

MOST_VALUES = 24
"""Rows of the table of values that stand in full; a longer one scrolls, about a screen high."""

MOST_FEET_LISTED = 8
"""Feet of which each measure is listed; of more, the least and the largest."""

ROUNDING = 1e-9
"""A spread smaller than this part of its value says nothing: runs are computed to about as much."""

LEAST = 1e-12
"""An entry of the energy account below this part of the largest is none: accounts close to about 1e-14."""

CLOSE_UP = 2
"""Drive periods shown by the figures of detail."""

_LANDING = ("speed_before", "speed_after", "pull", "strength", "energy", "apex")
_HOLDING = ("pull", "strength")
EVENT_FIELDS = {kind: _LANDING if kind in IMPACTS else _HOLDING for kind in EVENT_WORDS}
"""What an event of each kind has a value for: leaving the ground is no impact and ends no flight."""


def write_report(run: RunLike, path: str | Path, companion: RunLike | None = None) -> Path:
    """Write the report of a run as one self-contained HTML file and return its path.

    `companion` is a run of the same scene with adhesion off, for the energy comparison (Fig. 2.12). Raises
    InputError if `path` cannot be written.
    """
    target = Path(path)
    write_text(target, report_html(run, companion))
    return target


def report_html(run: RunLike, companion: RunLike | None = None) -> str:
    """The page as text; see `write_report`."""
    series = series_of(run)
    other = None if companion is None else series_of(companion)
    return page(f"{run.scene.name} – run report", "".join(_sections(run, series, other)))


def _sections(run: RunLike, series: Series, other: Series | None) -> Iterator[str]:
    numbers = count(1)
    detail = series.last_periods(CLOSE_UP)
    yield _head(run, series)

    if isinstance(run.scene.robot.structure, Walker):
        yield from walk_sections(run, numbers, detail, _measures(run))
    else:
        yield from _motion_sections(run, series, numbers)

    yield "<h2>Energy</h2>\n"
    energies = figure(figures.energies(series, other, detail), next(numbers))
    yield pair(energies, figure(figures.ledger(series), next(numbers)))
    yield _ledger(run)

    yield "<h2>Events</h2>\n"
    yield _events(run)

    yield "<h2>Values of this run</h2>\n"
    yield _values(run)
    yield _foot(run)


def _motion_sections(run: RunLike, series: Series, numbers: Iterator[int]) -> Iterator[str]:
    """Motion of the points, measures, and forces on the first feet."""
    detail = series.last_periods(CLOSE_UP)
    yield "<h2>Motion</h2>\n"
    yield figure(figures.motion(series, series.whole), next(numbers))
    if detail != series.whole:
        plate = figures.motion(series, detail)
        close = figures.Plate(plate.picture, f"The last {CLOSE_UP} drive periods of the run. {plate.caption}")
        yield figure(close, next(numbers))
    yield points_section(run, series, detail, next(numbers))
    turns = circular(series)
    if turns is not None:
        yield figure(turns, next(numbers))

    yield "<h2>Measures</h2>\n"
    yield _measures(run)

    if series.feet:
        yield "<h2>Forces</h2>\n"
    for foot in range(min(len(series.feet), figures.MOST_FEET)):
        yield figure(figures.forces(series, detail, foot), next(numbers))


def _head(run: RunLike, series: Series) -> str:
    scene = run.scene
    gait = {} if scene.gait is None else {"gait": scene.gait}
    signals = "; ".join(f"{name}: {_signal(signal)}" for name, signal in {**gait, **scene.signals}.items())
    for name, drive in scene.robot.drives.items():
        signals += "" if drive.amplifier.ideal else f"; {name}'s {_signal(drive.amplifier).lower()}"
    kind = "verdict" if run.ok else "verdict failed"
    wall = f", computed in {amount(run.wall_s, 's', 3)}" if math.isfinite(run.wall_s) else ""
    lines = [
        f"<h1>{escape(scene.name)}</h1>\n",
        f'<p class="lede">{escape(signals) or "no drive signal"}</p>\n',
        f'<p class="{kind}">{escape(str(run.code.value))}</p>\n',
        _landing(scene),
        warning(creation_warning(scene)),
        *(warning(remark) for remark in getattr(run, "remarks", ())),
        f'<p class="lede">{amount(run.duration, "s")} simulated{wall}; {len(run.events)} contact events; '
        f"energy ledger closes to {number(run.ledger.closure, 2)}. Tarsus {escape(package_version())}.</p>\n",
    ]
    return "".join(lines) + _key_figures(run)


def _landing(scene: Any) -> str:
    """The landing rule where the scene gives one."""
    rule = scene.ground.landing
    if rule is None:
        return ""
    values = "".join(f", {path} {amount(info.value, info.unit)}" for path, info in float_paths(rule).items())
    return f'<p class="lede">A foot that lands: {escape(rule.title + values)}.</p>\n'


def _signal(signal: Any) -> str:
    """A waveform or a gait in words: its kind and what its float fields say."""
    name = str(getattr(signal, "kind", type(signal).__name__)).replace("_", " ")
    parts = []
    for path, info in float_paths(signal).items():
        if "." not in path and (info.value != 0.0 or path == "amplitude"):
            parts.append(f"{path.replace('_', ' ')} {amount(info.value, info.unit)}")
    if getattr(signal, "clip", None):
        parts.append(f"clip {amount(signal.clip[0], 'V')} to {amount(signal.clip[1], 'V')}")
    return f"{name}, {', '.join(parts)}" if parts else name


def _key_figures(run: RunLike) -> str:
    """The first measures, large."""
    cells = []
    for name, measure in list(run.measures.items())[:4]:
        spread = _spread(measure)
        spread = f"± {spread}" if spread not in (MISSING, "0") else ""
        about = "; ".join(filter(None, (spread, str(measure.scope), counted(measure))))
        cells.append(
            f"<div><dt>{escape(_words(name))}</dt><dd>{escape(amount(measure.value, measure.unit))}</dd>"
            f"<small>{escape(about)}</small></div>"
        )
    return f'<dl class="key">{"".join(cells)}</dl>\n' if cells else ""


def _measures(run: RunLike) -> str:
    ranges = {name: _range(m.per_foot) for name, m in run.measures.items()}
    wide = any(ranges.values())
    columns = [Column("measure", number=False), Column("value"), Column("spread"), Column("n")]
    columns += [Column("least foot"), Column("largest foot")] if wide else []
    columns.append(Column("of", number=False))
    rows: list[list[Cell]] = []
    for name, m in run.measures.items():
        ends = [f"{amount(value, m.unit)} {foot}" for foot, value in ranges[name]] or ["", ""]
        row: list[Cell] = [_words(name), amount(m.value, m.unit), _spread(m), str(m.n)]
        rows.append([*row, *(ends if wide else ()), str(m.scope)])
        if 2 <= len(m.per_foot) <= MOST_FEET_LISTED:
            rows += [
                [f"   foot {foot}", amount(value, m.unit), "", "", ""] for foot, value in m.per_foot.items()
            ]
    told = "".join(
        f"<dt>{escape(_words(name))}</dt><dd>{escape(m.definition)}</dd>" for name, m in run.measures.items()
    )
    note = (
        f"<details><summary>What each measure is</summary><dl>{told}</dl></details>\n"
        "<p>Spread is the standard deviation over the n values the measure was taken from; names that begin with max, "
        "total or longest are of the whole run.</p>\n"
    )
    cautions = "".join(f"<p>Note: {escape(str(one))}</p>\n" for one in getattr(run.measures, "warnings", ()))
    return cautions + table(columns, rows) + note


def _range(values: Mapping[str, float]) -> list[tuple[str, float]]:
    """Of many feet, those of the least and of the largest value; of few, which are listed, none."""
    known = {foot: value for foot, value in values.items() if math.isfinite(value)}
    if len(values) <= MOST_FEET_LISTED or not known or min(known.values()) == max(known.values()):
        return []
    ends = (min(known, key=known.__getitem__), max(known, key=known.__getitem__))
    return [(foot, known[foot]) for foot in ends]


def _ledger(run: RunLike) -> str:
    lines = [
        (label, value)
        for label, value in ledger_lines(run)
        if value != 0.0 or label != LEDGER_WORDS["friction"]
    ]
    largest = max(abs(value) for _, value in lines) or 1.0
    scale = scale_of("J", largest)
    columns = [
        Column("term", number=False),
        Column("energy", scale.label),
        Column("share of the largest", "%"),
    ]
    rows: list[list[Cell]] = [
        [label, _settled(value, largest, scale.step), _settled(100.0 * value, 100.0 * largest, largest)]
        for label, value in lines
    ]
    residual = float(run.ledger.residual)
    rows.append(
        [
            "residual (closes the ledger)",
            number(residual / scale.step, 2),
            number(100.0 * residual / largest, 2),
        ]
    )
    return (
        f"<p>Work in, changes and losses agree to {number(run.ledger.closure, 2)} of the largest term.</p>\n"
        f"<details><summary>The account in numbers</summary>{table(columns, rows)}</details>\n"
    )


def _settled(value: float, largest: float, step: float) -> str:
    """A share of an account in steps of its unit; what is below the rounding of its largest entry is 0."""
    return number(value / step) if abs(value) > LEAST * abs(largest) else "0"


def _events(run: RunLike) -> str:
    events = run.events
    if not len(events):
        return "<p>No foot touched the ground.</p>\n"
    clock = scale_of("s", run.duration)
    speed = scale_of("m/s", events["speed_before"], events["speed_after"])
    force = scale_of("N", events["pull"], events["strength"])
    energy = scale_of("J", events["energy"])
    height = scale_of("m", events["apex"])
    columns = [
        Column("time", clock.label),
        Column("foot", number=False),
        Column("event", number=False),
        Column("arrives", speed.label),
        Column("leaves", speed.label),
        Column("pull", force.label),
        Column("strength", force.label),
        Column("energy lost", energy.label),
        Column("apex before", height.label),
    ]
    rows = [
        [
            f"{event['time'] / clock.step:.6f}",
            str(run.foot_names[event["foot"]]),
            EVENT_WORDS[int(event["kind"])],
            *(
                number(float(event[name]) / scale.step)
                if name in EVENT_FIELDS[int(event["kind"])]
                else MISSING
                for name, scale in (
                    ("speed_before", speed),
                    ("speed_after", speed),
                    ("pull", force),
                    ("strength", force),
                    ("energy", energy),
                    ("apex", height),
                )
            ),
        ]
        for event in events[:MOST_EVENTS]
    ]
    rest = len(events) - len(rows)
    kinds, counts = np.unique(events["kind"], return_counts=True)
    tally = [f"{n} × {EVENT_WORDS[int(kind)]}" for kind, n in zip(kinds, counts, strict=True)]
    more = f" The first {len(rows)} are listed; {rest} more are in {EVENTS_FILE}." if rest else ""
    note = (
        "Arrives and leaves are speeds towards and away from the ground, pull is the structure's net force "
        "on the foot away from it, strength what adhesion could hold at that moment, apex the highest point "
        "of the flight before."
    )
    if np.isin(SLIDING, kinds).any():
        note += " Where slip or stick begins, pull is the force along the ground, strength the most friction bears."
    return f"<p>{escape(joined(tally))}.{escape(more)} {note}</p>\n" + table(columns, rows, tall=True)


def _values(run: RunLike) -> str:
    columns = [
        Column("value", number=False),
        Column("", number=True),
        Column("source", number=False),
        Column("where it comes from", number=False),
    ]
    rows: list[list[Cell]] = []
    for row in grouped(value_rows(run.scene)):
        source: Cell = tag(row.source) if row.source else MISSING
        unbroken = ", ".join(part.replace(" ", "\N{NO-BREAK SPACE}") for part in row.value.split(", "))
        path = Markup(f"{code(row.path)} <small>{escape(row.of)}</small>") if row.of else code(row.path)
        rows.append([path, unbroken, source, row.note or row.doc])
    return (
        "<p>Every number that entered the simulation, with its origin; a dash marks a value set by the user "
        "or left at its default.</p>\n" + table(columns, rows, wrap=True, tall=len(rows) > MOST_VALUES)
    )


def _foot(run: RunLike) -> str:
    cited = [str(entry) for entry in run.scene.citations]
    items = "".join(f"<li>{escape(entry)}</li>" for entry in cited)
    sources = f"<p>Sources of this scene:</p><ul>{items}</ul>" if items else ""
    return (
        f"<footer>{sources}<p>Made by Tarsus {escape(package_version())}. Conventions: z is up, a gap is "
        "positive when open, forces on the structure are positive along the ground's normal.</p></footer>"
    )


def _spread(measure: Any) -> str:
    """A spread for reading; one at the level of rounding, as of a periodic motion, is 0."""
    if not math.isfinite(measure.spread):
        return MISSING
    if measure.spread <= ROUNDING * abs(measure.value):
        return "0"
    return amount(measure.spread, measure.unit, 2)


def _words(name: str) -> str:
    return name.replace("_", " ")


__all__ = ["Markup", "report_html", "write_report"]
