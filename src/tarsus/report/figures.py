"""Figures of one run: motion, drive periods over each other, force split, energies, energy ledger."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import cycle

import numpy as np

from tarsus.report.pages import PageFigure
from tarsus.report.panels import Bars, Dash, DrawnLine, Level, Sign, TimePanel, Window, panels_figure
from tarsus.report.series import RunSeries, ever, joined
from tarsus.report.style import BLUE, CONTACT, CYCLE, GREEN, INK, MUTED, ORANGE, PURPLE, RULE, SKY, VERMILION
from tarsus.tables.numbers import amount, spaced

MOST_FEET = 4
"""Feet drawn one by one; a robot with more shows its first ones, for each is a screen high."""

LAW_COLORS = (GREEN, PURPLE, ORANGE, SKY, VERMILION)
"""Colours of the laws on the feet, in their order."""

GROUND: Dash = (5, 3)
"""How the level of the ground is drawn."""

TURNS, TURN_SAMPLES = 12, 400
"""Drive periods laid over each other, and samples of each: as many as a panel has pixels on a small screen."""


def motion(series: RunSeries, window: Window) -> PageFigure:
    """Drive voltage above the displacement of every point, contact shaded, ground level dashed."""
    several = len(series.feet) > 1
    shaded = len(series.feet) == 1 and bool(series.contacts[0])
    feet = list(dict.fromkeys(series.foot_points))
    lines = []
    for order, name in enumerate([*feet, *(one for one in series.points if one not in feet)]):
        words, width = (f"{name} (foot)", 1.3) if name in feet else (name, 0.9)
        values = series["displacement"][series.points.index(name)]
        lines.append(DrawnLine(series.time, values, CYCLE[order % len(CYCLE)], words, width))
    moved = TimePanel(
        2.3,
        "displacement",
        "m",
        lines,
        series.contacts[0] if shaded else (),
        levels=[Level(level, INK, GROUND) for level in sorted(set(series.ground_levels))],
        signs=[Sign("contact", CONTACT, area=True)] * shaded + [Sign("ground")] * bool(series.feet),
    )
    panels = [*([_volts(series)] if series.drives else []), moved]
    if several:
        bars = [Bars(one, row - 0.35, row + 0.35, MUTED) for row, one in enumerate(series.contacts)]
        ends = (len(series.feet) - 0.5, -0.5)
        panels.append(TimePanel(0.2 * len(series.feet), "contact", bars=bars, limits=ends, names=series.feet))
    command = " Dotted: the command to the amplifier." if "command" in series.values else ""
    return panels_figure(panels, f"Displacement of {joined(series.points)} from rest.{command}", window)


def _volts(series: RunSeries) -> TimePanel:
    """Voltages of the drives, and dotted the commands of amplifiers."""
    lines = []
    for index, name in enumerate(series.drives):
        color = INK if len(series.drives) == 1 else CYCLE[index % len(CYCLE)]
        if "command" in series.values:
            lines.append(DrawnLine(series.time, series["command"][index], color, width=0.7, dash=(1, 2)))
        lines.append(DrawnLine(series.time, series["volts"][index], color, name, 1.0))
    return TimePanel(0.62, "drive", "V", lines)


def turns(series: RunSeries) -> PageFigure | None:
    """The last drive periods of the first feet over each other, below the drive; None if nothing repeats."""
    shown, period, last = range(min(len(series.feet), MOST_FEET)), series.period, series.complete
    if period is None or not (series.drives and shown and last):
        return None
    drive = DrawnLine(series.time / period - (last - 1), series["volts"][0], MUTED)
    panels = [TimePanel(0.3, "drive", "V", [drive])]
    for foot in shown:
        *older, newest = turns_of(series, foot)
        lines = [*(DrawnLine(*one, SKY, width=0.6) for one in older), DrawnLine(*newest, BLUE, width=1.3)]
        words = f"height, {series.feet[foot]}" if len(shown) > 1 else "height"
        turned = ((a / period - (last - 1), b / period - (last - 1)) for a, b in series.contacts[foot])
        shaded = [(max(a, 0.0), min(b, 1.0)) for a, b in turned if a < 1.0 and b > 0.0]
        panels.append(TimePanel(1.0, words, "m", lines, shaded, levels=[Level(0.0, INK, GROUND)]))
    most = min(last, TURNS)
    caption = (
        f"Height above the ground over one drive period ({amount(period, 's')}): "
        f"{f'the last {most} of them over each other, the last one darkest' if most > 1 else 'one of them'}."
        f"{' Shaded is contact in the last one.' * any(series.contacts[foot] for foot in shown)} The dashed line is "
        "the ground."
    )
    if len(series.feet) > len(shown):
        caption += f" Shown are the first {MOST_FEET} of {len(series.feet)} feet."
    return panels_figure(panels, caption, (0.0, 1.0), across="drive period", unit="")


def turns_of(series: RunSeries, foot: int) -> list[tuple[np.ndarray, np.ndarray]]:
    """Parts of the period and heights [m] of the last drive periods of a foot, the newest one last."""
    phase = np.linspace(0.0, 1.0, TURN_SAMPLES + 1)
    shown = range(max(series.complete - TURNS, 0), series.complete)
    return [
        (phase, np.interp((turn + phase) * (series.period or 0.0), series.time, series["gap"][foot])) for turn in shown
    ]


def forces(series: RunSeries, window: Window, foot: int = 0) -> PageFigure:
    """Forces that act on one foot, one panel each, below its height (as Fig. 2.15 of the source)."""
    part = series.inside(window)
    contact, limit = series["contact_force"][foot], series["adhesion_strength"][foot]
    acting = [(spaced(name), series[f"{name}_force"][foot]) for name in series.laws]
    rows = [(name, force, color) for (name, force), color in zip(acting, cycle(LAW_COLORS), strict=False)]
    if "friction_force" in series.values:
        rows.append(("friction", series["friction_force"][foot], INK))
    time, shaded, zero = series.time, series.contacts[foot], [Level(0.0, RULE)]
    panels = [TimePanel(0.85, "height", "m", [DrawnLine(time, series["gap"][foot], BLUE)], shaded)]

    def add(words: str, lines: Sequence[DrawnLine]) -> None:
        panels.append(TimePanel(0.72, words, "N", lines, shaded, levels=zero))

    if series.drives:
        colors = [VERMILION, *(CYCLE[(index + 1) % len(CYCLE)] for index in range(1, len(series.drives)))]
        drawn = zip(series["drive_force"], colors, series.drives, strict=True)
        add("drive", [DrawnLine(time, *one) for one in drawn])
    for label, force, color in rows:
        if ever(force):
            add(label, [DrawnLine(time, force, color)])
    held = ever(limit[part])
    if held or ever(contact[part]):
        bound = DrawnLine(time, np.where(limit > 0.0, -limit, np.nan), MUTED, "pull-off limit", dash=(2, 2))
        add("contact", [*([bound] if held else []), DrawnLine(time, contact, INK, "contact force")])
    caption = (
        f"Forces that act on foot {series.feet[foot]} below its height above the ground, each on its own scale. "
        "Contact is shaded; forces are positive upward, friction is positive forward."
    )
    return panels_figure(panels, caption, window)


def energies(series: RunSeries, companion: RunSeries | None, window: Window) -> PageFigure:
    """Kinetic and elastic energy, with and without adhesion (as Fig. 2.12 of the source)."""
    one_foot = len(series.feet) == 1
    panels = []
    for kind in ("kinetic", "elastic"):
        name = f"{kind}_energy"
        lines = [DrawnLine(series.time, series[name], BLUE, "with adhesion" if companion is not None else "", 1.2)]
        if companion is not None:
            lines.append(DrawnLine(companion.time, companion[name], VERMILION, "without adhesion", 0.9, (4, 1.5)))
        least = 0.0 if min(np.nanmin(one.y) for one in lines) >= 0.0 else None
        contact = series.contacts[0] if one_foot else ()
        panels.append(TimePanel(0.95, spaced(name), "J", lines, contact, limits=(least, None)))
    return panels_figure(panels, "Kinetic and elastic (potential) energy of the structure; contact is shaded.", window)


LEDGER_CURVES: tuple[tuple[str, str, str, Dash], ...] = (
    ("work_in", "work in by drives", INK, ()),
    ("ground_work", "work in by the ground", INK, (4, 1.5)),
    ("stored", "kinetic + elastic", BLUE, ()),
    ("damping_loss", "structural damping", VERMILION, ()),
    ("impact_loss", "impacts", PURPLE, ()),
    ("adhesion_loss", "adhesion", ORANGE, ()),
    ("friction_loss", "friction", SKY, ()),
)


def ledger(series: RunSeries) -> PageFigure:
    """Where the energy went: cumulative curves over the whole run."""
    curves = dict(series.values)
    curves["stored"] = series["kinetic_energy"] + series["elastic_energy"]
    entries = [*LEDGER_CURVES]
    losses, works = cycle((GREEN, SKY, MUTED)), cycle((MUTED, GREEN, PURPLE))
    for name, law in series.laws.items():
        work = series[f"{name}_work"]
        curves[name] = -work if law.loses else work
        color, dash = (next(losses), ()) if law.loses else (next(works), (4, 1.5))
        entries.append((name, spaced(name), color, dash))
    lines = [
        DrawnLine(series.time, curves[name], color, label, 1.3 if name == "work_in" else 1.0, dash)
        for name, label, color, dash in entries
        if name in curves and ever(curves[name])
    ]
    caption = "Cumulative energy: what is put in, what is stored, and what each loss has taken; dashed: other work."
    return panels_figure([TimePanel(1.9, "energy since start", "J", lines)], caption, series.whole)
