"""A walk as a moving picture (GIF): the robot from its right, the ground passing below it, motion enlarged."""

from __future__ import annotations

import math
import os
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from tarsus.base.errors import InputError
from tarsus.base.units import format_quantity
from tarsus.files.library import SceneLike, load_scene
from tarsus.files.store import RunLike, read_run, written_whole
from tarsus.model.laws.userfile import laws_of
from tarsus.model.scene import Scene
from tarsus.model.structure import Walker
from tarsus.report.motion import AIR, SLIPPING, Motion, motion_of
from tarsus.report.stage import BACK, LIFT, Stage, drawn, stage_of
from tarsus.report.style import BLUE, INK, MUTED, RULE, VERMILION
from tarsus.solve.simulate import simulate

__all__ = ["movie", "write_movie"]

FRAMES = 48
"""Frames of a drive period, or of a run without one."""

PERIODS = 2
"""Drive periods shown: from one to the next the ground has passed on."""

BELOW = 0.12
"""Room below the ground for its marks, of a leg's length."""

CAPTION = 20
"""Height of the line of words above the picture [pixels]."""

PACE_MS = 50
"""Time a frame is shown [ms]: 20 a second is fluent, and most viewers go no faster."""

FINE = 2
"""Frames are drawn so many times larger and reduced, which smooths their edges."""

COLOURS = 32
"""In the file: few, because the picture has few, and its size goes with them."""


WIDEST = 4096
"""Largest width [pixels]: of a large screen. The frames are in memory together."""


@dataclass(frozen=True)
class _Canvas:
    """From metres of the stage to pixels: width and height of the picture, pixels per metre, where x = 0, z = 0 lie."""

    width: int
    height: int
    scale: float
    left: float
    floor: float

    def at(self, points: np.ndarray) -> list[tuple[float, float]]:
        return [(self.left + self.scale * x, self.floor - self.scale * z) for x, z in points]


def movie(
    walk: RunLike | SceneLike,
    output: str | Path,
    *,
    periods: int = PERIODS,
    width: int = 720,
    duration: float | str | None = None,
    law: Sequence[str | os.PathLike[str]] = (),
) -> Path:
    """Show a walk as a GIF that repeats.

    Parameters
    ----------
    walk
        A run, a run's folder, or a device, scene file or scene that is simulated now.
    output
        The file, ending in .gif.
    periods
        Drive periods shown, the last ones of the run.
    width
        Of the picture [pixels].
    duration
        How long to simulate [s]; the scene's own when left out.
    law
        Python files with laws of your own.

    Returns
    -------
    Path
        The file.

    Raises
    ------
    InputError
        As `write_movie`, and for a duration of what is simulated already.
    """
    found: Any = walk
    if isinstance(walk, str | os.PathLike):
        laws = laws_of(law)
        found = read_run(walk, laws) if Path(walk).is_dir() else load_scene(walk, laws=laws)
    if isinstance(found, Scene):
        found = simulate(found, duration)
    elif duration is not None:
        raise InputError("a duration is for a device or scene: this run is over")
    return write_movie(found, output, width=width, periods=periods)


def write_movie(run: RunLike, path: str | Path, *, width: int = 720, periods: int = PERIODS) -> Path:
    """Write the last drive periods of a walk as a GIF that repeats, and return its path.

    Parameters
    ----------
    run
        A walker's run, or one read back from its folder.
    path
        The file, ending in .gif.
    width
        Of the picture [pixels].
    periods
        How many drive periods are shown; of drives that do not repeat the whole run is.

    Raises
    ------
    InputError
        For a robot without legs of its own, a name of another format, a width or number of periods that is too small.
    """
    target = Path(path)
    problems = []
    if not isinstance(run.scene.robot.structure, Walker):
        problems.append(f"{run.scene.name}: only walkers can be shown walking")
    if target.suffix.lower() != ".gif":
        problems.append(f"{target}: expected a name ending in .gif")
    if not (100 <= width <= WIDEST and periods >= 1):
        problems.append(f"expected a width of 100 to {WIDEST} pixels and a period, got {width} and {periods}")
    if problems:
        raise InputError(problems)
    motion = _shown(motion_of(run), periods)
    stage = stage_of(motion)
    frames = list(_frames(motion, stage, width))
    palette = _side_by_side(frames).quantize(COLOURS, Image.Quantize.MAXCOVERAGE, dither=Image.Dither.NONE)
    small = [frame.quantize(palette=palette, dither=Image.Dither.NONE) for frame in frames]
    with written_whole(target) as part:
        small[0].save(part, save_all=True, append_images=small[1:], duration=PACE_MS, loop=0, optimize=True)
    return target


