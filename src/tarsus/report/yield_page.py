"""The report of a yield: distributions, what share of the robots meets a requirement, dead legs, and whose scatter
matters."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes

from tarsus.base.spec import float_paths
from tarsus.files.store import write_text
from tarsus.report.figures import Plate
from tarsus.report.html import MISSING, Cell, Column, Markup, amount, number, page, table
from tarsus.report.render import rendered
from tarsus.report.sheet import Sheet, few_ticks, plate
from tarsus.report.style import BLUE, MUTED, ORANGE, Scale, scale_of
from tarsus.study.workunit import OUTCOMES
from tarsus.study.yields import Yield
from tarsus.tables.numbers import pretty_unit

__all__ = ["write_yield_report", "yield_html"]

BARS = 12
"""Groups drawn at most: the ones that matter most."""


def write_yield_report(found: Yield, path: str | Path) -> Path:
    """Write a yield as one self-contained HTML file; returns its path. Raises InputError if it cannot be written."""
    target = Path(path)
    write_text(target, yield_html(found))
    return target


def yield_html(found: Yield) -> str:
    """The page as text; see `write_yield_report`."""
    scene, first = found.robots.scene, found.measures[0]
    values = found.values[first][np.isfinite(found.values[first])]
    low, middle, high = (float(one) for one in np.quantile(values, (0.05, 0.5, 0.95)))
    leader = found.leaders.get(first)
    dead, indices = len(found.by_dead) > 1, any(found.indices.values())
    body = rendered(
        "yield.html", found=found, scene=scene, first=first, unit=found.units[first], low=low, middle=middle,
        high=high, leader="" if leader is None else leader.sentence(_words(first)), curves=_curves(found),
        distributions=_distributions(found), quantiles=_quantiles(found), dead=_dead(found) if dead else None,
        dead_table=_dead_table(found) if dead else "", costs=_costs(found) if dead else "",
        indices=_indices(found) if indices else None, index_table=_index_table(found) if indices else "",
        scatter=_scatter(found), outcomes=_outcomes(found),
    )  # fmt: skip
    return page(f"{scene.name} – yield", body)


def _words(name: str) -> str:
    return name.replace("_", " ")


def _ranked(indices: Mapping[str, Mapping[str, float]]) -> list[tuple[str, Mapping[str, float]]]:
    return sorted(indices.items(), key=lambda one: -one[1]["total"])


def _scale(unit: str, values: np.ndarray) -> Scale:
    """As `scale_of`; numbers without a unit have no prefix."""
    return Scale(1.0, "") if unit == "1" else scale_of(unit, values)


def _in(scale: Scale) -> str:
    return f" ({pretty_unit(scale.label)})" if scale.label else ""


def _panels(found: Yield, draw: Callable[[Axes, str], object], caption: str, **room: float) -> Plate:
    """One panel for each measure, two in a row on wide paper."""

    def all_of_them(sheet: Sheet) -> None:
        panels = sheet.grid(len(found.measures), 2.0, **room)
        for axes, name in zip(panels, found.measures, strict=True):
            draw(axes, name)
        sheet.legend(panels[0])

    return plate(all_of_them, caption)


def _distributions(found: Yield) -> Plate:
    def draw(axes: Axes, name: str) -> None:
        values = found.values[name][np.isfinite(found.values[name])]
        scale = _scale(found.units[name], values)
        axes.hist(values / scale.step, bins=40, color=BLUE)
        axes.set_xlabel(f"{_words(name)}{_in(scale)}")
        axes.set_ylabel("robots")
        few_ticks(axes, x=5, y=5)

    return _panels(
        found, draw, "How the measures are distributed over the robots whose runs reached their end."
    )


def _curves(found: Yield) -> Plate:
    def draw(axes: Axes, name: str) -> None:
        curve = found.curves[name]
        scale = _scale(curve.unit, curve.requirement)
        at = curve.requirement / scale.step
        axes.fill_between(at, 100.0 * curve.low, 100.0 * curve.high, color=BLUE, alpha=0.25, lw=0.0)
        axes.plot(at, 100.0 * curve.share, color=BLUE, lw=1.2)
        axes.set_xlabel(f"{_words(name)} {'at most' if curve.less else 'at least'}{_in(scale)}")
        axes.set_ylabel("robots that meet it (%)")
        axes.set_ylim(0.0, 101.0)
        few_ticks(axes, x=5, y=5)

    return _panels(
        found,
        draw,
        "Share of the robots that meet a requirement, with its 95 % interval; failed runs meet none.",
    )


def _quantiles(found: Yield) -> Markup:
    """The requirements that given shares of the robots meet."""
    shares = (0.99, 0.9, 0.5, 0.1)
    rows: list[list[Cell]] = []
    for name in found.measures:
        curve = found.curves[name]
        cells = []
        for share in shares:
            met = curve.requirement[curve.share >= share]
            hardest = (met.min() if curve.less else met.max()) if len(met) else None
            cells.append(MISSING if hardest is None else amount(float(hardest), curve.unit))
        rows.append([_words(name), "at most" if curve.less else "at least", *cells])
    head = (
        Column("measure", number=False),
        Column("is", number=False),
        *(Column(f"{s:.0%} of robots") for s in shares),
    )
    return table(head, rows)


def _dead(found: Yield) -> Plate:
    def draw(axes: Axes, name: str) -> None:
        groups = [(one["dead"], one[name]) for one in found.by_dead if one[name] is not None]
        if not groups:
            return
        at, rows = np.array([one for one, _ in groups]), np.array([row for _, row in groups])
        scale = _scale(found.units[name], rows)
        rows = rows / scale.step
        axes.errorbar(at, rows[:, 1], yerr=[rows[:, 1] - rows[:, 0], rows[:, 2] - rows[:, 1]], fmt="o", ms=4.0,
                      color=BLUE, ecolor=MUTED, lw=1.0)  # fmt: skip
        axes.set_xlabel("dead legs")
        axes.set_ylabel(f"{_words(name)}{_in(scale)}")
        axes.set_xticks(at)
        axes.margins(x=0.2)

    return _panels(found, draw, "Median, and the range of nine robots in ten, by the number of dead legs.")


def _dead_table(found: Yield) -> Markup:
    rows: list[list[Cell]] = []
    for one in found.by_dead:
        cells = [MISSING if one[n] is None else amount(one[n][1], found.units[n]) for n in found.measures]
        rows.append([str(one["dead"]), str(one["robots"]), str(one["failed"]), *cells])
    head = (
        Column("dead legs"),
        Column("robots"),
        Column("failed"),
        *(Column(f"median {_words(n)}") for n in found.measures),
    )
    return table(head, rows)


def _costs(found: Yield) -> Markup | str:
    """What each leg's death costs on average."""
    first = found.measures[0]
    known = [(leg, *one) for leg, one in found.cost.items() if np.isfinite(one[0])]
    if not known:
        return ""
    known.sort(key=lambda one: one[1], reverse=found.curves[first].less)
    rows: list[list[Cell]] = [
        [leg, amount(cost, found.units[first]), amount(error, found.units[first])]
        for leg, cost, error in known
    ]
    return table(
        (Column("leg", number=False), Column("difference"), Column("standard error")), rows, tall=True
    )


