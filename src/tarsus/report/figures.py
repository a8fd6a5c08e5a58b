"""Figures of one run: motion, drive periods over each other, force split, energies, energy ledger."""

from __future__ import annotations

from itertools import cycle

import numpy as np

from tarsus.report.charts import ChartPanel, Charts, Dash, Window
from tarsus.report.pages import Plate
from tarsus.report.series import PlotTrace, RunSeries, by_drive, ever, foot_traces, joined
from tarsus.report.style import BLUE, CONTACT, CYCLE, GREEN, INK, MUTED, ORANGE, PURPLE, RULE, SKY, VERMILION
from tarsus.tables.numbers import amount, spaced

MOST_FEET = 4
"""Feet drawn one by one; a robot with more shows its first ones, for each is a screen high."""

LAW_COLORS = (GREEN, PURPLE, ORANGE, SKY, VERMILION)
"""Colours of the laws on the feet, in their order."""

GROUND: Dash = (0, (5, 3))
"""How the level of the ground is drawn."""

TURNS, TURN_SAMPLES = 12, 400
"""Drive periods laid over each other, and samples of each: as many as a panel has pixels on a small screen."""


def motion(series: RunSeries, window: Window) -> Plate:
    """Drive voltage above the displacement of every point, contact shaded, ground level dashed."""
    several = len(series.feet) > 1
    driven = bool(series.drives)
    charts = Charts([0.62] * driven + [2.3] + [0.2 * len(series.feet)] * several, window=window)
    axes = charts.panels[int(driven)]
    if driven:
        for index, name in enumerate(series.drives):
            color = INK if len(series.drives) == 1 else CYCLE[index % len(CYCLE)]
            if "command" in series.values:
                dots: Dash = (0, (1, 2))
                charts.panels[0].plot(
                    series.time, series["command"][index], color=color, lw=0.7, ls=dots, zorder=1.5
                )
            charts.panels[0].plot(series.time, series["volts"][index], color=color, lw=1.0, label=name)
        charts.panels[0].set_ylabel("drive", "V")
    feet = list(dict.fromkeys(series.foot_points))
    for order, name in enumerate([*feet, *(one for one in series.points if one not in feet)]):
        foot = name in feet
        axes.plot(
            series.time, series["displacement"][series.points.index(name)], color=CYCLE[order % len(CYCLE)],
            label=f"{name} (foot)" if foot else name, lw=1.3 if foot else 0.9, zorder=2.5 if foot else 2.0,
        )  # fmt: skip
    for level in sorted(set(series.ground_levels)):
        axes.axhline(level, color=INK, ls=GROUND)
    axes.set_ylabel("displacement", "m")
    shaded = len(series.feet) == 1 and bool(series.contacts[0])
    if shaded:
        axes.shade(series.contacts[0])
        axes.sign("contact", CONTACT, area=True)
    if series.feet:
        axes.sign("ground")
    if several:
        rows = charts.panels[-1]
        for row, contacts in enumerate(series.contacts):
            rows.bars(contacts, row - 0.35, row + 0.35, color=MUTED)
        rows.set_yticks(range(len(series.feet)), series.feet)
        rows.set_ylim(len(series.feet) - 0.5, -0.5)
        rows.set_ylabel("contact")
    caption = f"Displacement of {joined(series.points)} from rest{' under the drive voltage above' * driven}"
    if "command" in series.values:
        caption += " (dotted: what the amplifier is told to give)"
    if several or shaded:
        caption += f"; {'the bars below mark' if several else 'shading marks'} contact"
    if series.feet:
        caption += "; the dashed line is the displacement at which the foot touches the ground"
    return charts.plate(f"{caption}.")


def turns(series: RunSeries) -> Plate | None:
    """The last drive periods of the first feet over each other; None if nothing repeats."""
    traces = foot_traces(series)
    if not traces:
        return None
    found = periods_over_each_other(traces[:MOST_FEET])
    if len(traces) <= MOST_FEET:
        return found
    return Plate(found.picture, f"{found.caption} Shown are the first {MOST_FEET} of {len(traces)} feet.")


