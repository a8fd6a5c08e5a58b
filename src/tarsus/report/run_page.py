"""The report of one run: one HTML file that needs nothing else to be read."""

from __future__ import annotations

import math
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
from tarsus.report.explorer import small_explorer
from tarsus.report.motion import Motion, motion_of, whole_motion
from tarsus.report.pages import Fold, PageFigure, Section, marked, said, sections_page, sources, terms, write_page
from tarsus.report.panels import Window
from tarsus.report.player import walk_figure
from tarsus.report.series import RunSeries, joined, series_of
from tarsus.tables.numbers import MISSING, amount, number, spaced
from tarsus.tables.table import Column, Table

if TYPE_CHECKING:
    from tarsus.orbits.attractors import Attractors
    from tarsus.solve import Run

MOST_EVENTS = 500
"""Rows of the event table in the page: they make a tenth of its size; all events are in `events.csv`."""

CLOSE_UP = 2
"""Drive periods shown by the figures of detail: the second shows whether the first repeats."""

FRAMES = 480
"""Frames of the moving points of a robot without legs: two periods at twenty a second and twelve seconds each."""

_LANDING = ("speed_before", "speed_after", "pull", "strength", "energy", "apex")
_HOLDING = ("pull", "strength")
EVENT_FIELDS = {kind: _LANDING if kind in IMPACTS else _HOLDING for kind in EVENT_WORDS}
"""What an event of each kind has a value for: leaving the ground is no impact and ends no flight."""


def write_report(
    run: Run, path: str | Path, companion: Run | None = None, others: Attractors | None = None, *, static: bool = False
) -> Path:
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
    variables = run.variables()
    series, whole = series_of(run, variables), whole_motion(run, variables)
    detail = series.last_periods(CLOSE_UP)
    walker = isinstance(run.scene.robot.structure, Walker)
    motion, forces = _walk(run, whole, detail) if walker else _motion(series, whole, detail)
    explorer = "" if static else small_explorer(run)
    sections = [
        Section("The walk" if walker else "Motion", *motion),
        Section("Measures", measures_summary(run.measures, ""), _definitions(run), SPREAD),
        Section("Turn it", Fold(TURN, marked(MORE), explorer)) if explorer else None,
        Section("Forces", *forces) if forces else None,
        _energy(run, series, None if companion is None else series_of(companion), detail),
        Section("Events", *_events(run)),
        Section("Values of this run", VALUES, values_table(run.scene)),
        sources(run.scene.citations),
    ]
    others_table = None if others is None else others.compared_with(run)
    about = [*_about(run), others_table, _key_figures(run)]
    return sections_page(run.scene.name, about, sections, CONVENTIONS)


SPREAD = """Spread is the standard deviation over the n values the measure was taken from; names that begin with max,
total or longest are of the whole run."""

TURN = "The engine is in this page: sliders of the ground and the drive run the scene anew"
MORE = "<code>tarsus explore</code> makes a page with all of its numbers."

VALUES = """Every number that entered the simulation, with its origin; a dash marks a value set by the user or left at
its default."""

CONVENTIONS = """Conventions: z is up, a gap is positive when open, forces on the structure are positive along the
ground's normal."""


def _about(run: Run) -> list[Any]:
    """The run in sentences: its drive, how it ended, what a reader must not miss, how it settled."""
    landing, repeats = _landing(run.scene), settled(run)
    wall = f", computed in {amount(run.wall_s, 's', 3)}" if math.isfinite(run.wall_s) and run.wall_s else ""
    return [
        _signals(run.scene) or "no drive signal",
        said(run.code.value, failed=not run.ok),
        f"A foot that lands: {landing}." if landing else "",
        *(said(sentence, failed=True) for sentence in _warnings(run)),
        f"{amount(run.duration, 's')} simulated{wall}; {len(run.events)} contact events; energy ledger closes to "
        f"{number(run.ledger.closure, 2)}.",
        said(str(repeats), failed=repeats.multiple == 0) if repeats else None,
    ]


def _definitions(run: Run) -> Fold:
    definitions = {spaced(name): measure.definition for name, measure in run.measures.items()}
    return Fold("What each measure is", terms(definitions))


def _energy(run: Run, series: RunSeries, companion: RunSeries | None, detail: Window) -> Section:
    """Where the energy went, in figures and numbers."""
    pair = [figures.energies(series, companion, detail), figures.ledger(series)]
    return Section("Energy", pair, Fold("The account in numbers", account(run)))


