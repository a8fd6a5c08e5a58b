"""The animation of a robot whose points move up and down: a beam, or bobs on springs, over the ground of its feet."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from markupsafe import Markup

from tarsus.model.structure import Beam
from tarsus.report.packing import packed, packed_times, script_text
from tarsus.report.pages import rendered
from tarsus.report.panels import Window
from tarsus.report.series import RunSeries
from tarsus.report.style import scale_of

if TYPE_CHECKING:
    from tarsus.solve import Run

FRAMES = 1200
"""Moments that are kept: two periods at twenty a second and half a minute each."""

MOST_POINTS = 12
"""Points drawn: more do not stand beside each other on a narrow screen."""


def points_section(run: Run, series: RunSeries, window: Window, index: int) -> Markup:
    """The moving points of a run within a window, as an HTML fragment that needs nothing else.

    It stands still until it is asked to play. A beam's line goes through its clamp, level there, and its two points.
    """
    structure = run.scene.robot.structure
    names = list(series.points)[:MOST_POINTS]
    beam = isinstance(structure, Beam)
    if isinstance(structure, Beam):
        places = {"center": 0.5 * structure.length, "tip": structure.length + 0.5 * structure.tip_length}
        across = [places[name] / places["tip"] for name in names]
    else:
        across = [(i + 1.0) / (len(names) + 1.0) for i in range(len(names))]
    time = series.time[series.inside(window)]
    moments = np.linspace(window[0], window[1], min(FRAMES, len(time)))
    shift = [
        np.interp(moments, series.time, series["displacement"][series.points.index(name)]) for name in names
    ]
    feet = [
        {"point": names.index(point), "level": level, "held": held}
        for point, level, held in zip(series.foot_points, series.ground_levels, series.contacts, strict=True)
        if point in names
    ]
    for foot in feet:
        foot["held"] = [span for span in foot["held"] if span[1] > window[0] and span[0] < window[1]]
    clock, scale = scale_of("s", window[1] - window[0]), scale_of("m", *shift)
    data = {
        "beam": beam, "names": names, "across": across, "feet": feet, "time": packed_times(moments), "step": clock.step,
        "clock": clock.label, "scale": scale.step, "unit": scale.label, "y": [packed(row, 16) for row in shift],
    }  # fmt: skip
    caption = (
        ("The beam" if beam else "The points")
        + f" over the last {(window[1] - window[0]) / clock.step:.4g} {clock.label} "
        "shown, drawn much larger upward; dark is the ground below each foot, where it touches."
    )
    return rendered("points.html", data=script_text(data), index=index, caption=caption)
