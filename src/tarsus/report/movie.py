"""A run as a moving picture (GIF or WebM): the robot from its right, the ground passing below it, motion enlarged."""

from __future__ import annotations

import math
import os
import shutil
import subprocess
from collections.abc import Iterator, Sequence
from itertools import groupby
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from PIL import Image

from tarsus.base.arrays import Floats
from tarsus.base.errors import InputError
from tarsus.base.units import format_quantity
from tarsus.base.verb import verb
from tarsus.files.library import SceneLike, load_scene
from tarsus.files.whole import written_whole
from tarsus.model.laws.userfile import laws_of
from tarsus.model.scene import Scene
from tarsus.report.drawing import Drawing, FootMark, Shape, drawing_of
from tarsus.report.motion import AIR, SLIPPING, STUCK, Held, Motion, motion_of
from tarsus.report.style import INK, MUTED, VERMILION
from tarsus.solve import Run, load_run, simulate

if TYPE_CHECKING:
    from matplotlib.axes import Axes

FRAMES = 48
"""Frames of a drive period, or of a run without one."""

PERIODS = 2
"""Drive periods shown: from one to the next the ground has passed on."""

ENDINGS = (".gif", ".webm")
"""Of the files that can be written."""

BELOW = 0.12
"""Space below the ground for its marks, of a leg's length."""

CAPTION = 20
"""Height of the line of words above the picture [pixels]."""

PACE_MS = 50
"""Time a frame is shown [ms]: 20 a second is fluent, and most viewers go no faster."""

POINTS = 0.5
"""Width of a line of width 1 [pt]."""

MARKS = {AIR: ("o", "#ffffff", MUTED), STUCK: ("o", INK, INK), SLIPPING: ("^", "#ffffff", VERMILION)}
"""Marker, filling and edge of a foot in each state."""

DPI = 100
"""Pixels of an inch, by which letters and lines have their size."""

COLOURS = 48
"""In the file: few, because the picture has few, and its size goes with them."""


WIDEST = 4096
"""Largest width [pixels]: of a large screen. The frames are in memory together."""


@verb
def movie(
    walk: Run | SceneLike,
    output: str | Path,
    *,
    periods: int = PERIODS,
    width: int = 720,
    duration: float | str | None = None,
    law: Sequence[str | os.PathLike[str]] = (),
) -> Path:
    """Show a robot's motion as a GIF that repeats, or as a WebM where ffmpeg is installed.

    Parameters
    ----------
    walk
        A run's folder, or a device or scene file that is simulated now; in Python also a run or a scene.
    output
        The file, ending in .gif, or in .webm: about an eighth of the size, by ffmpeg.
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
        For a name of another format, a width or number of periods that is too small, a WebM where there is no ffmpeg or
        it fails, and a duration of what is simulated already.
    """
    target, found = Path(output), walk
    problems = []
    if target.suffix.lower() not in ENDINGS:
        problems.append(f"{target}: expected a name ending in {' or '.join(ENDINGS)}")
    elif target.suffix.lower() == ".webm" and shutil.which("ffmpeg") is None:
        problems.append(f"{target}: a WebM needs ffmpeg on the path, and there is none; a GIF needs nothing")
    if not 100 <= width <= WIDEST:
        problems.append(f"width: expected 100 to {WIDEST} pixels, got {width}")
    if periods < 1:
        problems.append(f"periods: expected 1 or more, got {periods}")
    if problems:
        raise InputError(problems)
    if isinstance(found, str | os.PathLike):
        laws = laws_of(law)
        found = load_run(found, laws) if Path(found).is_dir() else load_scene(str(found), laws=laws)
    if isinstance(found, Scene):
        found = simulate(found, duration)
    elif duration is not None:
        raise InputError("a duration is for a device or scene: this run is over")
    motion = _shown(motion_of(found), periods)
    frames = list(_frames(motion, drawing_of(motion), width))
    with written_whole(target) as part:
        _film(frames, part) if target.suffix.lower() == ".webm" else _gif(frames, part)
    return target


def _gif(frames: list[Image.Image], file: Path) -> None:
    """Write frames as a GIF that repeats, in colours that all share."""
    palette = _side_by_side(frames).quantize(COLOURS, Image.Quantize.MAXCOVERAGE, dither=Image.Dither.NONE)
    small = [frame.quantize(palette=palette, dither=Image.Dither.NONE) for frame in frames]
    small[0].save(file, save_all=True, append_images=small[1:], duration=PACE_MS, loop=0, optimize=True)


def _film(frames: list[Image.Image], file: Path) -> None:
    """Write frames as VP9, whose pictures have even sides. Raises InputError with ffmpeg's last line where it fails."""
    width, height = frames[0].size
    raw = f"-f rawvideo -pix_fmt rgb24 -s {width}x{height} -r {1000 / PACE_MS:g} -i -"
    written = "-vf pad=ceil(iw/2)*2:ceil(ih/2)*2 -c:v libvpx-vp9 -crf 32 -b:v 0 -pix_fmt yuv420p"
    words = f"ffmpeg -y -loglevel error {raw} {written}".split()
    pixels = b"".join(frame.tobytes() for frame in frames)
    done = subprocess.run([*words, str(file)], input=pixels, capture_output=True, check=False)
    if done.returncode:
        said = done.stderr.decode(errors="replace").strip().splitlines() or ["it says nothing"]
        raise InputError(f"{file.name}: ffmpeg could not write it: {said[-1]}")


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