def _warnings(run: Run) -> list[str]:
    """What a reader must not miss: an impact law that can create energy, and the run's own remarks."""
    remarks: list[str] = list(run.remarks)
    if run.scene.ground.impact is None:
        return remarks
    from tarsus.model.impact_energy import creation_warning

    created = creation_warning(run.scene)
    return remarks if created is None else [created, *remarks]


def _walk(run: Run, whole: Motion, detail: Window) -> tuple[list[PageFigure], list[PageFigure]]:
    """Figures of a walk, and those of the forces on its feet."""
    motion: list[PageFigure] = [walk_figure(motion_of(run, whole=whole)), walk_figures.travel(whole)]
    if "yaw" in whole.body:
        motion.append(walk_figures.path_above(whole))
    if not run.foot_names:
        return motion, []
    return [*motion, walk_figures.footfalls(whole, detail)], [walk_figures.ground_forces(whole, detail)]


def _motion(series: RunSeries, whole: Motion, detail: Window) -> tuple[list[PageFigure], list[PageFigure]]:
    """Figures of the motion of points, and those of the forces on the first feet."""
    motion: list[PageFigure] = [figures.motion(series, series.whole)]
    if detail != series.whole:
        figure = figures.motion(series, detail)
        motion.append(PageFigure(figure.picture, f"The last {CLOSE_UP} drive periods of the run. {figure.caption}"))
    motion.append(walk_figure(whole.taken(series.inside(detail)).thinned(FRAMES)))
    turns = figures.turns(series)
    motion += [turns] if turns is not None else []
    feet = range(min(len(series.feet), figures.MOST_FEET))
    return motion, [figures.forces(series, detail, foot) for foot in feet]


def _signals(scene: Any) -> str:
    """All drives in words."""
    gait = {} if scene.gait is None else {"gait": scene.gait}
    return "; ".join(f"{name}: {_signal(signal)}" for name, signal in {**gait, **scene.signals}.items())


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


def _key_figures(run: Run) -> Markup | None:
    """The first measures: name, value, and of what."""
    found = []
    for name, measure in list(run.measures.items())[:4]:
        spread = amount(deviation(measure), measure.unit, 2)
        whose = about(measure) if spread.split()[0] in (MISSING, "0") else f"± {spread}; {about(measure)}"
        found.append(FIGURE.format(spaced(name), amount(measure.value, measure.unit), whose))
    return Markup('<dl class="key">{}</dl>').format(Markup("").join(found)) if found else None


FIGURE = Markup('<div><dt>{}</dt><dd>{}</dd><dd class="about">{}</dd></div>')


def _events(run: Run) -> list[Any]:
    """The events as a table, below what is said of it."""
    events = run.events
    if not len(events):
        return ["No foot touched the ground."]
    columns = [Column("time", "s", 8, shared=True), "foot", "event"] + [
        Column(name, unit, shared=True)
        for name, unit in (
            ("arrives", "m/s"),
            ("leaves", "m/s"),
            ("pull", "N"),
            ("strength", "N"),
            ("energy lost", "J"),
            ("apex before", "m"),
        )
    ]
    rows = [
        (
            event["time"],
            str(run.foot_names[event["foot"]]),
            EVENT_WORDS[int(event["kind"])].replace(" ", "\N{NO-BREAK SPACE}"),
            *(event[name] if name in EVENT_FIELDS[int(event["kind"])] else None for name in _LANDING),
        )
        for event in events[:MOST_EVENTS]
    ]
    kinds, counts = np.unique(events["kind"], return_counts=True)
    texts = [f"{joined([f'{n} × {EVENT_WORDS[int(kind)]}' for kind, n in zip(kinds, counts, strict=True)])}."]
    if len(events) > len(rows):
        texts.append(f"The first {len(rows)} are listed; {len(events) - len(rows)} more are in {EVENTS_FILE}.")
    texts.append(EVENTS)
    if np.isin(SLIDING, kinds).any():
        texts.append(SLIDES)
    return [" ".join(texts), Table("", columns, rows)]


EVENTS = """Arrives and leaves are speeds towards and away from the ground, pull is the structure's net force on the
foot away from it, strength what adhesion could hold at that moment, apex the highest point of the flight before."""

SLIDES = "Where slip or stick begins, pull is the force along the ground, strength the most friction bears."


def values_table(scene: Any) -> Table:
    """Every number of a scene, its source as a label."""
    found: Table = scene.table()
    label = Markup('<span class="tag {0}">{0}</span>')
    rows = [(path, value, source and label.format(source), note) for path, value, source, note in found.rows]
    return Table("", found.columns, rows)
