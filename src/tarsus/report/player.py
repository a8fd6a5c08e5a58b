"""The animation of a robot in a page: its drawing and its motion as compact text, which the page's player moves."""

from __future__ import annotations

import math
from typing import Any

from tarsus.report.drawing import Drawing, drawing_of
from tarsus.report.motion import CHANNELS, Held, Motion, frame_limit
from tarsus.report.packing import packed, script_text
from tarsus.report.pages import PageFigure, rendered
from tarsus.tables.numbers import amount

CHARACTERS = 290_000
"""Characters of series in a payload at most."""


def walk_figure(motion: Motion) -> PageFigure:
    """The animation as a figure of a page, which brings the player: no file, no network, no library.

    It holds at most 2000 frames, fewer where there are many legs, so that it stays below 400 kB. In print it is the
    moment that is shown.
    """
    thin = motion.thinned(frame_limit(len(motion.legs), CHARACTERS))
    drawing = drawing_of(thin)
    data = script_text(payload(thin, drawing))
    return PageFigure(rendered("player.html", walks=motion.held is Held.LEGS, data=data), _caption(thin, drawing))


def payload(motion: Motion, drawing: Drawing) -> dict[str, Any]:
    """A motion and its drawing as plain data for the player: names, numbers [SI], and series packed by `packed`, None
    where they are zero at all times."""
    series = {"swing": motion.foot_x - motion.hips[:, :1], "foot_z": motion.foot_z}
    forces = {"normal": motion.normal, "friction": motion.friction}
    return {
        "legs": list(motion.legs),
        "drawing": drawing.to_dict(),
        "channels": CHANNELS,
        "period": motion.period,
        "incline": motion.incline,
        "ground": [[[float(f"{value:.9g}") for value in point] for point in line] for line in motion.ground],
        "moved": None if motion.moved is None else packed(motion.moved, 16),
        "frames": len(motion.time),
        "time": packed(motion.time[None, :], 16),
        "body": {name: packed(values[None, :], 16) for name, values in motion.body.items()},
        **{name: packed(values, 16) if values.any() else None for name, values in series.items()},
        **{name: packed(values, 8) if values.any() else None for name, values in forces.items()},
        "state": packed(motion.state, 8),
    }


_HANGING = {
    Held.BEAM: "The beam over the ground of its feet; places along it are to scale.",
    Held.SPRINGS: "The feet, each on the springs of its structure, which is drawn as one; places are not to scale.",
    Held.FREE: "What moves, over the ground; places are not to scale.",
}


def _caption(motion: Motion, drawing: Drawing) -> str:
    first, last = (amount(float(time), "s") for time in (motion.time[0], motion.time[-1]))
    if motion.held is not Held.LEGS:
        return (
            f"{_HANGING[motion.held]} Motion from {first} to {last} is drawn larger by the factor chosen. Arrows are "
            "forces of the ground on the feet."
        )
    places = "places of the hips are to scale"
    if not drawing.true:
        places = "legs that the model has at one place are drawn side by side"
    caption = (
        f"The walk from {first} to {last}, seen from the robot's right, its left side paler and set back. Motion is "
        f"drawn larger by the factors chosen; {places}; length of legs and thickness of body are not the model's. "
        "Ticks on the ground are travel of the body's centre, which the small triangle shows. "
        "Arrows are forces of the ground on the feet. Figures over time mark the moment, and a click there moves to it."
    )
    if motion.moved is not None:
        caption += " The ground moves, and all of it is seen from the laboratory."
    if motion.incline:
        rises = f"The ground rises forward by {math.degrees(motion.incline):.3g} deg"
        caption += f" {rises}: an arrow shows where gravity pulls."
    return caption
