"""Figures of a landing design: before and after as Fig. 5.1 draws it, the landing itself, grounds, front, learning."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from tarsus.base.events import IMPACTS
from tarsus.design.soft_landing import LandingDesign
from tarsus.report.figures import Plate, shade
from tarsus.report.series import Series, last_turns
from tarsus.report.style import (
    BLUE,
    GREEN,
    INK,
    MUTED,
    ORANGE,
    RULE,
    VERMILION,
    WIDTH_IN,
    few_ticks,
    scale_of,
    to_svg,
)
from tarsus.solve import Run, simulate

__all__ = ["Pair", "front", "landing_zoom", "learning", "on_grounds", "picture"]

SAMPLES = 1600
"""Samples of a drawn period: a plateau of 1 % of a period is then sixteen of them."""
SHOWN = 2
"""Periods drawn: the second shows that the first repeats."""
BEFORE, AFTER = VERMILION, BLUE


class Pair:
    """Runs of the plain step and of the design, in their periodic regime, with what is drawn of them."""

    def __init__(self, design: LandingDesign) -> None:
        self.design = design
        step, request = design.request.step, design.request
        self.period = step.period
        self.foot = list(request.scene.robot.feet).index(request.foot)
        self.drive = list(request.scene.robot.drives).index(request.drive)
        periods = design.settle + SHOWN
        from tarsus.base.spec import with_values

        plain = with_values(design.scene, {f"signals.{request.drive}": design.plain_signal})
        self.runs: tuple[Run, Run] = tuple(
            simulate(scene, periods * step.period) for scene in (plain, design.scene)
        )  # pyright: ignore[reportAttributeAccessIssue]
        self.series: tuple[Series, Series] = tuple(last_turns(run, SHOWN, SAMPLES) for run in self.runs)  # pyright: ignore[reportAttributeAccessIssue]

    def touchdowns(self, which: int) -> list[tuple[float, float]]:
        """Time [s] and speed [m/s] of the foot's touchdowns in the drawn time."""
        events = self.runs[which].events
        since = float(self.series[which].time[0])
        hits = np.isin(events["kind"], IMPACTS) & (events["foot"] == self.foot) & (events["time"] >= since)
        return [(float(e["time"]), abs(float(e["speed_before"]))) for e in events[hits]]


def picture(pair: Pair) -> Plate:
    """Fig. 5.1 before and after: heights above, volts below."""
    drawn = Figure(figsize=(WIDTH_IN, 3.3))
    panels = drawn.subplots(2, 2, sharex="col", sharey="row", squeeze=False, height_ratios=[2.3, 1.0])
    drawn.subplots_adjust(left=0.085, right=0.99, bottom=0.13, top=0.92, wspace=0.05, hspace=0.1)
    clock = scale_of("s", pair.period)
    high = scale_of("m", max(float(series["gap"][pair.foot].max()) for series in pair.series))
    for column, (series, title) in enumerate(
        zip(pair.series, ("before: plain step", "after: designed"), strict=True)
    ):
        top, bottom = panels[0][column], panels[1][column]
        begin = float(series.time[0])
        time = (series.time - begin) / clock.step
        window = (0.0, float(series.time[-1]) - begin)
        contacts = [(a - begin, b - begin) for a, b in series.contacts[pair.foot]]
        shade(top, contacts, window, clock)
        shade(bottom, contacts, window, clock)
        point = series.foot_points[pair.foot]
        for name, row in zip(series.points, series["displacement"], strict=True):
            if name != point:
                top.plot(
                    time, (row - series.ground_levels[pair.foot]) / high.step, color=MUTED, lw=0.8, label=name
                )
        top.plot(
            time,
            series["gap"][pair.foot] / high.step,
            color=(BEFORE, AFTER)[column],
            label=series.feet[pair.foot],
        )
        top.axhline(0.0, color=INK, lw=0.6)
        bottom.plot(time, series["volts"][pair.drive], color=(BEFORE, AFTER)[column], drawstyle="steps-post")
        _mark(top, pair.touchdowns(column), begin, clock.step)
        top.set_title(title, loc="left")
        bottom.set_xlabel(f"time ({clock.label})")
        top.legend(loc="upper right")
    panels[0][0].set_ylabel(f"a. height ({high.label})")
    panels[1][0].set_ylabel("b. volts (V)")
    caption = (
        "Height of the foot above the ground and of the other points as far above it, and volts, over two periods of "
        "the periodic regime, before and after, as in Fig. 5.1 of the source. Shaded: contact. Triangles: touchdowns."
    )
    return Plate(to_svg(drawn, caption), caption)


