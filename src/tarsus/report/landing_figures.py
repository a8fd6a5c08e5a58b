"""Figures of a landing design: before and after as Fig. 5.1 draws it, the landing itself, grounds, front, learning."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes

from tarsus.base.events import IMPACTS
from tarsus.base.spec import float_paths, with_values
from tarsus.design.energy import period_rises
from tarsus.report.series import RunSeries, last_turns
from tarsus.report.sheet import Sheet, few_ticks, name_axes, plate
from tarsus.report.style import BLUE, CONTACT, GREEN, INK, MUTED, ORANGE, RULE, VERMILION
from tarsus.solve import simulate
from tarsus.tables.numbers import amount

if TYPE_CHECKING:
    from tarsus.design.landing_design import LandingDesign
    from tarsus.report.pages import Plate
    from tarsus.solve.run import Run

SAMPLES = 1600
"""Samples of a drawn period: a plateau of 1 % of a period is then sixteen of them."""
SHOWN = 2
"""Periods drawn: the second shows that the first repeats."""
BEFORE, AFTER = VERMILION, BLUE


class DesignPair:
    """Runs of the plain step and of the design, in their periodic regime, with what is drawn of them."""

    def __init__(self, design: LandingDesign) -> None:
        self.design = design
        step, request = design.request.step, design.request
        self.period = step.period
        self.foot = list(request.scene.robot.feet).index(request.foot)
        self.drive = list(request.scene.robot.drives).index(request.drive)
        periods = design.settle + SHOWN
        plain = with_values(design.scene, {f"signals.{request.drive}": design.plain_signal})
        self.runs: tuple[Run, Run] = tuple(
            simulate(scene, periods * step.period) for scene in (plain, design.scene)
        )  # pyright: ignore[reportAttributeAccessIssue]
        self.series: tuple[RunSeries, RunSeries] = tuple(last_turns(run, SHOWN, SAMPLES) for run in self.runs)  # pyright: ignore[reportAttributeAccessIssue]

    def touchdowns(self, which: int, span: float | None = None) -> list[tuple[float, float]]:
        """Time [s] and speed [m/s] of the foot's touchdowns in the drawn time, counted from its begin; with `span` [s]
        those so long after the second landing edge, counted from that."""
        events = self.runs[which].events
        since = float(self.series[which].time[0]) + (0.0 if span is None else self.period)
        found = events[
            np.isin(events["kind"], IMPACTS) & (events["foot"] == self.foot) & (events["time"] >= since)
        ]
        hits = [(float(one["time"]) - since, abs(float(one["speed_before"]))) for one in found]
        return hits if span is None else [one for one in hits if one[0] <= span]

    def since_edge(self, which: int, span: float) -> tuple[np.ndarray, np.ndarray]:
        """The samples (nt,) within `span` [s] of the second landing edge, and their times from it [s]."""
        time = self.series[which].time - self.series[which].time[0] - self.period
        kept = (time >= 0.0) & (time <= span)
        return kept, time[kept]


def picture(pair: DesignPair) -> Plate:
    """Fig. 5.1 before and after: heights above, volts below."""
    most = 1.06 * max(float(series["gap"][pair.foot].max()) for series in pair.series)

    def draw(sheet: Sheet) -> None:
        for column, (top, bottom) in enumerate(sheet.stacks(2, [1.7, 0.75])):
            _side(pair, column, top, bottom)
            top.update_datalim([(0.0, most)])  # one scale for both
            top.set_ylim(top=max(most, top.get_ylim()[1]))
            name_axes(top, y=("height", "m"))
            name_axes(bottom, ("time", "s"), ("volts", "V"))
            sheet.legend(top)

    return plate(
        draw,
        "Height of the foot above the ground and of the other points as far above it, and volts, over two periods of "
        "the periodic regime, before and after, as in Fig. 5.1 of the source. Shaded: contact. Triangles: touchdowns.",
    )


def _side(pair: DesignPair, column: int, top: Axes, bottom: Axes) -> None:
    """Heights and volts of the plain step, or of the design."""
    series, color = pair.series[column], (BEFORE, AFTER)[column]
    begin = float(series.time[0])
    time = series.time - begin
    for start, end in series.contacts[pair.foot]:
        if end > begin:
            for axes in (top, bottom):
                axes.axvspan(max(start - begin, 0.0), end - begin, color=CONTACT, lw=0.0, zorder=0.0)
    point = series.foot_points[pair.foot]
    for name, row in zip(series.points, series["displacement"], strict=True):
        if name != point:
            top.plot(time, row - series.ground_levels[pair.foot], color=MUTED, lw=0.8, label=name)
    top.plot(time, series["gap"][pair.foot], color=color, label=series.feet[pair.foot])
    top.axhline(0.0, color=INK, lw=0.6)
    bottom.plot(time, series["volts"][pair.drive], color=color, drawstyle="steps-post")
    hits = np.array([at for at, _ in pair.touchdowns(column)])
    top.plot(hits, np.zeros(len(hits)), "^", ms=3.5, mew=0.0, color=INK)
    top.set_title(("before: plain step", "after: designed")[column])


def draw_gaps(axes: Axes, pair: DesignPair, span: float) -> None:
    """Gaps of the foot before and after for a time [s] from the landing edge on, with the hardest touchdown of each."""
    for which, series in enumerate(pair.series):
        kept, time = pair.since_edge(which, span)
        hardest = max((speed for _, speed in pair.touchdowns(which, span)), default=0.0)
        label = f"{('before', 'after')[which]}, hardest at {amount(hardest, 'm/s', 3)}"
        axes.plot(time, series["gap"][pair.foot][kept], color=(BEFORE, AFTER)[which], label=label)
    name_axes(axes, ("time after the landing edge", "s"), ("gap", "m"))


def landing_zoom(pair: DesignPair) -> Plate:
    """The landing itself, before and after on one axis, with the speed of every touchdown."""
    span = min(0.5 * pair.period, 3.0 * pair.design.request.step.longest)

    def draw(sheet: Sheet) -> None:
        ((top, bottom),) = sheet.stacks(1, [1.6, 0.7])
        draw_gaps(top, pair, span)
        for which, series in enumerate(pair.series):
            color = (BEFORE, AFTER)[which]
            kept, time = pair.since_edge(which, span)
            bottom.plot(time, series["volts"][pair.drive][kept], color=color, drawstyle="steps-post")
            hits = np.array([at for at, _ in pair.touchdowns(which, span)])
            top.plot(hits, np.zeros(len(hits)), "^", ms=4.5, mew=0.0, color=color)
        top.axhline(0.0, color=INK, lw=0.6)
        name_axes(bottom, ("time after the landing edge", "s"), ("volts", "V"))
        sheet.legend(top)

    return plate(draw, "The landing: gap and volts before and after, touchdowns as triangles.")


def on_grounds(design: LandingDesign) -> Plate:
    """Hardest touchdown on every ground, over each number that varies, before and after."""
    paths, units = list(design.grounds.values), float_paths(design.request.scene)

    def draw(sheet: Sheet) -> None:
        panels = sheet.grid(len(paths), 1.8)
        for axes, path in zip(panels, paths, strict=True):
            values = design.grounds.values[path]
            for speed, color, label in (
                (design.before_on_grounds.speed[0], BEFORE, "before"), (design.on_grounds.speed[0], AFTER, "after"),
            ):  # fmt: skip
                axes.plot(values, speed, "o", ms=3.0, mew=0.0, color=color, label=label)
            name_axes(axes, (path, units[path].unit), ("hardest touchdown (m/s)", ""))
            few_ticks(axes, x=5)
            if np.isfinite(design.worst):
                axes.axhline(design.worst, color=RULE, lw=0.8)
            axes.set_ylim(bottom=0.0)
        sheet.legend(panels[0])

    return plate(
        draw,
        "Hardest touchdown of the period on the grounds that the design was judged on and on the worst that was found, "
        "over each number that varies; the line is the worst after.",
    )


def front(design: LandingDesign) -> Plate:
    """Speed against energy: what a softer landing costs."""
    known = np.isfinite([one.energy for one in design.front]).all()
    plain = np.array(
        [one.energy if known else period_rises(np.array([one.signal.levels]))[0] for one in design.front]
    )
    speeds = np.array([one.speed for one in design.front])
    across = ("energy a period", "J") if known else ("sum of squared rises", "V^2")

    def draw(sheet: Sheet) -> None:
        (axes,) = sheet.grid(1, 1.9)
        axes.step(plain, speeds, where="post", color=RULE, lw=0.8)
        for pairs in sorted({one.pairs for one in design.front}):
            own = np.array([one.pairs == pairs for one in design.front])
            color = (MUTED, GREEN, BLUE, VERMILION, ORANGE, INK, MUTED)[pairs]
            axes.plot(plain[own], speeds[own], "o", ms=4.0, mew=0.0, color=color, label=_pairs(pairs))
        axes.set_ylim(bottom=0.0)
        name_axes(axes, across, ("hardest touchdown (m/s)", ""))
        sheet.legend(axes)

    return plate(
        draw,
        "The front on the nominal ground: designs that no other beats in both touchdown speed and plain energy.",
    )


def _pairs(count: int) -> str:
    return "no pair" if count == 0 else "1 pair" if count == 1 else f"{count} pairs"


def learning(design: LandingDesign) -> Plate:
    """Speed of every step of the learners: median and the middle 80 % of the hidden grounds."""
    found = design.learning
    assert found is not None
    low, middle, high = np.quantile(found.speeds, [0.1, 0.5, 0.9], axis=0)

    def draw(sheet: Sheet) -> None:
        (axes,) = sheet.grid(1, 1.9)
        axes.fill_between(np.arange(len(low)), low, high, color=RULE, lw=0.0)
        axes.plot(np.arange(len(low)), middle, color=AFTER, label="learner")
        axes.axhline(float(np.median(found.plain)), color=BEFORE, lw=0.8, label="plain step")
        axes.set_ylim(bottom=0.0)
        axes.set_xlabel("steps")
        axes.set_ylabel("hardest touchdown (m/s)")
        sheet.legend(axes)

    return plate(
        draw,
        f"Learning on {len(found.grounds)} hidden grounds: median and middle 80 % of the touchdown speeds.",
    )
