"""The report of a landing design: before and after as Fig. 5.1 draws it, the switching times, grounds, learning."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes

from tarsus.base.arrays import Floats
from tarsus.base.events import IMPACTS
from tarsus.base.spec import float_paths, with_values
from tarsus.design.energy import energy_of
from tarsus.design.headers import digest, header_text
from tarsus.design.learning import Sensor
from tarsus.report.pages import Markup, Section, bullets, noted, sections_page, sentence_case
from tarsus.report.panel_grid import PanelGrid, line, name_axes, page_figure, panel, panels, shade
from tarsus.report.series import RunSeries, last_turns
from tarsus.report.style import BLUE, INK, MUTED, VERMILION
from tarsus.solve import simulate
from tarsus.tables.numbers import amount, number
from tarsus.tables.table import ROW, Column, Table

if TYPE_CHECKING:
    from tarsus.design.landing_design import LandingDesign
    from tarsus.design.learning import Learning
    from tarsus.report.pages import PageFigure
    from tarsus.solve import Run

SAMPLES = 1600
"""Samples of a drawn period: a plateau of 1 % of a period is then sixteen of them."""
SHOWN = 2
"""Periods drawn: the second shows that the first repeats."""
BEFORE, AFTER = VERMILION, BLUE
TITLES = ("before: plain step", "after: designed")


def landing_html(design: LandingDesign) -> str:
    """The page of a result, as text."""
    request, pair, table = design.request, DesignPair(design), design.table()
    judged = [note for note in design.found.table().notes if note not in table.notes and not note.startswith("robust,")]
    parts = [
        Section("Before and after", picture(pair), landing_zoom(pair)),
        Section("What changes", _compared(design)),
        Section("The signal", table.bare(), _rounding(design)),
        Section("Grounds", bullets(map(sentence_case, judged)), on_grounds(design), _grounds(design))
        if len(design.grounds) > 1
        else None,
        Section("What one percent costs", design.percents.table()),
        None
        if design.learning is None
        else Section("Learning on hidden grounds", _learned(design.learning), learning(design)),
        Section("landing.h", Markup('<pre tabindex="0">{}</pre>').format(header_text(design))),
    ]
    footer = f"{design.found.candidates} signals, {design.found.runs} runs. Digest {digest(design.signal)}."
    title = f"Soft landing: {request.scene.name}, foot {design.train.foot}"
    about = [f"Hardest touchdown: {table.title.partition(': ')[2]}.", noted(table)]
    return sections_page(title, about, parts, footer)


def _rounding(design: LandingDesign) -> str:
    """What a timer is asked for."""
    tick = amount(design.train.step.period / design.train.ticks, "s")
    return f"Times count from the landing edge, in ticks of {tick}; the period has {design.train.ticks} of them."


def _learned(found: Learning) -> str:
    """How fast the learners learnt."""
    sensed = "how hard each step struck" if found.sensor is Sensor.SPEED else "whether the contact had closed"
    return (
        f"Given only {sensed}, {number(100 * found.halved, 3)} % of {len(found.grounds)} learners struck with at most "
        "half the plain step's speed within ten steps."
    )


def _compared(design: LandingDesign) -> Table:
    names = (
        ("hardest touchdown", "speed", "m/s"),
        ("touchdowns a step", "touchdowns", "1"),
        ("largest impulse", "impulse", "N s"),
        ("contact a period", "contact", "s"),
        ("highest gap", "peak", "m"),
        ("mean gap in the air", "lifted", "m"),
    )
    rows = [
        (title, *(getattr(one, name)[0, 0] for one in (design.before, design.after)), unit)
        for title, name, unit in names
    ]
    for title, before, after in zip(
        ("energy a period, plain on-off", "energy a period, charge recovered"),
        energy_of(design.request.scene.robot.drives[design.train.drive], design.plain_signal),
        design.energies,
        strict=True,
    ):
        rows.append((title, before, after, "J"))
    columns = ("", Column("before", ROW), Column("after", ROW))
    return Table("", columns, [row[:3] for row in rows], units=[row[3] for row in rows])


def _grounds(design: LandingDesign) -> Table:
    known = float_paths(design.request.scene)
    paths, values = list(design.grounds.values), design.grounds.values.values()
    after = design.on_grounds
    speeds = (Column("before", "m/s", 3), Column("after", "m/s", 3), Column("touchdowns", digits=3))
    found = (design.before_on_grounds.speed[0], after.speed[0], after.touchdowns[0])
    return Table("", (*(Column(p, known[p].unit) for p in paths), *speeds), list(zip(*values, *found, strict=True)))


class DesignPair:
    """Runs of the plain step and of the design, in their periodic regime, with what is drawn of them."""

    def __init__(self, design: LandingDesign) -> None:
        self.design = design
        train, robot = design.train, design.request.scene.robot
        self.period = train.step.period
        self.foot, self.drive = list(robot.feet).index(train.foot), list(robot.drives).index(train.drive)
        lasting = design.request.duration + SHOWN * self.period
        plain = with_values(design.scene, {f"signals.{train.drive}": design.plain_signal})
        self.runs: tuple[Run, Run] = tuple(simulate(scene, lasting) for scene in (plain, design.scene))  # pyright: ignore[reportAttributeAccessIssue]
        self.series: tuple[RunSeries, RunSeries] = tuple(last_turns(run, SHOWN, SAMPLES) for run in self.runs)  # pyright: ignore[reportAttributeAccessIssue]

    def touchdowns(self, which: int, span: float | None = None) -> list[tuple[float, float]]:
        """Time [s] and speed [m/s] of the foot's touchdowns in the drawn time, counted from its begin; with `span` [s]
        those so long after the second landing edge, counted from that."""
        events = self.runs[which].events
        since = float(self.series[which].time[0]) + (0.0 if span is None else self.period)
        found = events[np.isin(events["kind"], IMPACTS) & (events["foot"] == self.foot) & (events["time"] >= since)]
        hits = [(float(one["time"]) - since, abs(float(one["speed_before"]))) for one in found]
        return hits if span is None else [one for one in hits if one[0] <= span]

    def others(self, which: int) -> list[tuple[str, Floats]]:
        """Displacements [m] (nt,) of the points that are not the foot's, by name."""
        series = self.series[which]
        own = series.foot_points[self.foot]
        rows = zip(series.points, series["displacement"], strict=True)
        return [(name, row) for name, row in rows if name != own]

    def ground(self, which: int) -> float:
        """Displacement [m] at which the foot touches."""
        return float(self.series[which].ground_levels[self.foot])

    def since_edge(self, which: int, span: float) -> tuple[np.ndarray, np.ndarray]:
        """The samples (nt,) within `span` [s] of the second landing edge, and their times from it [s]."""
        time = self.series[which].time - self.series[which].time[0] - self.period
        kept = (time >= 0.0) & (time <= span)
        return kept, time[kept]


