"""What the report of a walker's run shows in place of the motion of points: the walk itself, footfalls, forces."""

from __future__ import annotations

from collections.abc import Iterator

from tarsus.files.store import RunLike
from tarsus.report import walk_figures as figures
from tarsus.report.html import figure
from tarsus.report.motion import motion_of, whole_motion
from tarsus.report.player import walk_section
from tarsus.report.series import Window


def walk_sections(run: RunLike, numbers: Iterator[int], detail: Window, measures: str) -> Iterator[str]:
    """Sections of a page from the walk to the forces; `detail` is the stretch of the figures of footfalls and forces,
    `measures` the table that stands between, `numbers` those of the page's figures."""
    whole = whole_motion(run)
    yield "<h2>The walk</h2>\n"
    yield walk_section(motion_of(run, whole=whole), next(numbers))
    yield figure(figures.travel(whole), next(numbers))
    if run.foot_names:
        yield figure(figures.footfalls(whole, detail), next(numbers))
    yield "<h2>Measures</h2>\n"
    yield measures
    if run.foot_names:
        yield "<h2>Forces</h2>\n"
        yield figure(figures.ground_forces(whole, detail), next(numbers))
