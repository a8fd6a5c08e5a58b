"""The figure of a robot that turns, seen from above: its path in the world, to scale, and its body on the way."""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np

from tarsus.base.arrays import Floats
from tarsus.measure.path import path_of
from tarsus.records.excluded import evenly
from tarsus.report.motion import Motion
from tarsus.report.pages import Plate, rendered
from tarsus.report.stage import round_below
from tarsus.tables.numbers import amount

MOMENTS = 7
"""Moments at which the body is drawn."""

POINTS = 1000
"""Of the path, about one for every pixel of the page's width."""


def path_above(motion: Motion) -> Plate:
    """Path of the centre of a body that has a yaw, forward to the right and its left upward, with the rectangle about
    its hips and its heading at moments evenly apart."""
    yaw = motion.coordinate("yaw")
    place = path_of(motion.coordinate("surge"), motion.coordinate("sway"), yaw)
    half = np.maximum(np.abs(motion.hips[:, :2]).max(axis=0), 1e-3 * np.abs(motion.hips).max())
    frames = evenly(range(len(motion.time)), MOMENTS)
    bodies = [_outline(place[:, i], float(yaw[i]), half) for i in frames]
    noses = [np.stack([place[:, i], body[:2].mean(axis=0)]) for i, body in zip(frames, bodies, strict=True)]
    every = np.concatenate([place.T, *bodies])
    low, high = every.min(axis=0), every.max(axis=0)
    room = 0.05 * float((high - low).max())
    bar = round_below(0.25 * float(high[0] - low[0]))
    at = np.array([low[0], low[1] - 2.0 * room])
    unit = 1000.0 / float(high[0] - low[0] + 2.0 * room)
    points = np.array(evenly(list(place.T), POINTS))

    def drawn(line: Floats) -> str:
        return " ".join(f"{unit * x:.2f},{-unit * y:.2f}" for x, y in line)

    def strokes(lines: Iterable[Floats]) -> str:
        return " ".join(f"M{drawn(line)}" for line in lines)

    box = (unit * (low[0] - room), -unit * (high[1] + room), 1000.0, unit * (high[1] - low[1] + 4.5 * room))
    picture = rendered(
        "above.html", box=[f"{value:.2f}" for value in box], bodies=[drawn(body) for body in bodies],
        headings=strokes(noses), path=strokes([points]), bar=strokes([at + np.array([[0.0, 0.0], [bar, 0.0]])]),
        bar_text=[f"{unit * (at[0] + bar) + 8.0:.2f}", f"{-unit * at[1] + 6.0:.2f}"], letter=20,
        length=amount(bar, "m"),
    )  # fmt: skip
    turned = math.degrees(float(yaw[-1] - yaw[0]))
    side = "left" if turned >= 0.0 else "right"
    return Plate(
        picture,
        f"Path of the body's centre seen from above, to scale; the rectangle about its hips at {MOMENTS} moments, its "
        "heading as a line. It began by looking to the right of the page, and turned "
        f"{abs(turned):.3g} deg to the {side}.",
    )


def _outline(centre: Floats, yaw: float, half: Floats) -> Floats:
    """Corners (4, 2) [m] of a rectangle about a centre, the two in front first."""
    corners = np.array([[1.0, -1.0], [1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0]]) * half
    c, s = math.cos(yaw), math.sin(yaw)
    return centre + corners @ np.array([[c, s], [-s, c]])