def _mark(axes: Axes, hits: Sequence[tuple[float, float]], begin: float, step: float) -> None:
    axes.plot([(t - begin) / step for t, _ in hits], np.zeros(len(hits)), "^", ms=3.5, mew=0.0, color=INK)


def landing_zoom(pair: Pair) -> Plate:
    """The landing itself, before and after on one axis, with the speed of every touchdown."""
    step = pair.design.request.step
    span = min(0.5 * pair.period, 3.0 * step.longest)
    drawn = Figure(figsize=(WIDTH_IN, 2.9))
    top, bottom = drawn.subplots(2, 1, sharex=True, height_ratios=[2.2, 1.0])
    drawn.subplots_adjust(left=0.085, right=0.99, bottom=0.15, top=0.97, hspace=0.1)
    clock = scale_of("s", span)
    last = [(series.time >= series.time[0] + pair.period) & (series.time <= series.time[0] + pair.period + span)
            for series in pair.series]  # fmt: skip
    high = scale_of(
        "m", max(float(s["gap"][pair.foot][k].max()) for s, k in zip(pair.series, last, strict=True))
    )
    for which, (series, kept) in enumerate(zip(pair.series, last, strict=True)):
        edge = float(series.time[0]) + pair.period
        time = (series.time[kept] - edge) / clock.step
        color, label = ((BEFORE, "before"), (AFTER, "after"))[which]
        top.plot(time, series["gap"][pair.foot][kept] / high.step, color=color, label=label)
        bottom.plot(time, series["volts"][pair.drive][kept], color=color, drawstyle="steps-post")
        hits = [(t - edge, v) for t, v in pair.touchdowns(which) if edge <= t <= edge + span]
        top.plot([t / clock.step for t, _ in hits], np.zeros(len(hits)), "^", ms=4.5, mew=0.0, color=color)
        for t, v in sorted(hits, key=lambda hit: -hit[1])[:1]:
            top.annotate(
                f"{v:.3g} m/s",
                (t / clock.step, 0.0),
                (4, 34 - 20 * which),
                textcoords="offset points",
                color=color,
                bbox={"facecolor": "#ffffff", "edgecolor": "none", "pad": 1.0},
            )
    top.axhline(0.0, color=INK, lw=0.6)
    top.set_ylabel(f"gap ({high.label})")
    bottom.set_ylabel("volts (V)")
    bottom.set_xlabel(f"time after the landing edge ({clock.label})")
    top.legend(loc="upper right")
    caption = (
        "The landing: gap and volts before and after, touchdowns as triangles, the hardest with its speed."
    )
    return Plate(to_svg(drawn, caption), caption)