def picture(pair: DesignPair) -> PageFigure:
    """Fig. 5.1 before and after: heights above, volts below, on one scale."""
    rows = [values - pair.ground(which) for which in (0, 1) for _, values in pair.others(which)]
    rows += [series["gap"][pair.foot] for series in pair.series]
    most, least = max(float(row.max()) for row in rows), min(float(row.min()) for row in rows)
    room = 0.06 * (most - least)

    def draw(page: PanelGrid) -> None:
        for which, (top, bottom) in enumerate(page.stacks(2, [1.7, 0.75])):
            _side(pair, which, top, bottom)
            top.set_title(TITLES[which])
            top.set_ylim(least - room, most + room)
            page.legend(top)

    return page_figure(
        draw,
        "Height of the foot and of the other points, and volts, over two periods of the periodic regime, before and "
        "after, as in Fig. 5.1 of the source. Shaded: contact. Dots: touchdowns.",
    )


def _side(pair: DesignPair, which: int, top: Axes, bottom: Axes) -> None:
    """Heights and volts of the plain step, or of the design."""
    series, color = pair.series[which], (BEFORE, AFTER)[which]
    begin = float(series.time[0])
    time = series.time - begin
    for one in (top, bottom):
        shade(one, ((max(a - begin, 0.0), b - begin) for a, b in series.contacts[pair.foot] if b > begin))
    for name, values in pair.others(which):
        line(top, time, values - pair.ground(which), color=MUTED, lw=0.8, label=name)
    line(top, time, series["gap"][pair.foot], color=color, label=series.feet[pair.foot])
    top.axhline(0.0, color=INK, lw=0.7)
    _hits(top, pair.touchdowns(which), INK)
    line(bottom, time, series["volts"][pair.drive], color=color)
    top.set_xlim(0.0, float(time[-1]))
    name_axes(top, y=("height", "m"))
    name_axes(bottom, ("time", "s"), ("drive", "V"))


