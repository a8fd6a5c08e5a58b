"""The report of what a robot does in the long run: attractors, their basins, and a page with the motion of each."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from tarsus.orbits.attractors import Attractors
from tarsus.orbits.basins import OTHERS
from tarsus.report.pages import Markup, PageFigure, Section, noted, sections_page, write_page
from tarsus.report.panel_grid import few_ticks, line, name_axes, panel
from tarsus.report.run_page import report_html
from tarsus.report.style import BLUE, GREEN, MUTED, ORANGE, PURPLE, SKY, VERMILION

COLOURS = (BLUE, ORANGE, GREEN, PURPLE, SKY, VERMILION)

PERIODS = 2
"""Periods of a settled motion that are drawn: the second shows that the first repeats."""


def attractors_html(found: Attractors, *, linked: bool = False) -> str:
    """The page as text; linked: whether there are pages of the attractors next to it."""
    table, names = found.table(), [f"attractor-{i}" for i in range(1, len(found) + 1)]
    measures, edges, *_ = [*(one.bare() for one in table.parts), None, None]
    link = Markup('<a href="{0}.html">{0}</a>') if linked else Markup("{0}")
    alone = Markup(
        "<p>Run by itself: {}; its file attractor-1.toml is a device for <code>tarsus simulate</code>.</p>"
    ).format(Markup(", ").join(map(link.format, names)))
    sections = [
        Section("What it settles to", table.bare(), *([alone, _motion(found), measures] if len(found) else [])),
        Section("Which starts lead where", _basins(found)),
        Section("Edges of basins", edges) if edges else None,
    ]
    return sections_page(f"Attractors: {found.scene.name}", [f"{table.title}.", noted(table)], sections)


def write_pages(found: Attractors, folder: Path) -> list[Path]:
    """The page, and one of a run that settles to each attractor, whose motion it plays."""
    pages = [write_page(attractors_html(found, linked=True), folder / "report.html")]
    for i, one in enumerate(found.found, start=1):
        run: Any = one.run
        pages.append(write_page(report_html(run), folder / f"attractor-{i}.html"))
    return pages


def _colour(number: int) -> str:
    return COLOURS[number % len(COLOURS)] if number >= 0 else MUTED


def _motion(found: Attractors) -> PageFigure:
    """Gaps of the first foot over two periods of every attractor."""

    def draw(axes: Axes) -> None:
        for i, one in enumerate(found.found[: len(COLOURS)]):
            end = one.run.duration
            times = np.linspace(end - PERIODS * one.period, end, 600)
            phase, gap = (times - times[0]) / one.drive, one.run.states(times).gap[0]
            line(axes, phase, gap, lw=1.0, color=_colour(i), label=f"{i + 1}: {one.kind}")
        name_axes(axes, ("drive periods", ""), (f"gap of {next(iter(found.scene.robot.feet), '')}", "m"))

    return panel(1.9, draw, f"Height of a foot over {PERIODS} periods of each settled motion.")


def _basins(found: Attractors) -> PageFigure:
    """Every start by where it leads, over the first two axes of the box."""
    units = found.box.units()
    paths = list(found.box.ends)[:2]
    ends = np.array([found.box.ends[path] for path in paths])
    places = ends[:, 0] + (ends[:, 1] - ends[:, 0]) * found.points[:, : len(paths)]
    across = places[:, 1] if len(paths) > 1 else found.label + (found.label >= 0.0)

    def draw(axes: Axes) -> None:
        for label in np.unique(found.label).tolist():
            own = found.label == label
            words = OTHERS[label] if label < 0 else f"{label + 1}: {found[label].kind}"
            axes.plot(places[own, 0], across[own], "o", ms=3.5, mew=0.0, color=_colour(label), label=words)
        second = (paths[1], units[paths[1]]) if len(paths) > 1 else ("attractor", "")
        name_axes(axes, (paths[0], units[paths[0]]), second)
        few_ticks(axes, x=6, y=5)
        if len(paths) == 1:
            axes.set_yticks(np.unique(across))

    return panel(2.6, draw, "Starts by the motion they lead to.")