def periods_over_each_other(traces: list[PlotTrace]) -> Plate:
    """Heights over the drive period, its last turns over each other: a panel a trace, below the drive of them."""
    drives = by_drive(traces)
    heights = [high for same in drives for high in (0.3, *(1.0 for _ in same))]
    charts = Charts(heights, "drive period", "", (0.0, 1.0))
    free = iter(charts.panels)
    for same in drives:
        last = same[0].last_periods(TURNS)[1]
        drive = next(free)
        drive.plot(same[0].time / same[0].period - last + 1, same[0].volts, color=MUTED, lw=0.9)
        drive.set_ylabel("drive", "V")
        for trace in same:
            _turns(next(free), trace, f"height, {trace.title}" if len(traces) > 1 else "height")
    most = max(last - first for first, last in (one.last_periods(TURNS) for one in traces))
    each = f" ({amount(traces[0].period, 's')})" if len({one.period for one in traces}) == 1 else ""
    which = f"the last {most} of them over each other, the last one darkest" if most > 1 else "one of them"
    shaded = " Shaded is contact in the last one." if any(one.contacts for one in traces) else ""
    return charts.plate(
        f"Height above the ground over one drive period{each}: {which}.{shaded} The dashed line is the ground."
    )


def _turns(panel: ChartPanel, trace: PlotTrace, name: str) -> None:
    """The last drive periods of a trace, the newest one above the others."""
    phase = np.linspace(0.0, 1.0, TURN_SAMPLES + 1)
    first, last = trace.last_periods(TURNS)
    for turn in range(first, last):
        newest = turn == last - 1
        height = np.interp((turn + phase) * trace.period, trace.time, trace.height)
        panel.plot(phase, height, color=BLUE, lw=1.3 if newest else 0.6, alpha=1.0 if newest else 0.35)
    panel.axhline(0.0, color=INK, ls=GROUND)
    panel.set_ylabel(name, "m")
    panel.shade((a / trace.period - last + 1, b / trace.period - last + 1) for a, b in trace.contacts)


def forces(series: RunSeries, window: Window, foot: int = 0) -> Plate:
    """Forces on one foot, one panel each, below its height (as Fig. 2.15 of the source)."""
    part = series.inside(window)
    contact, limit = series["contact_force"][foot], series["adhesion_strength"][foot]
    acting = {spaced(name): series[f"{name}_force"][foot] for name in series.laws}
    rows = [
        (name, force, color)
        for (name, force), color in zip(acting.items(), cycle(LAW_COLORS), strict=False)
        if ever(force)
    ]
    absent = [name for name, force in acting.items() if not ever(force)]
    along = series.values.get("friction_force")
    rubbed = along is not None and ever(along[foot])
    if along is not None and rubbed:
        rows.append(("friction", along[foot], INK))
    touched, held = ever(contact[part]) or ever(limit[part]), ever(limit[part])
    absent += [] if touched else ["contact"]

    driven = bool(series.drives)
    charts = Charts([0.85] + [0.72] * (driven + len(rows) + touched), window=window)
    for axes in charts.panels:
        axes.shade(series.contacts[foot])
    for axes in charts.panels[1:]:
        axes.axhline(0.0, color=RULE)
    panels = iter(charts.panels)
    axes = next(panels)
    axes.plot(series.time, series["gap"][foot], color=BLUE)
    axes.set_ylabel("height", "m")
    if driven:
        axes = next(panels)
        for index, name in enumerate(series.drives):
            color = VERMILION if index == 0 else CYCLE[(index + 1) % len(CYCLE)]
            axes.plot(series.time, series["drive_force"][index], color=color, label=name)
        axes.set_ylabel("drive", "N")
    for label, force, color in rows:
        axes = next(panels)
        axes.plot(series.time, force, color=color)
        axes.set_ylabel(label, "N")
    if touched:
        axes = next(panels)
        if held:
            bound = np.where(limit > 0.0, -limit, np.nan)
            axes.plot(series.time, bound, color=MUTED, ls=(0, (2, 2)), label="pull-off limit")
        axes.plot(series.time, contact, color=INK, label="contact force")
        axes.set_ylabel("contact", "N")
    caption = (
        f"Forces on foot {series.feet[foot]} below its height above the ground, each on its own scale; positive pushes "
        "the foot off the ground, contact is shaded."
    )
    if rubbed:
        caption += " Friction acts along the ground, positive forward."
    if held:
        caption += (
            " While it sticks, adhesion holds (contact force below zero) until the pull-off limit is reached."
        )
    if absent:
        caption += f" No {' or '.join(absent)} force acts in this stretch."
    return charts.plate(caption)


