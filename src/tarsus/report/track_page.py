"""The report of a series of campaigns on one device: what moved, and every number over the series."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from tarsus.identify.result import Identification
from tarsus.report.identify_page import identify_html
from tarsus.report.pages import Markup, PageFigure, Section, said, sections_page, whole
from tarsus.report.panel_grid import QUARTER, few_ticks, intervals, name_axes, panels
from tarsus.report.style import BLUE, VERMILION

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from tarsus.identify.track import Drift, Tracking

NINETY_FIVE = 1.96
"""Standard errors in half of a bar: a 95 % interval."""


def identified_html(found: Identification | Tracking) -> str:
    """The page of a campaign, or of a series of them."""
    return identify_html(found) if isinstance(found, Identification) else track_html(found)


def track_html(series: Tracking) -> str:
    """The page of a series, as text."""
    table = series.table()
    about = [table.title, *(said(one, failed=True) for one in series.alarms), whole(table.bare()), ALARMS]
    title = f"Series: {series.names[0]} to {series.names[-1]}"
    sections = [Section("Over the series", _numbers(series))]
    return sections_page(title, about, sections)


ALARMS = Markup(
    "<p>A number is called moved where it differs by more than its intervals allow; a device that does not change "
    "gives one such alarm in a hundred series.</p>"
)


def _numbers(series: Tracking) -> PageFigure:
    """Every number with its interval over the series; those that moved first."""
    order = sorted(series.drifts, key=lambda one: one.since is None)

    def draw(axes: Axes, one: Drift) -> None:
        at = np.arange(len(one.values))
        moved = at >= (len(at) if one.since is None else one.since)
        half = NINETY_FIVE * np.asarray(one.errors)
        for part, color in ((~moved, BLUE), (moved, VERMILION)):
            values, about = np.asarray(one.values)[part], half[part]
            intervals(axes, at[part] + 1, values, values - about, values + about, color=color)
        axes.set_title(one.path.removeprefix("ground.").removeprefix("robot."))
        name_axes(axes, ("campaign", ""), ("", one.unit))
        few_ticks(axes, y=4)
        axes.set_xticks(at + 1)

    caption = "Estimates with 95 % intervals in the order of the campaigns; red from where a number has moved."
    return panels(order, 0.95, draw, caption, width=QUARTER)
