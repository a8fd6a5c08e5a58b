"""The animation of a robot in a page: its drawing and its motion as compact text, which the page's player moves."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from markupsafe import Markup

from tarsus.report.drawing import Drawing, drawing_of
from tarsus.report.motion import CHANNELS, Held, Motion, frame_limit
from tarsus.report.packing import packed, packed_states, script_text
from tarsus.report.pages import rendered
from tarsus.report.series import joined
from tarsus.report.stills import rising, still
from tarsus.tables.numbers import amount

CHARACTERS = 290_000
"""Characters of series in a payload at most."""

MOST_DRIVES = 6
"""Different drive voltages drawn at most."""

NAMED = 4
"""Drives of one voltage that a caption names; of more, the first and how many."""

SAME = 1e-6
"""Drive voltages that differ by less than this part of the largest are one."""


def walk_section(motion: Motion, index: int | None = None, *, on_paper: bool = True) -> Markup:
    """The animation as a part of a page, which brings the player: no file, no network, no library.

    `index` numbers it among a page's figures; on_paper: with the still. It holds at most 2000 frames, fewer where there
    are many legs, so that it stays below 400 kB. Where no script runs, and in print, it is a still of four moments.
    """
    drives = distinct_drives(motion) if motion.held is Held.LEGS else []  # others have no tracks of volts
    thin = motion.thinned(frame_limit(len(motion.legs), len(drives), CHARACTERS))
    drawing = drawing_of(thin)
    return rendered(
        "player.html",
        still=still(thin, drawing) if on_paper else None,
        index=index,
        walks=motion.held is Held.LEGS,
        caption=_caption(thin, drawing, drives),
        data=script_text(payload(thin, drawing, drives)),
    )


def payload(motion: Motion, drawing: Drawing, drives: Sequence[tuple[Sequence[str], int]] = ()) -> dict[str, Any]:
    """A motion and its drawing as plain data for the player: names, numbers [SI], and series packed by `packed`, None
    where they are zero at all times.

    `drives` are (names, row of volts) of the voltages to draw.
    """
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
        "state": packed_states(motion.state),
        "drives": [drive_label(names) for names, _ in drives],
        "volts": packed(motion.volts[[row for _, row in drives]], 8) if drives else None,
    }


def distinct_drives(motion: Motion) -> list[tuple[tuple[str, ...], int]]:
    """The different drive voltages: (names of the drives that have it, row)."""
    alike: dict[int, list[str]] = {}
    for row, name in enumerate(motion.drives):
        volts = motion.volts[row]
        near = SAME * max(float(np.abs(volts).max()), 1e-12)
        first = next((r for r in alike if float(np.abs(motion.volts[r] - volts).max()) <= near), row)
        alike.setdefault(first, []).append(name)
    return [(tuple(names), row) for row, names in list(alike.items())[:MOST_DRIVES]]


def drive_label(names: Sequence[str]) -> str:
    """Drives of one voltage, as short as beside a curve."""
    return names[0] if len(names) == 1 else f"{names[0]} +{len(names) - 1}"


def _shared(drives: Sequence[tuple[Sequence[str], int]]) -> str:
    """What the labels of drives that have one voltage stand for."""
    several = [names for names, _ in drives if len(names) > 1]
    if not several:
        return ""
    told = []
    for names in several:
        every = joined(list(names)) if len(names) <= NAMED else f"{names[0]} and {len(names) - 1} others"
        told.append(f"{drive_label(names)}: {every}")
    return f" Drives of one voltage are one curve ({'; '.join(told)})."


_HANGING = {
    Held.BEAM: "The beam over the ground of its feet; places along it are to scale.",
    Held.SPRINGS: "The feet, each on the springs of its structure, which is drawn as one; places are not to scale.",
    Held.FREE: "What moves, over the ground; places are not to scale.",
}


def _caption(motion: Motion, drawing: Drawing, drives: Sequence[tuple[Sequence[str], int]]) -> str:
    first, last = (amount(float(time), "s") for time in (motion.time[0], motion.time[-1]))
    if motion.held is not Held.LEGS:
        return (
            f"{_HANGING[motion.held]} Motion from {first} to {last} is drawn larger by the factor chosen. Arrows are "
            "forces of the ground on the feet."
        )
    places = "places of the hips are to scale"
    if not drawing.true:
        places = "legs that the model has at one place are drawn side by side"
    return (
        f"The walk from {first} to {last}, seen from the robot's right, its left side paler and set back. Motion is "
        f"drawn larger by the factors chosen; {places}; length of legs and thickness of body are not the model's. "
        "Ticks on the ground are travel of the body's centre, which the small triangle shows. "
        "Arrows are forces of the ground on the feet."
        + ("" if motion.moved is None else " The ground moves, and all of it is seen from the laboratory.")
        + _shared(drives)
        + rising(motion)
    )
