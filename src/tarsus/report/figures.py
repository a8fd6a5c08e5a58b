"""Figures of one run: motion, force split, energies, energy ledger."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import cycle
from typing import TYPE_CHECKING

import numpy as np

from tarsus.report.charts import ChartPanel, Dash, stack
from tarsus.report.pages import Plate
from tarsus.report.series import RunSeries, Window, ever, joined
from tarsus.report.style import (
    BLUE,
    CONTACT,
    CYCLE,
    GREEN,
    INK,
    MUTED,
    ORANGE,
    PURPLE,
    RULE,
    SKY,
    VERMILION,
    AxisScale,
    scale_of,
    time_axis,
)
from tarsus.tables.numbers import spaced

if TYPE_CHECKING:
    from matplotlib.axes import Axes

MOST_FEET = 4
"""Feet drawn one by one; a robot with more shows its first ones, for each is a screen high."""

LAW_COLORS = (GREEN, PURPLE, ORANGE, SKY, VERMILION)
"""Colours of the laws on the feet, in their order."""


def motion(series: RunSeries, window: Window) -> Plate:
    """Drive voltage above the displacement of every point, contact shaded, ground level dashed."""
    several = len(series.feet) > 1
    driven = bool(series.drives)
    heights = [0.62] * driven + [2.3] + [0.2 * len(series.feet)] * several
    figure, panels = stack(heights)
    clock = _clock(window)
    if driven:
        _voltage(panels[0], series, window, clock)

    axes = panels[int(driven)]
    shift = series["displacement"]
    scale = scale_of("m", shift[:, series.inside(window)])
    feet = list(dict.fromkeys(series.foot_points))
    others = [name for name in series.points if name not in feet]
    for order, name in enumerate(feet + others):
        is_foot = name in feet
        look = {"lw": 1.3, "zorder": 2.5} if is_foot else {"lw": 0.9, "zorder": 2.0}
        label = f"{name} (foot)" if is_foot else name
        values = shift[series.points.index(name)]
        _line(
            axes, series, window, clock, values, scale, color=CYCLE[order % len(CYCLE)], label=label, **look
        )
    for level in sorted(set(series.ground_levels)):
        axes.axhline(level / scale.step, color=INK, lw=0.7, ls=(0, (5, 3)), zorder=1)
    axes.set_ylabel(scale.axis("displacement"))
    shaded = len(series.feet) == 1 and bool(series.contacts[0])
    if shaded:
        shade(axes, series.contacts[0], window, clock)
        axes.sign("contact", CONTACT, area=True)
    if series.feet:
        axes.sign("ground")
    if several:
        _contact_rows(panels[-1], series, window, clock)
    time_axis(panels[-1], window, clock)
    caption = f"Displacement of {joined(series.points)} from rest{' under the drive voltage above' * driven}"
    if "command" in series.values:
        caption += " (dotted: what the amplifier is told to give)"
    if several or shaded:
        caption += f"; {'the bars below mark' if several else 'shading marks'} contact"
    if series.feet:
        caption += "; the dashed line is the displacement at which the foot touches the ground"
    caption += "."
    return Plate(figure.html(caption), caption)


def forces(series: RunSeries, window: Window, foot: int = 0) -> Plate:
    """Forces on one foot, one panel each, below its height (as Fig. 2.15 of the source)."""
    part = series.inside(window)
    clock = _clock(window)
    contact = series["contact_force"][foot]
    limit = series["adhesion_strength"][foot]
    rows: list[tuple[str, np.ndarray, str]] = []
    absent: list[str] = []
    for name, color in zip(series.laws, cycle(LAW_COLORS), strict=False):
        label, values = spaced(name), series[f"{name}_force"][foot]
        if ever(values):
            rows.append((label, values, color))
        else:
            absent.append(label)
    along = series.values.get("friction_force")
    if along is not None and ever(along[foot]):
        rows.append(("friction", along[foot], INK))
    drive = [(name, series["drive_force"][i]) for i, name in enumerate(series.drives)]
    touched = ever(contact[part]) or ever(limit[part])
    if not touched:
        absent.append("contact")

    count = 1 + len(rows) + bool(drive) + touched
    figure, panels = stack([0.85] + [0.72] * (count - 1))
    gap = series["gap"][foot]
    scale = scale_of("m", gap[part])
    _line(panels[0], series, window, clock, gap, scale, color=BLUE)
    panels[0].set_ylabel(scale.axis("height"))

    scale = scale_of("N", *(values[part] for _, values in drive)) if drive else scale_of("N")
    for index, (name, values) in enumerate(drive):
        color = VERMILION if index == 0 else CYCLE[(index + 1) % len(CYCLE)]
        _line(panels[1], series, window, clock, values, scale, color=color, label=name)
    if drive:
        panels[1].set_ylabel(scale.axis("drive"))

    for axes, (label, values, color) in zip(panels[1 + bool(drive) :], rows, strict=False):
        scale = scale_of("N", values[part])
        _line(axes, series, window, clock, values, scale, color=color)
        axes.set_ylabel(scale.axis(label))
    if touched:
        axes = panels[-1]
        scale = scale_of("N", contact[part], limit[part])
        if ever(limit[part]):
            bound = np.where(limit > 0.0, -limit, np.nan)
            _line(
                axes, series, window, clock, bound, scale, color=MUTED, ls=(0, (2, 2)), label="pull-off limit"
            )
        _line(axes, series, window, clock, contact, scale, color=INK, label="contact force")
        axes.set_ylabel(scale.axis("contact"))
    for axes in panels:
        shade(axes, series.contacts[foot], window, clock)
        if axes is not panels[0]:
            axes.axhline(0.0, color=RULE, lw=0.7, zorder=0)
    time_axis(panels[-1], window, clock)
    name = series.feet[foot]
    caption = (
        f"Forces on foot {name} below its height above the ground, each on its own scale; positive pushes "
        "the foot off the ground, contact is shaded."
    )
    if along is not None and ever(along[foot]):
        caption += " Friction acts along the ground, positive forward."
    if touched and ever(limit[part]):
        caption += (
            " While it sticks, adhesion holds (contact force below zero) until the pull-off limit is reached."
        )
    if absent:
        caption += f" No {' or '.join(absent)} force acts in this stretch."
    return Plate(figure.html(caption), caption)


def energies(series: RunSeries, companion: RunSeries | None, window: Window) -> Plate:
    """Kinetic and elastic energy, with and without adhesion (as Fig. 2.12 of the source)."""
    figure, panels = stack([0.95, 0.95])
    clock = _clock(window)
    for axes, name, label in zip(
        panels, ("kinetic_energy", "elastic_energy"), ("kinetic energy", "elastic energy"), strict=True
    ):
        shown = [series[name][series.inside(window)]]
        if companion is not None:
            shown.append(companion[name][companion.inside(window)])
        scale = scale_of("J", *shown)
        without = "without adhesion"
        own = "with adhesion" if companion is not None else ""
        _line(axes, series, window, clock, series[name], scale, color=BLUE, lw=1.2, label=own)
        if companion is not None:
            style = {"color": VERMILION, "lw": 0.9, "ls": (0, (4, 1.5)), "label": without}
            _line(axes, companion, window, clock, companion[name], scale, **style)
        axes.set_ylabel(scale.axis(label))
        if axes.least() >= 0.0:
            axes.set_ylim(bottom=0.0)
        if len(series.feet) == 1:
            shade(axes, series.contacts[0], window, clock)
    time_axis(panels[-1], window, clock)
    caption = "Kinetic energy and elastic (potential) energy of the structure"
    if companion is not None:
        caption += ", as simulated and for the same scene with adhesion switched off"
    if len(series.feet) == 1 and series.contacts[0]:
        caption += (
            "; shading marks contact of the run with adhesion"
            if companion is not None
            else ", contact shaded"
        )
    caption += "."
    return Plate(figure.html(caption), caption)


LEDGER_CURVES: tuple[tuple[str, str, str, Dash], ...] = (
    ("work_in", "work in by drives", INK, "-"),
    ("stored", "kinetic + elastic", BLUE, "-"),
    ("damping_loss", "structural damping", VERMILION, "-"),
    ("impact_loss", "impacts", PURPLE, "-"),
    ("adhesion_loss", "adhesion", ORANGE, "-"),
    ("friction_loss", "friction", SKY, "-"),
)


def ledger(series: RunSeries) -> Plate:
    """Where the energy went: cumulative curves over the whole run."""
    figure, (axes,) = stack([1.9])
    window = series.whole
    clock = _clock(window)
    curves = dict(series.values)
    curves["stored"] = series["kinetic_energy"] + series["elastic_energy"]
    entries = [*LEDGER_CURVES]
    losses, works = cycle((GREEN, SKY, MUTED)), cycle((MUTED, GREEN, PURPLE))
    for name, law in series.laws.items():
        work = series[f"{name}_work"]
        curves[name] = -work if law.loses else work
        color, dash = (next(losses), "-") if law.loses else (next(works), (0, (4, 1.5)))
        entries.append((name, spaced(name), color, dash))
    shown = [entry for entry in entries if entry[0] in curves and ever(curves[entry[0]])]
    scale = scale_of("J", *(curves[name] for name, *_ in shown))
    for name, label, color, dash in shown:
        width = 1.3 if name == "work_in" else 1.0
        _line(axes, series, window, clock, curves[name], scale, color=color, lw=width, ls=dash, label=label)
    axes.set_ylabel(scale.axis("energy since start"))
    time_axis(axes, window, clock)
    caption = "Cumulative energy: what the drives put in, what is stored, and what each loss has taken"
    if any(not law.loses and ever(series[f"{name}_work"]) for name, law in series.laws.items()):
        caption += "; dashed is work on the structure"
    caption += "."
    return Plate(figure.html(caption), caption)


def _clock(window: Window) -> AxisScale:
    return scale_of("s", window[1] - window[0])


def _line(
    axes: ChartPanel,
    series: RunSeries,
    window: Window,
    clock: AxisScale,
    values: np.ndarray,
    scale: AxisScale,
    **style: object,
) -> None:
    part = series.inside(window)
    axes.plot(series.time[part] / clock.step, np.asarray(values[part], dtype=float) / scale.step, **style)  # type: ignore[arg-type]


def _voltage(axes: ChartPanel, series: RunSeries, window: Window, clock: AxisScale) -> None:
    part = series.inside(window)
    scale = scale_of("V", series["volts"][:, part])
    for index, name in enumerate(series.drives):
        color = INK if len(series.drives) == 1 else CYCLE[index % len(CYCLE)]
        if "command" in series.values:
            dots: dict[str, object] = {"color": color, "lw": 0.7, "ls": (0, (1, 2)), "zorder": 1.5}
            _line(axes, series, window, clock, series["command"][index], scale, **dots)
        _line(axes, series, window, clock, series["volts"][index], scale, color=color, lw=1.0, label=name)
    axes.set_ylabel(scale.axis("drive"))


def shade(axes: Axes | ChartPanel, contacts: Sequence[Window], window: Window, clock: AxisScale) -> None:
    """Shade the stretches of contact [s] within a window."""
    least = (window[1] - window[0]) / 1500.0
    for a, b in contacts:
        if b > window[0] and a < window[1]:
            axes.axvspan(a / clock.step, max(b, a + least) / clock.step, color=CONTACT, lw=0.0, zorder=0.0)


def _contact_rows(axes: ChartPanel, series: RunSeries, window: Window, clock: AxisScale) -> None:
    for row, contacts in enumerate(series.contacts):
        spans = [
            (a / clock.step, (b - a) / clock.step) for a, b in contacts if b > window[0] and a < window[1]
        ]
        axes.broken_barh(spans, (row - 0.35, 0.7), color=MUTED, lw=0)
    axes.set_yticks(range(len(series.feet)), series.feet)
    axes.set_ylim(len(series.feet) - 0.5, -0.5)
    axes.set_ylabel("contact")
