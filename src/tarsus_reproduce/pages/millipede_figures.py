"""Figures of the millipede's reproduction: what the source plots over ground and payload, and two walks in time."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes

from tarsus.base.spec import with_values
from tarsus.model.scene import Scene
from tarsus.report.pages import PageFigure
from tarsus.report.panel_grid import PanelGrid, few_ticks, line, name_axes, page_figure
from tarsus.report.style import BLUE, CYCLE, GREEN, RULE, VERMILION
from tarsus.solve import simulate
from tarsus_reproduce.millipede import DeviceTrends, Score, Swept

PANELS = (
    (("max_heave",), "largest heave"),
    (("max_peak",), "highest foot"),
    (("max_surge",), "farthest surge"),
    (("stride",), "travel a period, settled"),
    (("total_rebounds_any_height", "total_bounces"), "rebounds and (dotted) bounces in the run"),
    (("longest_contact",), "longest contact"),
)
"""Measures of each panel and what stands above it."""


def swept_figure(swept: Sequence[tuple[str, Swept]], title: str, symbol: str) -> PageFigure:
    """One study on several variants, by their names: lines are means over restitutions, bands their range.

    Parameters
    ----------
    swept
        Name of each variant and what it gave.
    title
        What varies, in words.
    symbol
        What varies, as a symbol.
    """
    first = swept[0][1]

    def draw(page: PanelGrid) -> None:
        panels = page.grid(len(PANELS), 0.7)
        for axes, (names, label) in zip(panels, PANELS, strict=True):
            for k, (variant, one) in enumerate(swept):
                for name, style in zip(names, ("-", ":"), strict=False):
                    _line(axes, one.x, one.measures[name].curve.y, CYCLE[k], style, variant)
            few_ticks(axes, y=4)
            if first.x[-1] > 100.0 * first.x[0]:
                axes.set_xscale("log")
                axes.minorticks_off()
            name_axes(axes, (symbol, first.unit), (label, first.measures[names[0]].unit))
            axes.set_title(axes.get_ylabel())
            axes.set_ylabel("")
            axes.set_xlim(first.x[0], first.x[-1])
        page.legend(panels[0])

    low, high = first.replicates[[0, -1]]
    return page_figure(draw, f"{title}: means and ranges over restitutions of {low:g} to {high:g}.")


def walks_figure(scene: Scene, grounds: Mapping[str, Mapping[str, float]], title: str) -> PageFigure:
    """Walks in time (as Fig. 4.7): heights of body and feet on each ground, and the ways of the body on both."""
    runs = {name: simulate(with_values(scene, dict(ground))) for name, ground in grounds.items()}

    def draw(page: PanelGrid) -> None:
        panels = page.grid(len(runs) + 1, 1.0)
        *heights, along = panels
        for axes, (name, run), look in zip(heights, runs.items(), ("-", "--"), strict=True):
            one = run.variables()
            time, (way, up) = one["time"].values, one["body"].values[:2]
            for foot, values, color in zip(run.foot_names, one["gap"].values, (VERMILION, GREEN), strict=False):
                line(axes, time, values, color=color, lw=0.9, label=f"foot {foot}")
            line(axes, time, up, color=BLUE, lw=0.9, label="body")
            name_axes(axes, ("time", "s"), (f"({name}): height", "m"))
            line(along, time, way, color=BLUE, lw=0.9, ls=look, label=f"({name})")
        name_axes(along, ("time", "s"), ("way of the body", "m"))
        for axes in panels:
            page.legend(axes)

    return page_figure(
        draw, f"{title}: body and feet up, and the body along the way, on the two grounds of Fig. 4.7, from the start."
    )


def _line(axes: Axes, x: np.ndarray, values: np.ndarray, color: str, style: str, label: str) -> None:
    known = np.isfinite(values).any(axis=1)
    x, values = x[known], values[known]
    axes.fill_between(x, np.nanmin(values, axis=1), np.nanmax(values, axis=1), color=color, alpha=0.18, lw=0.0)
    axes.plot(x, np.nanmean(values, axis=1), style, color=color, lw=1.1, label=label if style == "-" else None)


def interpretations_figure(drawn: Sequence[Score], devices: Sequence[DeviceTrends]) -> PageFigure:
    """Histograms of how many trends agree and contradict over interpretations, with the named devices as points."""
    shown = (
        ("agree", "trends that agree"),
        ("contradict", "that contradict"),
        ("directional_agree", "directional, agree"),
    )

    def draw(page: PanelGrid) -> None:
        panels = page.grid(len(shown), 1.4)
        for axes, (name, label) in zip(panels, shown, strict=True):
            counts = np.array([score[name] for score in drawn])
            most = max([counts.max(), *(one.score[name] for one in devices)])
            axes.hist(counts, bins=(np.arange(most + 2) - 0.5).tolist(), color=RULE, edgecolor="white", lw=0.6)
            for k, device in enumerate(devices):
                axes.plot(
                    device.score[name],
                    0.04 * (k + 1),
                    "v",
                    color=CYCLE[k],
                    ms=6.0,
                    label=device.name,
                    transform=axes.get_xaxis_transform(),
                    clip_on=False,
                )
            axes.set_xlabel(label)
            axes.set_ylabel("interpretations")
            few_ticks(axes, x=6, y=4)
        page.legend(panels[0])

    return page_figure(
        draw,
        f"How many of the 16 trends agree and contradict, and how many of the directional ones agree, over "
        f"{len(drawn)} random interpretations of what is not printed; marks are the named devices.",
    )