def _hits(panel: Axes, touchdowns: list[tuple[float, float]], color: str) -> None:
    """Touchdowns, on the ground."""
    times = [at for at, _ in touchdowns]
    panel.plot(times, np.zeros(len(times)), "o", ms=3.0, mew=0.0, color=color)


def draw_gaps(axes: Axes, pair: DesignPair, span: float) -> None:
    """Gaps of the foot before and after for a time [s] from the landing edge on, and the hardest touchdown in words."""
    for which, series in enumerate(pair.series):
        kept, time = pair.since_edge(which, span)
        hardest = max((speed for _, speed in pair.touchdowns(which, span)), default=0.0)
        label = f"{('before', 'after')[which]}, hardest at {amount(hardest, 'm/s', 3)}"
        line(axes, time, series["gap"][pair.foot][kept], color=(BEFORE, AFTER)[which], label=label)
    name_axes(axes, ("time after the landing edge", "s"), ("gap", "m"))


def landing_zoom(pair: DesignPair) -> PageFigure:
    """The landing itself, before and after on one axis, with every touchdown."""
    span = min(0.5 * pair.period, 3.0 * pair.design.train.step.longest)

    def draw(page: PanelGrid) -> None:
        ((top, bottom),) = page.stacks(1, [1.6, 0.7])
        draw_gaps(top, pair, span)
        for which, series in enumerate(pair.series):
            kept, time = pair.since_edge(which, span)
            line(bottom, time, series["volts"][pair.drive][kept], color=(BEFORE, AFTER)[which])
            _hits(top, pair.touchdowns(which, span), (BEFORE, AFTER)[which])
        top.axhline(0.0, color=INK, lw=0.7)
        top.set_xlim(0.0, span)
        name_axes(bottom, ("time after the landing edge", "s"), ("drive", "V"))
        page.legend(top)

    return page_figure(draw, "The landing: gap and volts before and after; dots are touchdowns.")


def on_grounds(design: LandingDesign) -> PageFigure:
    """Hardest touchdown on every ground, over each number that varies, before and after."""
    units = float_paths(design.request.scene)

    def draw(axes: Axes, varied: tuple[str, Floats]) -> None:
        path, values = varied
        axes.plot(values, design.before_on_grounds.speed[0], "o", ms=3.0, color=BEFORE, label="before")
        axes.plot(values, design.on_grounds.speed[0], "o", ms=3.0, color=AFTER, label="after")
        if np.isfinite(design.worst):
            axes.axhline(design.worst, color=MUTED, lw=0.7)
        name_axes(axes, (path, units[path].unit), ("hardest touchdown", "m/s"))
        axes.set_ylim(bottom=0.0)

    return panels(
        design.grounds.values.items(),
        1.6,
        draw,
        "Hardest touchdown of the period on the grounds that the design was judged on and on the worst that was found, "
        "over each number that varies; the line is the worst after.",
    )


def learning(design: LandingDesign) -> PageFigure:
    """Speed of every step of the learners: median and the middle 80 % of the hidden grounds."""
    found = design.learning
    assert found is not None
    low, middle, high = np.quantile(found.speeds, [0.1, 0.5, 0.9], axis=0)

    def draw(axes: Axes) -> None:
        axes.fill_between(np.arange(len(low)), low, high, color=AFTER, alpha=0.25, lw=0.0)
        axes.plot(middle, color=AFTER, label="learner")
        axes.axhline(float(np.median(found.plain)), color=BEFORE, ls=(0, (5, 3)), label="plain step")
        name_axes(axes, ("steps", ""), ("hardest touchdown", "m/s"))
        axes.set_ylim(bottom=0.0)

    return panel(
        1.6, draw, f"Learning on {len(found.grounds)} hidden grounds: median and middle 80 % of the touchdown speeds."
    )
