"""The report of one run: one HTML file that needs nothing else to be read."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from markupsafe import Markup

from tarsus.base.events import EVENT_WORDS, IMPACTS, SLIDING
from tarsus.base.spec import float_paths
from tarsus.files.settled import settled
from tarsus.files.store import EVENTS_FILE
from tarsus.files.summary import about, account, deviation, measures_summary
from tarsus.model.structure import Walker
from tarsus.report import figures, walk_figures
from tarsus.report.above import path_above
from tarsus.report.explorer import small_explorer
from tarsus.report.motion import motion_of, whole_motion
from tarsus.report.pages import Plate, page, rendered, write_page
from tarsus.report.panels import Window
from tarsus.report.player import walk_section
from tarsus.report.points import points_section
from tarsus.report.series import RunSeries, joined, series_of
from tarsus.tables.numbers import MISSING, amount, spaced
from tarsus.tables.table import Column, Table

if TYPE_CHECKING:
    from tarsus.orbits.attractors import Attractors
    from tarsus.solve import Run

Shown = Plate | Callable[[int], Markup]
"""A figure, or what makes one with its number."""

MOST_EVENTS = 500
"""Rows of the event table in the page: they make a tenth of its size; all events are in `events.csv`."""

CLOSE_UP = 2
"""Drive periods shown by the figures of detail: the second shows whether the first repeats."""

_LANDING = ("speed_before", "speed_after", "pull", "strength", "energy", "apex")
_HOLDING = ("pull", "strength")
EVENT_FIELDS = {kind: _LANDING if kind in IMPACTS else _HOLDING for kind in EVENT_WORDS}
"""What an event of each kind has a value for: leaving the ground is no impact and ends no flight."""


def write_report(
    run: Run, path: str | Path, companion: Run | None = None, others: Attractors | None = None, *,
    static: bool = False,
) -> Path:  # fmt: skip
    """Write the report of a run as one self-contained HTML file and return its path.

    `companion` is a run of the same scene with adhesion off, for the energy comparison (Fig. 2.12), `others` what
    other starts lead to; static: without the small explorer, which there is where the engine for pages was built.
    Raises InputError if `path` cannot be written.
    """
    return write_page(report_html(run, companion, others, static=static), path)


def report_html(
    run: Run, companion: Run | None = None, others: Attractors | None = None, *, static: bool = True
) -> str:
    """The page as text; see `write_report`."""
    series = series_of(run)
    other = None if companion is None else series_of(companion)
    detail = series.last_periods(CLOSE_UP)
    walker = isinstance(run.scene.robot.structure, Walker)
    motion, forces = _walk(run, detail) if walker else _motion(run, series, detail)
    body = rendered(
        "run.html", run=run, signals=_signals(run.scene), landing=_landing(run.scene), warnings=_warnings(run),
        wall=run.wall_s if math.isfinite(run.wall_s) else 0.0, key=_key_figures(run), settled=settled(run),
        others=None if others is None else others.beside(run), walker=walker, motion=motion,
        measures=measures_summary(run.measures, ""), forces=forces, explorer="" if static else small_explorer(run),
        energies=figures.energies(series, other, detail), ledger=figures.ledger(series), account=account(run),
        events=_events(run), values=_values(run),
    )  # fmt: skip
    return page(f"{run.scene.name} – run report", body)


def _warnings(run: Run) -> list[str]:
    """What a reader must not miss: an impact map that can create energy, and the run's own remarks."""
    remarks: list[str] = list(run.remarks)
    if run.scene.ground.impact is None:
        return remarks
    from tarsus.impacts.energy import creation_warning  # with its package come scipy's statistics

    created = creation_warning(run.scene)
    return remarks if created is None else [created, *remarks]


def _walk(run: Run, detail: Window) -> tuple[list[Shown], list[Shown]]:
    """Figures of a walk, and those of the forces on its feet."""
    whole = whole_motion(run)
    motion: list[Shown] = [partial(walk_section, motion_of(run, whole=whole)), walk_figures.travel(whole)]
    if "yaw" in whole.body:
        motion.append(path_above(whole))
    if not run.foot_names:
        return motion, []
    return [*motion, walk_figures.footfalls(whole, detail)], [walk_figures.ground_forces(whole, detail)]


def _motion(run: Run, series: RunSeries, detail: Window) -> tuple[list[Shown], list[Shown]]:
    """Figures of the motion of points, and those of the forces on the first feet."""
    motion: list[Shown] = [figures.motion(series, series.whole)]
    if detail != series.whole:
        plate = figures.motion(series, detail)
        motion.append(Plate(plate.picture, f"The last {CLOSE_UP} drive periods of the run. {plate.caption}"))
    motion.append(partial(points_section, run, series, detail))
    turns = figures.turns(series)
    motion += [turns] if turns is not None else []
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
    name = spaced(str(getattr(signal, "kind", type(signal).__name__))).lower()
    parts = []
    for path, info in float_paths(signal).items():
        if "." not in path and (info.value != 0.0 or path == "amplitude"):
            parts.append(f"{spaced(path)} {amount(info.value, info.unit)}")
    if getattr(signal, "clip", None):
        parts.append(f"clip {amount(signal.clip[0], 'V')} to {amount(signal.clip[1], 'V')}")
    return f"{name}, {', '.join(parts)}" if parts else name


def _key_figures(run: Run) -> list[tuple[str, str, str]]:
    """The first measures: name, value, and of what."""
    found = []
    for name, measure in list(run.measures.items())[:4]:
        spread = amount(deviation(measure), measure.unit, 2)
        whose = about(measure) if spread.split()[0] in (MISSING, "0") else f"± {spread}; {about(measure)}"
        found.append((spaced(name), amount(measure.value, measure.unit), whose))
    return found


def _events(run: Run) -> dict[str, Any]:
    """The events as a table, and what is said above it; nothing without any."""
    events = run.events
    if not len(events):
        return {}
    columns = [Column("time", "s", 8, shared=True), "foot", "event"] + [
        Column(name, unit, shared=True)
        for name, unit in (
            ("arrives", "m/s"), ("leaves", "m/s"), ("pull", "N"), ("strength", "N"), ("energy lost", "J"),
            ("apex before", "m"),
        )
    ]  # fmt: skip
    rows = [
        (
            event["time"], str(run.foot_names[event["foot"]]),
            EVENT_WORDS[int(event["kind"])].replace(" ", "\N{NO-BREAK SPACE}"),
            *(event[name] if name in EVENT_FIELDS[int(event["kind"])] else None for name in _LANDING),
        )
        for event in events[:MOST_EVENTS]
    ]  # fmt: skip
    kinds, counts = np.unique(events["kind"], return_counts=True)
    tally = [f"{n} × {EVENT_WORDS[int(kind)]}" for kind, n in zip(kinds, counts, strict=True)]
    return {
        "table": Table("", columns, rows), "tally": joined(tally), "listed": len(rows), "file": EVENTS_FILE,
        "rest": len(events) - len(rows), "sliding": bool(np.isin(SLIDING, kinds).any()),
    }  # fmt: skip


def _values(run: Run) -> Table:
    """Every number of the scene, its source as a label."""
    found: Table = run.scene.table()
    label = Markup('<span class="tag {0}">{0}</span>')
    rows = [(path, value, source and label.format(source), note) for path, value, source, note in found.rows]
    return Table("", found.columns, rows)