def on_grounds(design: LandingDesign) -> Plate:
    """Hardest touchdown on every ground, over each number that varies, before and after."""
    paths = list(design.grounds.values)
    drawn = Figure(figsize=(WIDTH_IN, 2.5))
    panels = drawn.subplots(1, len(paths), sharey=True, squeeze=False)[0]
    drawn.subplots_adjust(left=0.085, right=0.99, bottom=0.19, top=0.9, wspace=0.06)
    from tarsus.base.spec import float_paths

    units = float_paths(design.request.scene)
    for axes, path in zip(panels, paths, strict=True):
        scale = (
            scale_of(units[path].unit, *design.grounds.values[path])
            if units[path].unit != "1"
            else scale_of("", 0.0)
        )
        x = design.grounds.values[path] / scale.step
        axes.plot(x, design.before_on_grounds.speed[0], "o", ms=3.0, mew=0.0, color=BEFORE, label="before")
        axes.plot(x, design.on_grounds.speed[0], "o", ms=3.0, mew=0.0, color=AFTER, label="after")
        unit = f" ({scale.label})" if scale.label else ""
        axes.set_xlabel(f"{path}{unit}")
        few_ticks(axes, x=5)
        if np.isfinite(design.worst):
            axes.axhline(design.worst, color=RULE, lw=0.8)
        axes.set_ylim(bottom=0.0)
    panels[0].set_ylabel("hardest touchdown (m/s)")
    handles, labels = panels[0].get_legend_handles_labels()
    drawn.legend(handles, labels, loc="upper center", ncols=2)
    caption = (
        "Hardest touchdown of the period on the grounds that the design was judged on and on the worst that was found, "
        "over each number that varies; the line is the worst after."
    )
    return Plate(to_svg(drawn, caption), caption)


def front(design: LandingDesign) -> Plate:
    """Speed against energy: what a softer landing costs."""
    drawn = Figure(figsize=(0.55 * WIDTH_IN, 2.5))
    axes = drawn.subplots()
    drawn.subplots_adjust(left=0.16, right=0.97, bottom=0.19, top=0.9)
    known = np.isfinite([one.energy for one in design.front]).all()
    from tarsus.design.energy import period_rises

    plain = np.array(
        [one.energy if known else period_rises(np.array([one.signal.levels]))[0] for one in design.front]
    )
    speeds = np.array([one.speed for one in design.front])
    scale = scale_of("J" if known else "V^2", *plain)
    axes.step(plain / scale.step, speeds, where="post", color=RULE, lw=0.8)
    for pairs in sorted({one.pairs for one in design.front}):
        own = np.array([one.pairs == pairs for one in design.front])
        color = (MUTED, GREEN, BLUE, VERMILION, ORANGE, INK, MUTED)[pairs]
        axes.plot(
            plain[own] / scale.step, speeds[own], "o", ms=4.0, mew=0.0, color=color, label=_pairs(pairs)
        )
    axes.set_ylim(bottom=0.0)
    axes.set_xlabel(f"energy a period ({scale.label})" if known else f"sum of squared rises ({scale.label})")
    axes.set_ylabel("hardest touchdown (m/s)")
    axes.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=4, borderaxespad=0.2)
    caption = "The front on the nominal ground: designs that no other beats in both touchdown speed and plain energy."
    return Plate(to_svg(drawn, caption), caption, wide=False)


def _pairs(count: int) -> str:
    return "no pair" if count == 0 else "1 pair" if count == 1 else f"{count} pairs"


def learning(design: LandingDesign) -> Plate:
    """Speed of every step of the learners: median and the middle 80 % of the hidden grounds."""
    found = design.learning
    assert found is not None
    drawn = Figure(figsize=(0.55 * WIDTH_IN, 2.5))
    axes = drawn.subplots()
    drawn.subplots_adjust(left=0.16, right=0.97, bottom=0.19, top=0.96)
    steps = np.arange(found.speeds.shape[1])
    low, middle, high = np.quantile(found.speeds, [0.1, 0.5, 0.9], axis=0)
    axes.fill_between(steps, low, high, color=RULE, lw=0.0)
    axes.plot(steps, middle, color=AFTER, label="learner")
    axes.axhline(float(np.median(found.plain)), color=BEFORE, lw=0.8, label="plain step")
    axes.set_ylim(bottom=0.0)
    axes.set_xlabel("steps")
    axes.set_ylabel("hardest touchdown (m/s)")
    axes.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=4, borderaxespad=0.2)
    caption = (
        f"Learning on {len(found.grounds)} hidden grounds: median and middle 80 % of the touchdown speeds."
    )
    return Plate(to_svg(drawn, caption), caption, wide=False)
