"""The report of one run: one HTML file that needs nothing else to be read."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from tarsus.base.events import EVENT_WORDS, IMPACTS, SLIDING
from tarsus.base.spec import float_paths
from tarsus.files.ledger import LEDGER_WORDS, ledger_lines
from tarsus.files.store import EVENTS_FILE, RunLike, write_text
from tarsus.files.summary import about as about_measure
from tarsus.impacts.energy import creation_warning
from tarsus.model.structure import Walker
from tarsus.report import figures, walk_figures
from tarsus.report.circular import circular
from tarsus.report.html import MISSING, Cell, Column, Markup, amount, code, number, page, table, tag
from tarsus.report.motion import motion_of, whole_motion
from tarsus.report.player import walk_section
from tarsus.report.points import points_section
from tarsus.report.render import rendered
from tarsus.report.series import Series, Window, joined, series_of
from tarsus.report.style import scale_of
from tarsus.report.values import grouped, value_rows

__all__ = ["report_html", "write_report"]

Shown = figures.Plate | Callable[[int], Markup]
"""A figure, or what makes one with its number."""

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
    detail = series.last_periods(CLOSE_UP)
    walker = isinstance(run.scene.robot.structure, Walker)
    motion, forces = _walk(run, detail) if walker else _motion(run, series, detail)
    warnings = [one for one in (creation_warning(run.scene), *getattr(run, "remarks", ())) if one is not None]
    body = rendered(
        "run.html", run=run, signals=_signals(run.scene), landing=_landing(run.scene), warnings=warnings,
        wall=run.wall_s if math.isfinite(run.wall_s) else 0.0, key=_key_figures(run), walker=walker, motion=motion,
        cautions=getattr(run.measures, "warnings", ()), measures=_measures(run), forces=forces,
        energies=figures.energies(series, other, detail), ledger=figures.ledger(series), account=_ledger(run),
        events=_events(run), values=_values(run),
    )  # fmt: skip
    return page(f"{run.scene.name} – run report", body)


def _walk(run: RunLike, detail: Window) -> tuple[list[Shown], list[Shown]]:
    """Figures of a walk, and those of the forces on its feet."""
    whole = whole_motion(run)
    motion: list[Shown] = [partial(walk_section, motion_of(run, whole=whole)), walk_figures.travel(whole)]
    if not run.foot_names:
        return motion, []
    return [*motion, walk_figures.footfalls(whole, detail)], [walk_figures.ground_forces(whole, detail)]


def _motion(run: RunLike, series: Series, detail: Window) -> tuple[list[Shown], list[Shown]]:
    """Figures of the motion of points, and those of the forces on the first feet."""
    motion: list[Shown] = [figures.motion(series, series.whole)]
    if detail != series.whole:
        plate = figures.motion(series, detail)
        motion.append(
            figures.Plate(plate.picture, f"The last {CLOSE_UP} drive periods of the run. {plate.caption}")
        )
    motion.append(partial(points_section, run, series, detail))
    turns = circular(series)
    if turns is not None:
        motion.append(turns)
    feet = range(min(len(series.feet), figures.MOST_FEET))
    return motion, [figures.forces(series, detail, foot) for foot in feet]


def _signals(scene: Any) -> str:
    """All drives in words; amplifiers that are alike once."""
    gait = {} if scene.gait is None else {"gait": scene.gait}
    parts = [f"{name}: {_signal(signal)}" for name, signal in {**gait, **scene.signals}.items()]
    amplifiers: dict[str, list[str]] = {}
    for name, drive in scene.robot.drives.items():
        if not drive.amplifier.ideal:
            amplifiers.setdefault(_signal(drive.amplifier), []).append(name)
    for words, names in amplifiers.items():
        whose = f"{names[0]}'s" if len(names) == 1 else "every" if len(names) == len(scene.robot.drives) else (
            f"{len(names)} drives', from {names[0]} to {names[-1]},")  # fmt: skip
        parts.append(f"{whose} {words}")
    return "; ".join(parts)


def _landing(scene: Any) -> str:
    """The landing rule where the scene gives one."""
    rule = scene.ground.landing
    if rule is None:
        return ""
    values = "".join(f", {path} {amount(info.value, info.unit)}" for path, info in float_paths(rule).items())
    return f"{rule.title}{values}"


def _signal(signal: Any) -> str:
    """A waveform or a gait in words: its kind and what its float fields say."""
    name = str(getattr(signal, "kind", type(signal).__name__)).replace("_", " ").lower()
    parts = []
    for path, info in float_paths(signal).items():
        if "." not in path and (info.value != 0.0 or path == "amplitude"):
            parts.append(f"{path.replace('_', ' ')} {amount(info.value, info.unit)}")
    if getattr(signal, "clip", None):
        parts.append(f"clip {amount(signal.clip[0], 'V')} to {amount(signal.clip[1], 'V')}")
    return f"{name}, {', '.join(parts)}" if parts else name


def _key_figures(run: RunLike) -> list[tuple[str, str, str]]:
    """The first measures: name, value, and of what."""
    found = []
    for name, measure in list(run.measures.items())[:4]:
        spread = _spread(measure)
        spread = f"± {spread}" if spread not in (MISSING, "0") else ""
        about = "; ".join(filter(None, (spread, about_measure(measure))))
        found.append((name, amount(measure.value, measure.unit), about))
    return found


def _measures(run: RunLike) -> Markup:
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
    return table(columns, rows)


def _range(values: Mapping[str, float]) -> list[tuple[str, float]]:
    """Of many feet, those of the least and of the largest value; of few, which are listed, none."""
    known = {foot: value for foot, value in values.items() if math.isfinite(value)}
    if len(values) <= MOST_FEET_LISTED or not known or min(known.values()) == max(known.values()):
        return []
    ends = (min(known, key=known.__getitem__), max(known, key=known.__getitem__))
    return [(foot, known[foot]) for foot in ends]


def _ledger(run: RunLike) -> Markup:
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
    return table(columns, rows)


def _settled(value: float, largest: float, step: float) -> str:
    """A share of an account in steps of its unit; what is below the rounding of its largest entry is 0."""
    return number(value / step) if abs(value) > LEAST * abs(largest) else "0"


def _events(run: RunLike) -> dict[str, Any]:
    """The events as a table, and what is said above it; nothing without any."""
    events = run.events
    if not len(events):
        return {}
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
    kinds, counts = np.unique(events["kind"], return_counts=True)
    tally = [f"{n} × {EVENT_WORDS[int(kind)]}" for kind, n in zip(kinds, counts, strict=True)]
    return {
        "table": table(columns, rows, tall=True), "tally": joined(tally), "listed": len(rows), "file": EVENTS_FILE,
        "rest": len(events) - len(rows), "sliding": bool(np.isin(SLIDING, kinds).any()),
    }  # fmt: skip


def _values(run: RunLike) -> Markup:
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
        path = Markup("{} <small>{}</small>").format(code(row.path), row.of) if row.of else code(row.path)
        rows.append([path, unbroken, source, row.note or row.doc])
    return table(columns, rows, wrap=True, tall=len(rows) > MOST_VALUES)


def _spread(measure: Any) -> str:
    """A spread for reading; one at the level of rounding, as of a periodic motion, is 0."""
    if not math.isfinite(measure.spread):
        return MISSING
    if measure.spread <= ROUNDING * abs(measure.value):
        return "0"
    return amount(measure.spread, measure.unit, 2)


def _words(name: str) -> str:
    return name.replace("_", " ")