def _indices(found: Yield) -> Plate:
    ranked = {name: _ranked(found.indices.get(name, {}))[:BARS] for name in found.measures}
    longest = max((len(_short(group)) for one in ranked.values() for group, _ in one), default=4)

    def draw(axes: Axes, name: str) -> None:
        at = np.arange(len(ranked[name]))
        for offset, word, color in ((-0.2, "total", BLUE), (0.2, "first", ORANGE)):
            values, errors = ([one[key] for _, one in ranked[name]] for key in (word, f"{word}_error"))
            axes.barh(
                at + offset, values, 0.38, color=color, label=word, xerr=errors,
                error_kw={"ecolor": MUTED, "lw": 0.8},
            )  # fmt: skip
        axes.set_yticks(at, [_short(group) for group, _ in ranked[name]])
        axes.invert_yaxis()
        axes.set_xlabel(f"Sobol index of {_words(name)}")
        few_ticks(axes, x=5)

    caption = (
        f"Share of the variance that a leg's scatter makes alone (first) and with all it acts together with (total), "
        f"the {BARS} largest; lines are 95 % intervals."
    )
    return _panels(found, draw, caption, left=0.25 + 0.065 * longest)


def _short(group: str) -> str:
    return ".".join(group.split(".")[-2:])


def _settled(index: float) -> float:
    """An index; one below a thousandth, far below any interval that is seen, is none."""
    return index if abs(index) >= 1e-3 else 0.0


def _index_table(found: Yield) -> Markup:
    rows: list[list[Cell]] = [
        [
            group,
            *(number(_settled(one[word]), 3) for word in ("total", "total_error", "first", "first_error")),
        ]
        for group, one in _ranked(found.indices.get(found.measures[0], {}))
    ]
    head = (Column("scatter of", number=False), Column("total"), Column("±"), Column("first"), Column("±"))
    return table(head, rows, tall=True)


def _scatter(found: Yield) -> Markup:
    known = float_paths(found.robots.scene)
    rows: list[list[Cell]] = []
    for path, axis in {**found.robots.scatter, **found.robots.over}.items():
        unit, (low, high) = known[path].unit, axis.ends
        if high > low:
            kind = "ground" if path in found.robots.over else "scatter"
            rows.append([path, kind, amount(low, unit), amount(high, unit)])
    head = (Column("path", number=False), Column("as", number=False), Column("from"), Column("to"))
    return table(head, rows, tall=True)


def _outcomes(found: Yield) -> Markup:
    rows: list[list[Cell]] = [[str(n), OUTCOMES[name]] for name, n in found.outcomes.items()]
    return table((Column("robots"), Column("outcome", number=False)), rows)
