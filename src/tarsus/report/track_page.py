"""The report of a series of campaigns on one device: what moved, and every number over the series."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator

from tarsus.report.pages import Plate, page, rendered, write_page
from tarsus.report.sheet import QUARTER, Sheet, few_ticks, plate
from tarsus.report.style import BLUE, VERMILION, scale_of

if TYPE_CHECKING:
    from tarsus.identify.track import Drift, Tracking

NINETY_FIVE = 1.96
"""Standard errors in half of a bar: a 95 % interval."""


def write_track_report(series: Tracking, path: str | Path) -> Path:
    """Write a series as one self-contained HTML file; returns its path. Raises InputError if it cannot be written."""
    body = rendered("track.html", series=series, estimates=_numbers(series), table=series.table().bare())
    return write_page(page(f"{series.names[0]} – series", body), path)


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
    scale = scale_of(one.unit, one.values[np.isfinite(one.values)])
    moved = np.arange(len(one.values)) >= (len(one.values) if one.since is None else one.since)
    for part, color in ((~moved, BLUE), (moved, VERMILION)):
        at = np.flatnonzero(part)
        axes.errorbar(
            at + 1, one.values[at] / scale.step, NINETY_FIVE * one.errors[at] / scale.step, fmt="o", ms=3.0, lw=0.9,
            color=color,
        )  # fmt: skip
    axes.set(xlabel="campaign", ylabel=scale.axis(""))
    axes.set_title(one.path.removeprefix("ground.").removeprefix("robot."))
    few_ticks(axes, y=4)
    axes.xaxis.set_major_locator(MaxNLocator(4, integer=True))
