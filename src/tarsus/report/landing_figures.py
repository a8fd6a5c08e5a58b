"""Figures of a landing design: before and after as Fig. 5.1 draws it, the landing itself, grounds, front, learning."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

import numpy as np

from tarsus.base.arrays import Floats
from tarsus.base.events import IMPACTS
from tarsus.base.spec import float_paths, with_values
from tarsus.design.energy import period_rises
from tarsus.report.charts import ChartPanel, Charts, side_by_side, with_room
from tarsus.report.series import RunSeries, last_turns
from tarsus.report.style import BLUE, GREEN, INK, MUTED, ORANGE, VERMILION
from tarsus.solve import simulate
from tarsus.tables.numbers import amount

if TYPE_CHECKING:
    from tarsus.design.landing_design import LandingDesign
    from tarsus.report.pages import Plate
    from tarsus.solve import Run

SAMPLES = 1600
"""Samples of a drawn period: a plateau of 1 % of a period is then sixteen of them."""
SHOWN = 2
"""Periods drawn: the second shows that the first repeats."""
BEFORE, AFTER = VERMILION, BLUE
TITLES = ("before: plain step", "after: designed")


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


def picture(pair: DesignPair) -> Plate:
    """Fig. 5.1 before and after: heights above, volts below, on one scale."""
    rows = [values - pair.ground(which) for which in (0, 1) for _, values in pair.others(which)]
    rows += [series["gap"][pair.foot] for series in pair.series]
    most, least = max(float(row.max()) for row in rows), min(float(row.min()) for row in rows)
    room = 0.06 * (most - least)
    return side_by_side(
        ((title, _side(pair, which, (least - room, most + room))) for which, title in enumerate(TITLES)),
        "Height of the foot above the ground and of the other points as far above it, and volts, over two periods of "
        "the periodic regime, before and after, as in Fig. 5.1 of the source. Shaded: contact. Dots: touchdowns.",
    )


def _side(pair: DesignPair, which: int, limits: tuple[float, float]) -> Charts:
    """Heights and volts of the plain step, or of the design."""
    series, color = pair.series[which], (BEFORE, AFTER)[which]
    begin = float(series.time[0])
    time = series.time - begin
    charts = Charts([1.7, 0.75], window=(0.0, float(time[-1])))
    top, bottom = charts.panels
    for panel in charts.panels:
        panel.shade((max(a - begin, 0.0), b - begin) for a, b in series.contacts[pair.foot] if b > begin)
    for name, values in pair.others(which):
        top.plot(time, values - pair.ground(which), color=MUTED, lw=0.8, label=name)
    top.plot(time, series["gap"][pair.foot], color=color, label=series.feet[pair.foot])
    top.axhline(0.0, color=INK)
    _hits(top, [at for at, _ in pair.touchdowns(which)], INK)
    top.set_ylim(*limits)
    top.set_ylabel("height", "m")
    bottom.plot(time, series["volts"][pair.drive], color=color)
    bottom.set_ylabel("drive", "V")
    return charts


def _hits(panel: ChartPanel, times: Sequence[float], color: str) -> None:
    """Touchdowns, on the ground."""
    if times:
        panel.dots(times, np.zeros(len(times)), color=color, label="touchdowns")


def gaps(pair: DesignPair, span: float) -> Iterator[tuple[str, str, Floats, Floats]]:
    """Gaps of the foot before and after for a time [s] from the landing edge on: words with the hardest touchdown,
    colour, times [s] and gaps [m] (nt,) each."""
    for which, series in enumerate(pair.series):
        kept, time = pair.since_edge(which, span)
        hardest = max((speed for _, speed in pair.touchdowns(which, span)), default=0.0)
        label = f"{('before', 'after')[which]}, hardest at {amount(hardest, 'm/s', 3)}"
        yield label, (BEFORE, AFTER)[which], time, series["gap"][pair.foot][kept]


def landing_zoom(pair: DesignPair) -> Plate:
    """The landing itself, before and after on one axis, with every touchdown."""
    span = min(0.5 * pair.period, 3.0 * pair.design.request.step.longest)
    charts = Charts([1.6, 0.7], "time after the landing edge", window=(0.0, span))
    top, bottom = charts.panels
    for label, color, time, gap in gaps(pair, span):
        top.plot(time, gap, color=color, label=label)
    for which, series in enumerate(pair.series):
        kept, time = pair.since_edge(which, span)
        bottom.plot(time, series["volts"][pair.drive][kept], color=(BEFORE, AFTER)[which])
        _hits(top, [at for at, _ in pair.touchdowns(which, span)], (BEFORE, AFTER)[which])
    top.axhline(0.0, color=INK)
    top.set_ylabel("gap", "m")
    bottom.set_ylabel("drive", "V")
    return charts.plate("The landing: gap and volts before and after; dots are touchdowns.")


def on_grounds(design: LandingDesign) -> Plate:
    """Hardest touchdown on every ground, over each number that varies, before and after."""
    units = float_paths(design.request.scene)

    def over(path: str) -> Charts:
        values = design.grounds.values[path]
        charts = Charts([1.6], path, units[path].unit, with_room(float(values.min()), float(values.max())))
        (panel,) = charts.panels
        panel.dots(values, design.before_on_grounds.speed[0], color=BEFORE, label="before")
        panel.dots(values, design.on_grounds.speed[0], color=AFTER, label="after")
        if np.isfinite(design.worst):
            panel.axhline(design.worst, color=MUTED)
        panel.set_ylim(bottom=0.0)
        panel.set_ylabel("hardest touchdown", "m/s")
        return charts

    return side_by_side(
        (("", over(path)) for path in design.grounds.values),
        "Hardest touchdown of the period on the grounds that the design was judged on and on the worst that was found, "
        "over each number that varies; the line is the worst after.",
    )


def front(design: LandingDesign) -> Plate:
    """Speed against energy: what a softer landing costs."""
    known = np.isfinite([one.energy for one in design.front]).all()
    plain = np.array(
        [one.energy if known else period_rises(np.array([one.signal.levels]))[0] for one in design.front]
    )
    speeds, pairs = (
        np.array([one.speed for one in design.front]),
        np.array([one.pairs for one in design.front]),
    )
    across = ("energy a period", "J") if known else ("sum of squared rises", "V^2")
    charts = Charts([1.6], *across, with_room(float(plain.min()), float(plain.max())))
    (panel,) = charts.panels
    order = np.argsort(plain, kind="stable")
    panel.plot(np.repeat(plain[order], 2)[1:], np.repeat(speeds[order], 2)[:-1], color=MUTED, lw=0.8)
    for count in sorted(set(pairs.tolist())):
        color = (MUTED, GREEN, BLUE, VERMILION, ORANGE, INK, MUTED)[count]
        panel.dots(plain[pairs == count], speeds[pairs == count], color=color, label=_pairs(count))
    panel.set_ylim(bottom=0.0)
    panel.set_ylabel("hardest touchdown", "m/s")
    return charts.plate(
        "The front on the nominal ground: designs that no other beats in both touchdown speed and plain energy."
    )


def _pairs(count: int) -> str:
    return "no pair" if count == 0 else "1 pair" if count == 1 else f"{count} pairs"


def learning(design: LandingDesign) -> Plate:
    """Speed of every step of the learners: median and the middle 80 % of the hidden grounds."""
    found = design.learning
    assert found is not None
    low, middle, high = np.quantile(found.speeds, [0.1, 0.5, 0.9], axis=0)
    charts, steps = Charts([1.6], "steps", ""), np.arange(len(low))
    (panel,) = charts.panels
    panel.fill_between(steps, low, high, color=AFTER)
    panel.plot(steps, middle, color=AFTER, label="learner")
    panel.axhline(float(np.median(found.plain)), color=BEFORE, ls=(0, (5, 3)))
    panel.sign("plain step", BEFORE)
    panel.set_ylim(bottom=0.0)
    panel.set_ylabel("hardest touchdown", "m/s")
    return charts.plate(
        f"Learning on {len(found.grounds)} hidden grounds: median and middle 80 % of the touchdown speeds."
    )
