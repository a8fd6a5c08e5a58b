"""The report of a series of campaigns on one device: what moved, and every number over the series."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from tarsus.report.charts import Charts, side_by_side
from tarsus.report.pages import Plate, page, rendered
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

    return side_by_side(
        ((one.path.removeprefix("ground.").removeprefix("robot."), _drawn(one)) for one in order),
        "Estimates with 95 % intervals in the order of the campaigns; red from where a number has moved.",
        small=True,
    )  # fmt: skip


def _drawn(one: Drift) -> Charts:
    """One number."""
    count = len(one.values)
    charts = Charts([0.95], "campaign", "", rows=[str(number) for number in range(1, count + 1)])
    (panel,) = charts.panels
    moved = np.arange(count) >= (count if one.since is None else one.since)
    for part, color, label in ((~moved, BLUE, "steady"), (moved, VERMILION, "moved")):
        at = np.flatnonzero(part)
        values, half = np.asarray(one.values)[at], NINETY_FIVE * np.asarray(one.errors)[at]
        panel.dots(at, values, color=color, label=label, low=values - half, high=values + half)
    panel.set_ylabel("", one.unit)
    return charts