def energies(series: RunSeries, companion: RunSeries | None, window: Window) -> Plate:
    """Kinetic and elastic energy, with and without adhesion (as Fig. 2.12 of the source)."""
    charts = Charts([0.95, 0.95], window=window)
    one_foot = len(series.feet) == 1
    own = "with adhesion" if companion is not None else ""
    for axes, kind in zip(charts.panels, ("kinetic", "elastic"), strict=True):
        curves = [one[f"{kind}_energy"] for one in (series, companion) if one is not None]
        axes.plot(series.time, curves[0], color=BLUE, lw=1.2, label=own)
        if companion is not None:
            axes.plot(
                companion.time, curves[1], color=VERMILION, lw=0.9, ls=(0, (4, 1.5)), label="without adhesion"
            )
        axes.set_ylabel(f"{kind} energy", "J")
        if min(np.nanmin(values) for values in curves) >= 0.0:
            axes.set_ylim(bottom=0.0)
        if one_foot:
            axes.shade(series.contacts[0])
    caption = "Kinetic energy and elastic (potential) energy of the structure"
    if companion is not None:
        caption += ", as simulated and for the same scene with adhesion switched off"
    if one_foot and series.contacts[0]:
        caption += (
            "; shading marks contact of the run with adhesion"
            if companion is not None
            else ", contact shaded"
        )
    return charts.plate(f"{caption}.")


LEDGER_CURVES: tuple[tuple[str, str, str, Dash], ...] = (
    ("work_in", "work in by drives", INK, "-"),
    ("ground_work", "work in by the ground", INK, (0, (4, 1.5))),
    ("stored", "kinetic + elastic", BLUE, "-"),
    ("damping_loss", "structural damping", VERMILION, "-"),
    ("impact_loss", "impacts", PURPLE, "-"),
    ("adhesion_loss", "adhesion", ORANGE, "-"),
    ("friction_loss", "friction", SKY, "-"),
)


def ledger(series: RunSeries) -> Plate:
    """Where the energy went: cumulative curves over the whole run."""
    charts = Charts([1.9], window=series.whole)
    curves = dict(series.values)
    curves["stored"] = series["kinetic_energy"] + series["elastic_energy"]
    entries = [*LEDGER_CURVES]
    losses, works = cycle((GREEN, SKY, MUTED)), cycle((MUTED, GREEN, PURPLE))
    for name, law in series.laws.items():
        work = series[f"{name}_work"]
        curves[name] = -work if law.loses else work
        color, dash = (next(losses), "-") if law.loses else (next(works), (0, (4, 1.5)))
        entries.append((name, spaced(name), color, dash))
    for name, label, color, dash in entries:
        if name in curves and ever(curves[name]):
            width = 1.3 if name == "work_in" else 1.0
            charts.panels[0].plot(series.time, curves[name], color=color, lw=width, ls=dash, label=label)
    charts.panels[0].set_ylabel("energy since start", "J")
    caption = "Cumulative energy: what the drives put in, what is stored, and what each loss has taken"
    if any(not law.loses and ever(series[f"{name}_work"]) for name, law in series.laws.items()):
        caption += "; dashed is work on the structure"
    return charts.plate(f"{caption}.")
