"""The report of a yield: distributions, what share of the robots meets a requirement, dead legs, and whose scatter
matters."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from tarsus.base.spec import float_paths
from tarsus.report.charts import Charts, side_by_side
from tarsus.report.pages import Plate, page, rendered
from tarsus.report.style import BLUE, MUTED, ORANGE
from tarsus.study.yields import Yield
from tarsus.tables.numbers import path_end, spaced
from tarsus.tables.table import ROW, Column, Table

BARS = 12
"""Groups drawn at most, those that matter most: as many as have their names below them in half a page."""

BINS = 40
"""Of a histogram: a robot's place to a fortieth of their range."""


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


def _panels(found: Yield, drawn: Callable[[str], Charts], caption: str) -> Plate:
    """One chart for each measure."""
    return side_by_side((("", drawn(name)) for name in found.measures), caption)


def _distributions(found: Yield) -> Plate:
    def drawn(name: str) -> Charts:
        values = found.values[name][np.isfinite(found.values[name])]
        counts, edges = np.histogram(values, bins=BINS)
        charts = Charts([1.5], spaced(name), found.units[name], (float(edges[0]), float(edges[-1])))
        (panel,) = charts.panels
        for low, high, count in zip(edges[:-1].tolist(), edges[1:].tolist(), counts.tolist(), strict=True):
            panel.bars([(low, high)], 0.0, count, color=BLUE)
        panel.plot(0.5 * (edges[:-1] + edges[1:]), counts, color=BLUE, alpha=0.0)  # for the pointer
        panel.set_ylim(0.0, 1.05 * float(counts.max()))
        panel.set_ylabel("robots")
        return charts

    return _panels(
        found, drawn, "How the measures are distributed over the robots whose runs reached their end."
    )


def _curves(found: Yield) -> Plate:
    def drawn(name: str) -> Charts:
        curve = found.curves[name]
        charts = Charts([1.5], f"{spaced(name)} {'at most' if curve.less else 'at least'}", curve.unit)
        (panel,) = charts.panels
        panel.fill_between(curve.requirement, 100.0 * curve.low, 100.0 * curve.high, color=BLUE)
        panel.plot(curve.requirement, 100.0 * curve.share, color=BLUE, lw=1.2)
        panel.set_ylabel("robots that meet it (%)")
        panel.set_ylim(0.0, 101.0)
        return charts

    return _panels(
        found,
        drawn,
        "Share of the robots that meet a requirement, with its 95 % interval; failed runs meet none.",
    )


def _dead(found: Yield) -> Plate:
    def drawn(name: str) -> Charts:
        groups = [(one["dead"], *one[name]) for one in found.by_dead if one[name] is not None]
        dead, low, median, high = np.array(groups, dtype=float).reshape(-1, 4).T
        most = int(max(one["dead"] for one in found.by_dead))
        charts = Charts([1.5], "dead legs", "", rows=[str(count) for count in range(most + 1)])
        (panel,) = charts.panels
        panel.dots(dead, median, color=BLUE, label="median", low=low, high=high)
        panel.set_ylabel(spaced(name), found.units[name])
        return charts

    return _panels(found, drawn, "Median, and the range of nine robots in ten, by the number of dead legs.")


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
    def drawn(name: str) -> Charts:
        ranked = _ranked(found.indices.get(name, {}))[:BARS]
        charts = Charts([1.8], "scatter of", "", rows=[path_end(group) for group, _ in ranked])
        (panel,) = charts.panels
        for shift, word, color in ((-0.1, "total", BLUE), (0.1, "first", ORANGE)):
            index, error = (np.array([one[key] for _, one in ranked]) for key in (word, f"{word}_error"))
            panel.dots(
                np.arange(len(ranked)) + shift,
                index,
                color=color,
                label=word,
                low=index - error,
                high=index + error,
            )
        panel.axhline(0.0, color=MUTED)
        panel.set_ylabel(f"Sobol index of {spaced(name)}")
        return charts

    caption = (
        f"Share of the variance that a leg's scatter makes alone (first) and with all it acts together with (total), "
        f"the {BARS} largest; lines are 95 % intervals."
    )
    return _panels(found, drawn, caption)


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
