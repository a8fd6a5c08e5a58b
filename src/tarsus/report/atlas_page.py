"""The page of an atlas: maps of its classes and measures, and the command line of a run of each class."""

from __future__ import annotations

from typing import Any

import numpy as np
from markupsafe import Markup
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap
from matplotlib.image import AxesImage
from matplotlib.ticker import MaxNLocator

from tarsus.atlas.cells import MEASURES, MOST_PERIODS
from tarsus.atlas.classes import meanings, words
from tarsus.atlas.result import Atlas
from tarsus.orbits.returns import drive_period
from tarsus.report.pages import Fold, PageFigure, Section, sections_page, terms
from tarsus.report.panel_grid import QUARTER, few_ticks, name_axes, panel, panels
from tarsus.report.style import BLUE, GREEN, INK, MUTED, PURPLE, VERMILION, scale_of
from tarsus.tables.numbers import amount, percent, spaced

COLOURS = ("#56b4ea", "#0073b2", "#e69f00", "#009f73", "#d55f00", "#cc79a7", "#f0e442", "#7b3fa0", "#8fd19e", "#a6761d")
"""Of classes that repeat, again from the first where there are more; those of others are greys. A dark page changes
none of them, for they are pixels of a picture."""

GREYS = {"chaotic": "#3a3a3a", "not settled": "#8a8a8a"}
LINES = (VERMILION, INK, PURPLE, GREEN, BLUE)

MOST = 513
"""Points of a map each way that are drawn, about one for a pixel; `atlas.nc` has all."""


def atlas_html(found: Atlas) -> str:
    """The page as text."""
    table, (measures,) = found.table(), found.table().parts
    about = ", ".join(
        f"{one.path} from {amount(one.low, one.unit)} to {amount(one.high, one.unit)}" for one in (found.x, found.y)
    )
    what = Fold("What the classes are", terms(meanings(found.classes)))
    sections = [
        Section("Classes", _map(found), table.bare(), *(f"{note}." for note in table.notes), what, _commands(found)),
        Section("Measures", _measures(found), measures.bare()),
    ]
    name = found.scene.name
    footer = "Every run is a line of cells.csv."
    return sections_page(f"Atlas: {name}", [f"{about}."], sections, footer)


def _field(axes: Axes, found: Atlas, values: np.ndarray, **look: Any) -> AxesImage:
    """Values (n, n) at the points of the grid as colours, a pixel each."""
    step = -(-(found.size - 1) // (MOST - 1))
    inside = {"transform": axes.transAxes, "extent": (0.0, 1.0, 0.0, 1.0), "aspect": "auto"}
    image = axes.imshow(values[::step, ::step].T, origin="lower", interpolation="none", **inside, **look)
    half = 0.5 * step / (found.size - 1)
    ends = [one.at([-half, 1.0 + half]).tolist() for one in (found.x, found.y)]
    axes.set(xscale="log" if found.x.log else "linear", yscale="log" if found.y.log else "linear")
    axes.set(xlim=ends[0], ylim=ends[1])
    axes.dataLim.set_points(np.transpose(ends))
    name_axes(axes, (found.x.path, found.x.unit), (found.y.path, found.y.unit))
    few_ticks(axes, x=None if found.x.log else 4, y=None if found.y.log else 4)
    return image


def _map(found: Atlas) -> PageFigure:
    """Classes by colour, with what is drawn over them."""
    colours = [GREYS.get(words(code), "#c8c8c8") if code < 0 else "" for code in found.classes]
    for n, place in enumerate(place for place, colour in enumerate(colours) if not colour):
        colours[place] = COLOURS[n % len(COLOURS)]
    number = np.array([found.classes.index(code) for code in found.grid.code.ravel().tolist()])

    def draw(axes: Axes) -> None:
        shown = number.reshape(found.grid.code.shape)
        _field(axes, found, shown, cmap=ListedColormap(colours), vmin=-0.5, vmax=len(colours) - 0.5)
        for code, colour in zip(found.classes, colours, strict=True):
            label = f"{words(code)} ({percent(found.share(code))})"
            axes.plot([], [], "s", ms=6.0, color=colour, mec=MUTED, mew=0.5, label=label)
        for n, one in enumerate(found.overlays):
            look = {"ls": "", "marker": "o", "ms": 4.0, "mfc": "none"} if one.marks else {}
            for places in one.lines:
                axes.plot(*places.T, color=LINES[n % len(LINES)], label=one.name, scalex=False, scaley=False, **look)

    shown = panel(3.2, draw, "Classes of the settled motion over both numbers.", width=4.4)
    return PageFigure(Markup('<div class="large">{}</div>').format(shown.picture), shown.caption)


def _measures(found: Atlas) -> PageFigure:
    """A map of every measure."""
    known = [name for name, values in found.measures.items() if np.isfinite(values).any()]

    def draw(axes: Axes, name: str) -> None:
        low, high = np.nanpercentile(found.measures[name], (1.0, 99.0))
        scale = scale_of(MEASURES[name][0], low, high)
        shown = found.measures[name][found.grid.source] / scale.step
        image = _field(axes, found, shown, vmin=low / scale.step, vmax=high / scale.step)
        axes.figure.colorbar(image, ax=axes, label=scale.axis(spaced(name)), ticks=MaxNLocator(3))

    ends = "a colour at an end of a scale stands for what lies beyond"
    return panels(known, 1.7, draw, f"Measures over both numbers; {ends}.", width=QUARTER)


def _commands(found: Atlas) -> Fold:
    """Of every class the command line of a run in its middle."""
    moved = any(axis.path.endswith(".frequency") for axis in (found.x, found.y))
    period, settled = None if moved else drive_period(found.scene), found.measures.get("settled_after")
    lines = {}
    for code in found.classes:
        own = np.flatnonzero(found.code == code)
        share = found.grid.points[own]
        run = own[np.argmin(np.hypot(*(share - share.mean(axis=0)).T))]
        sets = [f"--set {axis.path}={at:.15g}" for axis, at in zip((found.x, found.y), found.places[run], strict=True)]
        after = MOST_PERIODS if settled is None or not np.isfinite(settled[run]) else settled[run]
        lasts = f" --duration {(after + 20.0) * period:.6g}s" if period else ""
        lines[words(code)] = f"tarsus simulate scene.toml {' '.join(sets)}{lasts}"
    return Fold("A run of each class", terms(lines))
