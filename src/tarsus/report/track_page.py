"""The report of a series of campaigns on one device: what moved, and every number over the series."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator

from tarsus.report.pages import Plate, page, rendered
from tarsus.report.sheet import QUARTER, Sheet, few_ticks, name_axes, plate
from tarsus.report.style import BLUE, VERMILION

if TYPE_CHECKING:
    from tarsus.identify.track import Drift, Tracking

NINETY_FIVE = 1.96
"""Standard errors in half of a bar: a 95 % interval."""


def track_html(series: Tracking) -> str:
    """The page of a series, as text."""
    body = rendered("track.html", series=series, estimates=_numbers(series), table=series.table())
    return page(f"{series.names[0]} – series", body)


def _numbers(series: Tracking) -> Plate:
    """Every number with its interval over the series; those that moved first."""
    order = sorted(series.drifts, key=lambda one: one.since is None)

    def draw(sheet: Sheet) -> None:
        for axes, one in zip(sheet.grid(len(order), 1.7, width=QUARTER), order, strict=True):
            _draw(axes, one)

    return plate(
        draw,
        "Estimates with 95 % intervals in the order of the campaigns; red from where a number has moved.",
    )


def _draw(axes: Axes, one: Drift) -> None:
    """One number."""
    moved = np.arange(len(one.values)) >= (len(one.values) if one.since is None else one.since)
    for part, color in ((~moved, BLUE), (moved, VERMILION)):
        at = np.flatnonzero(part)
        bars = NINETY_FIVE * one.errors[at]
        axes.errorbar(at + 1, one.values[at], bars, fmt="o", ms=3.0, lw=0.9, color=color)
    name_axes(axes, ("campaign", ""), ("", one.unit))
    axes.set_title(one.path.removeprefix("ground.").removeprefix("robot."))
    few_ticks(axes, y=4)
    axes.xaxis.set_major_locator(MaxNLocator(4, integer=True))
