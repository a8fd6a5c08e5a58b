"""The report of a yield: distributions, what share of the robots meets a requirement, dead legs, and whose scatter
matters."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
from matplotlib.axes import Axes

from tarsus.base.spec import float_paths
from tarsus.report.pages import Plate, page, rendered
from tarsus.report.sheet import Sheet, few_ticks, name_axes, plate
from tarsus.report.style import BLUE, MUTED, ORANGE
from tarsus.study.yields import Yield
from tarsus.tables.numbers import path_end, spaced
from tarsus.tables.table import ROW, Column, Table

BARS = 12
"""Groups drawn at most, those that matter most: as many bars as have their names beside them in two inches."""


def yield_html(found: Yield) -> str:
    """The page of a result, as text."""
    scene, first = found.robots.scene, found.measures[0]
    values = found.values[first][np.isfinite(found.values[first])]
    low, middle, high = (float(one) for one in np.quantile(values, (0.05, 0.5, 0.95)))
    leader, whole = found.leaders.get(first), found.table()
    dead, indices = len(found.by_dead) > 1, any(found.indices.values())
    body = rendered(
        "yield.html", found=found, scene=scene, first=first, unit=found.units[first], low=low, middle=middle,
        high=high, leader="" if leader is None else leader.sentence(spaced(first)), curves=_curves(found),
        distributions=_distributions(found), quantiles=whole.bare(), dead=_dead(found) if dead else None,
        dead_table=_dead_table(found) if dead else "", costs=_costs(found) if dead else None,
        indices=_indices(found) if indices else None, index_table=_index_table(found) if indices else "",
        scatter=_scatter(found), outcomes=whole.parts[0],
    )  # fmt: skip
    return page(f"{scene.name} – yield", body)


def _ranked(indices: Mapping[str, Mapping[str, float]]) -> list[tuple[str, Mapping[str, float]]]:
    return sorted(indices.items(), key=lambda one: -one[1]["total"])


def _panels(found: Yield, draw: Callable[[Axes, str], object], caption: str) -> Plate:
    """One panel for each measure."""

    def all_of_them(sheet: Sheet) -> None:
        panels = sheet.grid(len(found.measures), 2.0)
        for axes, name in zip(panels, found.measures, strict=True):
            draw(axes, name)
        sheet.legend(panels[0])

    return plate(all_of_them, caption)


def _distributions(found: Yield) -> Plate:
    def draw(axes: Axes, name: str) -> None:
        values = found.values[name][np.isfinite(found.values[name])]
        axes.hist(values, bins=40, color=BLUE)
        name_axes(axes, (spaced(name), found.units[name]), ("robots", ""))
        few_ticks(axes, x=5, y=5)

    return _panels(
        found, draw, "How the measures are distributed over the robots whose runs reached their end."
    )


def _curves(found: Yield) -> Plate:
    def draw(axes: Axes, name: str) -> None:
        curve = found.curves[name]
        at = curve.requirement
        axes.fill_between(at, 100.0 * curve.low, 100.0 * curve.high, color=BLUE, alpha=0.25, lw=0.0)
        axes.plot(at, 100.0 * curve.share, color=BLUE, lw=1.2)
        words = f"{spaced(name)} {'at most' if curve.less else 'at least'}"
        name_axes(axes, (words, curve.unit), ("robots that meet it (%)", ""))
        axes.set_ylim(0.0, 101.0)
        few_ticks(axes, x=5, y=5)

    return _panels(
        found,
        draw,
        "Share of the robots that meet a requirement, with its 95 % interval; failed runs meet none.",
    )


def _dead(found: Yield) -> Plate:
    def draw(axes: Axes, name: str) -> None:
        groups = [(one["dead"], one[name]) for one in found.by_dead if one[name] is not None]
        if not groups:
            return
        at, rows = np.array([one for one, _ in groups]), np.array([row for _, row in groups])
        axes.errorbar(at, rows[:, 1], yerr=[rows[:, 1] - rows[:, 0], rows[:, 2] - rows[:, 1]], fmt="o", ms=4.0,
                      color=BLUE, ecolor=MUTED, lw=1.0)  # fmt: skip
        name_axes(axes, ("dead legs", ""), (spaced(name), found.units[name]))
        axes.set_xticks(at)
        axes.margins(x=0.2)

    return _panels(found, draw, "Median, and the range of nine robots in ten, by the number of dead legs.")


def _dead_table(found: Yield) -> Table:
    rows = [
        (one["dead"], one["robots"], one["failed"], *(one[n] and one[n][1] for n in found.measures))
        for one in found.by_dead
    ]
    columns = [Column(f"median {spaced(name)}", found.units[name]) for name in found.measures]
    return Table("", ("dead legs", "robots", "failed", *columns), rows)


def _costs(found: Yield) -> Table | None:
    """What each leg's death costs on average, the worst first."""
    first = found.measures[0]
    known = [(leg, *one) for leg, one in found.cost.items() if np.isfinite(one[0])]
    known.sort(key=lambda one: one[1], reverse=found.curves[first].less)
    unit = found.units[first]
    return (
        Table("", ("leg", Column("difference", unit), Column("standard error", unit)), known)
        if known
        else None
    )


def _indices(found: Yield) -> Plate:
    ranked = {name: _ranked(found.indices.get(name, {}))[:BARS] for name in found.measures}

    def draw(axes: Axes, name: str) -> None:
        at = np.arange(len(ranked[name]))
        for offset, word, color in ((-0.2, "total", BLUE), (0.2, "first", ORANGE)):
            values, errors = ([one[key] for _, one in ranked[name]] for key in (word, f"{word}_error"))
            axes.barh(
                at + offset, values, 0.38, color=color, label=word, xerr=errors,
                error_kw={"ecolor": MUTED, "lw": 0.8},
            )  # fmt: skip
        axes.set_yticks(at, [path_end(group) for group, _ in ranked[name]])
        axes.invert_yaxis()
        axes.set_xlabel(f"Sobol index of {spaced(name)}")
        few_ticks(axes, x=5)

    caption = (
        f"Share of the variance that a leg's scatter makes alone (first) and with all it acts together with (total), "
        f"the {BARS} largest; lines are 95 % intervals."
    )
    return _panels(found, draw, caption)


def _settled(index: float) -> float:
    """An index; one below a thousandth, far below any interval that is seen, is none."""
    return index if abs(index) >= 1e-3 else 0.0


def _index_table(found: Yield) -> Table:
    rows = [
        (group, *(_settled(one[word]) for word in ("total", "total_error", "first", "first_error")))
        for group, one in _ranked(found.indices.get(found.measures[0], {}))
    ]
    return Table("", ("scatter of", *(Column(name, digits=3) for name in ("total", "±", "first", "±"))), rows)


def _scatter(found: Yield) -> Table:
    known = float_paths(found.robots.scene)
    ends = {path: axis.ends for path, axis in {**found.robots.scatter, **found.robots.over}.items()}
    kept = {path: one for path, one in ends.items() if one[1] > one[0]}
    rows = [(path, "ground" if path in found.robots.over else "scatter", *one) for path, one in kept.items()]
    columns = ("path", "as", Column("from", ROW), Column("to", ROW))
    return Table("", columns, rows, units=[known[path].unit for path in kept])