def _frames(motion: Motion, drawing: Drawing, width: int) -> Iterator[Image.Image]:
    """The frames as pictures of a width [pixels]."""
    left, right, bottom, top = drawing.box
    room, mark = 0.08 * (right - left), BELOW * drawing.leg
    left, right, bottom, top = left - room, right + room, bottom - mark, top + 0.5 * room
    height = int(width * (top - bottom) / (right - left)) + CAPTION
    slower = (motion.time[1] - motion.time[0]) / (1e-3 * PACE_MS)
    forward = f", forward {drawing.along:g}" if motion.held is Held.LEGS else ""
    caption = f"{1.0 / slower:.0f} times slower; upward {drawing.up:g}{forward} times enlarged"
    if motion.incline:
        caption += f"; the ground rises by {math.degrees(motion.incline):.3g} deg"
    figure = Figure(figsize=(width / DPI, height / DPI), dpi=DPI)
    canvas = FigureCanvasAgg(figure)
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0 - CAPTION / height))
    axes.set_axis_off()
    axes.set(xlim=(left, right), ylim=(bottom, top), autoscale_on=False)
    figure.text(8 / width, 1.0 - 6 / height, caption, color=MUTED, va="top")
    clock = figure.text(1.0 - 8 / width, 1.0 - 6 / height, "", color=INK, va="top", ha="right")
    places, way = (drawing.seen(motion), drawing.along * (motion.coordinate("surge") - motion.coordinate("surge")[0]))
    apart, risen = _apart(drawing, float(way[-1])), drawing.up * motion.ground_shift[1]
    for frame in range(len(motion.time)):
        for old in [*axes.lines, *axes.patches]:
            old.remove()
        _paint_ground(axes, drawing, motion, places[..., frame], frame)
        if motion.held is Held.LEGS:
            first = (-way[frame] - left) % apart + left
            marks = np.arange(first - apart, right + apart, apart)
            heights = np.array([[0.0], [-mark]]) + risen[frame] + np.zeros(len(marks))
            axes.plot([marks, marks - 0.4 * mark], heights, color=MUTED, lw=0.8)
        _paint(axes, drawing, motion, places[..., frame], frame)
        clock.set_text(format_quantity(float(f"{motion.time[frame] - motion.time[0]:.3g}"), "s"))
        canvas.draw()
        yield Image.fromarray(np.asarray(canvas.buffer_rgba())).convert("RGB")


def _paint(axes: Axes, drawing: Drawing, motion: Motion, at: Floats, frame: int) -> None:
    """A moment of a motion in axes of metres, its points at (2, n): shapes, and feet as open circles in the air, full
    ones stuck, triangles slipping."""
    size = float(np.clip(60.0 / len(motion.legs), 1.6, 4.5))
    groups = groupby(drawing.side.parts, lambda one: one if isinstance(one, Shape) and one.fill else _look(one))
    for order, (look, parts) in enumerate(groups, 1):
        if isinstance(look, Shape):
            shape = at[:, list(look.points)]
            axes.fill(*shape, fc=look.fill, ec=look.edge, lw=POINTS * look.width, zorder=order)
        elif look:
            lines = [at[:, list(one.points)] for one in parts if isinstance(one, Shape)]
            broken = np.concatenate([part for one in lines for part in (one, np.full((2, 1), np.nan))], 1)
            axes.plot(*broken, color=look[0], lw=POINTS * look[1], zorder=order)
        else:
            feet = [one for one in parts if isinstance(one, FootMark)]
            state = motion.state[[one.leg for one in feet], frame]
            for kind, (marker, fill, edge) in MARKS.items():
                own = at[:, [one.point for one in feet]][:, state == kind]
                axes.plot(*own, marker, ms=size, mfc=fill, mec=edge, mew=0.8, zorder=order + 0.5)


def _look(part: Shape | FootMark) -> tuple[str, float] | None:
    """By what neighbours are painted at once: lines of one look, and feet."""
    return (part.edge, part.width) if isinstance(part, Shape) else None


def _paint_ground(axes: Axes, drawing: Drawing, motion: Motion, at: Floats, frame: int) -> None:
    """The ground at a moment: a line, or of uneven ground the piece below each foot, as large as motion is drawn."""
    for piece, line in zip(drawing.pieces, drawing.ground_below(motion, at, frame), strict=True):
        axes.plot(*line, color=INK if piece.paint == MUTED else piece.paint, lw=1.5, zorder=0)
    if drawing.level and not drawing.pieces:
        axes.axhline(drawing.up * motion.ground_shift[1, frame], color=INK, lw=1.5, zorder=0)


def _apart(drawing: Drawing, way: float) -> float:
    """Distance of the ground's marks [m], about a twelfth of the robot, such that the drawn way of all frames is a
    number of them: the picture repeats without a jump."""
    usual = drawing.length / 12.0
    return abs(way) / round(abs(way) / usual) if abs(way) > 0.5 * usual else usual