def _shown(motion: Motion, periods: int) -> Motion:
    """The last whole periods, in frames evenly spread; without a period all of it."""
    end = float(motion.time[-1])
    span, count = end - float(motion.time[0]), 1
    if motion.period is not None:
        count = min(periods, math.ceil(span / motion.period))
        span = min(span, count * motion.period)
    part = motion.taken(motion.time >= end - span * (1.0 + 1e-9))
    return part.thinned(FRAMES * count)


def _side_by_side(frames: list[Image.Image]) -> Image.Image:
    """Some of the frames in one picture: every colour of the movie is in it."""
    some = frames[:: max(len(frames) // 12, 1)]
    width, height = some[0].size
    out = Image.new("RGB", (width, height * len(some)))
    for row, one in enumerate(some):
        out.paste(one, (0, row * height))
    return out


def _frames(motion: Motion, stage: Stage, width: int) -> Iterator[Image.Image]:
    back, front, _, _ = stage.box
    deep = BACK[0] * stage.length
    margin = 0.08 * (front - back)
    scale = FINE * width / (front - back + deep + 2.0 * margin)
    top = stage.leg + stage.thick + BACK[1] * stage.length + LIFT * stage.leg
    height = (int(scale * (top + BELOW * stage.leg)) // FINE + CAPTION) * FINE
    canvas = _Canvas(FINE * width, height, scale, scale * (margin - back), height - BELOW * stage.leg * scale)
    surge = motion.coordinate("surge") - motion.coordinate("surge")[0]
    apart = _apart(stage, float(surge[-1]))
    slower = (motion.time[1] - motion.time[0]) / (1e-3 * PACE_MS)
    caption = f"{1.0 / slower:.0f} times slower; upward {stage.up:g}, forward {stage.along:g} times enlarged"
    font = ImageFont.load_default(size=FINE * 12)
    for frame in range(len(motion.time)):
        picture = Image.new("RGB", (canvas.width, canvas.height), "white")
        pen = ImageDraw.Draw(picture)
        _ground(pen, canvas, apart, stage.along * float(surge[frame]))
        _robot(pen, canvas, motion, stage, frame)
        now = format_quantity(float(f"{motion.time[frame] - motion.time[0]:.3g}"), "s")
        pen.text((FINE * 8, FINE * 6), caption, fill=MUTED, font=font)
        pen.text((canvas.width - FINE * 8, FINE * 6), now, fill=INK, font=font, anchor="ra")
        yield picture.resize((width, canvas.height // FINE), Image.Resampling.LANCZOS)


def _apart(stage: Stage, way: float) -> float:
    """Distance of the ground's marks [m], about a twelfth of the robot, such that the way of all frames is a number of
    them: the picture repeats without a jump."""
    usual = stage.length / 12.0
    passed = abs(stage.along * way)
    return passed / round(passed / usual) if passed > 0.5 * usual else usual


def _ground(pen: ImageDraw.ImageDraw, canvas: _Canvas, apart: float, way: float) -> None:
    """The ground with marks that stay where they are on it, `apart` from each other, the picture gone on by `way`."""
    pen.line([(0, canvas.floor), (canvas.width, canvas.floor)], fill=INK, width=2 * FINE)
    step = canvas.scale * apart
    first = (canvas.left - canvas.scale * way) % step
    for x in np.arange(first - step, canvas.width + step, step):
        pen.line([(x, canvas.floor), (x - 8 * FINE, canvas.floor + 10 * FINE)], fill=MUTED, width=FINE)


def _robot(pen: ImageDraw.ImageDraw, canvas: _Canvas, motion: Motion, stage: Stage, frame: int) -> None:
    """Far legs, the body, near legs; a foot on the ground is filled, one that slips in another colour."""
    shape = drawn(motion, stage, frame)
    legs = {far: [leg for leg in range(len(motion.legs)) if stage.far[leg] == far] for far in (True, False)}
    pen.polygon(canvas.at(shape.far_face), fill=RULE, outline=MUTED)
    for far in (True, False):
        if not far:
            pen.polygon(canvas.at(shape.near_face), fill="#eef1f5", outline=INK, width=FINE)
        for leg in legs[far]:
            hip, foot = canvas.at(np.stack([shape.hips[leg], shape.feet[leg]]))
            state = motion.state[leg, frame]
            colour = MUTED if far else INK
            pen.line([hip, foot], fill=colour, width=(2 if far else 3) * FINE)
            touching = VERMILION if state == SLIPPING else BLUE
            radius = (4 if far else 5) * FINE
            box = [foot[0] - radius, foot[1] - radius, foot[0] + radius, foot[1] + radius]
            pen.ellipse(box, fill="white" if state == AIR else touching, outline=colour, width=FINE)
