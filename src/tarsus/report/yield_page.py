"""The report of a yield: distributions, what share of the robots meets a requirement, dead legs, and whose scatter
matters."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from matplotlib.axes import Axes

from tarsus.base.spec import float_paths
from tarsus.report.pages import PageFigure, Section, noted, sections_page
from tarsus.report.panel_grid import intervals, name_axes, panels, whole_ticks
from tarsus.report.style import BLUE, MUTED, ORANGE
from tarsus.study.yields import Yield
from tarsus.tables.numbers import path_end, spaced
from tarsus.tables.table import ROW, Column, Table

BARS = 12
"""Groups drawn at most, those that matter most."""

HEIGHT = 1.5
"""Of a panel [inch]."""

BINS = 40
"""Of a histogram: a robot's place to a fortieth of their range."""


def yield_html(found: Yield) -> str:
    """The page of a result, as text."""
    table, words = found.table(), spaced(found.measures[0])
    dead, indices = len(found.by_dead) > 1, any(found.indices.values())
    costs = _costs(found) if dead else None
    worst = f"Mean {words} with a leg dead, minus that with it alive, worst first."
    sections = [
        Section("What comes out of the workshop", _distributions(found)),
        Section("Yield against requirement", _curves(found), table.bare()),
        Section("Dead legs", _dead(found), worst if costs else "", costs) if dead else None,
        Section("Whose scatter matters", _indices(found)) if indices else None,
        Section("What was scattered", _scatter(found)),
        Section("How the runs ended", table.parts[0]),
    ]
    return sections_page(f"Yield: {found.robots.scene.name}", [f"{table.title}.", noted(table)], sections)


def _ranked(indices: Mapping[str, Mapping[str, float]]) -> list[tuple[str, Mapping[str, float]]]:
    return sorted(indices.items(), key=lambda one: -one[1]["total"])


def _distributions(found: Yield) -> PageFigure:
    def drawn(axes: Axes, name: str) -> None:
        axes.hist(found.values[name][np.isfinite(found.values[name])], bins=BINS, color=BLUE)
        name_axes(axes, (spaced(name), found.units[name]), ("robots", ""))
        whole_ticks(axes.xaxis, found.values[name])
        whole_ticks(axes.yaxis, len(found.values[name]))

    caption = "How the measures are distributed over the robots whose runs reached their end."
    return panels(found.measures, HEIGHT, drawn, caption)


def _curves(found: Yield) -> PageFigure:
    def drawn(axes: Axes, name: str) -> None:
        curve = found.curves[name]
        low, share, high = (100.0 * one for one in (curve.low, curve.share, curve.high))
        axes.fill_between(curve.requirement, low, high, color=BLUE, alpha=0.25, lw=0.0)
        axes.plot(curve.requirement, share, color=BLUE)
        across = f"{spaced(name)} {'at most' if curve.less else 'at least'}"
        name_axes(axes, (across, curve.unit), ("robots that meet it (%)", ""))
        whole_ticks(axes.xaxis, found.values[name])
        axes.set_ylim(0.0, 101.0)

    caption = "Share of the robots that meet a requirement, with its 95 % interval; failed runs meet none."
    return panels(found.measures, HEIGHT, drawn, caption)


def _dead(found: Yield) -> PageFigure:
    def drawn(axes: Axes, name: str) -> None:
        groups = [(one["dead"], *one[name]) for one in found.by_dead if one[name] is not None]
        dead, low, median, high = np.array(groups, dtype=float).reshape(-1, 4).T
        intervals(axes, dead, median, low, high, color=BLUE)
        name_axes(axes, ("dead legs", ""), (spaced(name), found.units[name]))
        axes.set_xticks(range(int(max(one["dead"] for one in found.by_dead)) + 1))
        axes.margins(x=0.2)

    caption = "Median, and the range of nine robots in ten, by the number of dead legs."
    return panels(found.measures, HEIGHT, drawn, caption)


def _costs(found: Yield) -> Table | None:
    """What each leg's death costs on average, the worst first."""
    first = found.measures[0]
    known = [(leg, *one) for leg, one in found.cost.items() if np.isfinite(one[0])]
    known.sort(key=lambda one: one[1], reverse=found.curves[first].less)
    unit = found.units[first]
    return Table("", ("leg", Column("difference", unit), Column("standard error", unit)), known) if known else None


def _indices(found: Yield) -> PageFigure:
    most = min(BARS, max(map(len, found.indices.values())))

    def drawn(axes: Axes, name: str) -> None:
        ranked = _ranked(found.indices.get(name, {}))[:BARS]
        places = np.arange(len(ranked))
        for shift, word, color in ((-0.15, "total", BLUE), (0.15, "first", ORANGE)):
            index, error = (np.array([one[key] for _, one in ranked]) for key in (word, f"{word}_error"))
            intervals(axes, places + shift, index, index - error, index + error, color=color, label=word, across=True)
        axes.axvline(0.0, color=MUTED, lw=0.7)
        axes.set_yticks(places, [path_end(group) for group, _ in ranked])
        axes.invert_yaxis()
        name_axes(axes, (f"Sobol index of {spaced(name)}", ""))

    caption = (
        f"Share of the variance that a leg's scatter makes alone (first) and with all it acts together with (total), "
        f"the {BARS} largest; lines are 95 % intervals."
    )
    return panels(found.measures, 0.2 * most + 0.3, drawn, caption)


def _scatter(found: Yield) -> Table:
    known = float_paths(found.robots.scene)
    ends = {path: axis.ends for path, axis in {**found.robots.scatter, **found.robots.over}.items()}
    kept = {path: one for path, one in ends.items() if one[1] > one[0]}
    rows = [(path, "ground" if path in found.robots.over else "scatter", *one) for path, one in kept.items()]
    columns = ("path", "as", Column("from", ROW), Column("to", ROW))
    return Table("", columns, rows, units=[known[path].unit for path in kept])
