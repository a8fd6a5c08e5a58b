"""The report of a yield: distributions, what share of the robots meets a requirement, dead legs, and whose scatter
matters."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import count
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from tarsus.files.store import package_version, write_text
from tarsus.report.figures import Plate
from tarsus.report.html import MISSING, Cell, Column, amount, escape, figure, number, page, table
from tarsus.report.style import (
    BLUE,
    MUTED,
    ORANGE,
    WIDTH_IN,
    Scale,
    few_ticks,
    figure_style,
    scale_of,
    to_svg,
)
from tarsus.study.workunit import OUTCOMES
from tarsus.study.yields import Yield

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
    numbers, scene = count(1), found.robots.scene
    parts = [
        f"<h1>Yield: {escape(scene.name)}</h1>\n",
        f'<p class="lede">{escape(_lede(found))}</p>\n',
        "<h2>What comes out of the workshop</h2>\n",
    ]
    with figure_style():
        parts.append(figure(_distributions(found), next(numbers)))
        parts += [
            "<h2>Yield against requirement</h2>\n",
            figure(_curves(found), next(numbers)),
            _quantiles(found),
        ]
        if len(found.by_dead) > 1:
            parts += [
                "<h2>Dead legs</h2>\n",
                figure(_dead(found), next(numbers)),
                _dead_table(found),
                _costs(found),
            ]
        if any(found.indices.values()):
            parts += [
                "<h2>Whose scatter matters</h2>\n",
                figure(_indices(found), next(numbers)),
                _index_table(found),
            ]
    parts += [
        "<h2>What was scattered</h2>\n",
        _scatter(found),
        "<h2>How the runs ended</h2>\n",
        _outcomes(found),
    ]
    parts.append(f"<p>Tarsus {escape(package_version())}.</p>\n")
    return page(f"{scene.name} – yield", "".join(parts))


def _lede(found: Yield) -> str:
    first = found.measures[0]
    values = found.values[first][np.isfinite(found.values[first])]
    low, middle, high = np.quantile(values, (0.05, 0.5, 0.95))
    unit = found.units[first]
    ends = " to ".join(f"{one / _scale(unit, values).step:.4g}" for one in (low, high))
    told = (
        f"{len(found.lost)} robots: {_words(first)} from {ends} {_scale(unit, values).label} in nine of ten, "
        f"median {middle / _scale(unit, values).step:.4g}."
    )
    leader = found.leaders.get(first)
    if leader is not None:
        said = leader.sentence(_words(first))
        told += f" {said[0].upper()}{said[1:]}."
    return told


def _words(name: str) -> str:
    return name.replace("_", " ")


def _ranked(indices: Mapping[str, Mapping[str, float]]) -> list[tuple[str, Mapping[str, float]]]:
    return sorted(indices.items(), key=lambda one: -one[1]["total"])


def _scale(unit: str, values: np.ndarray) -> Scale:
    """As `scale_of`; numbers without a unit have no prefix."""
    return Scale(1.0, unit) if unit == "1" else scale_of(unit, values)


def _panels(found: Yield, height: float = 2.6) -> tuple[Figure, list]:
    """One panel for each measure, two in a row."""
    rows = -(-len(found.measures) // 2)
    drawn = Figure(figsize=(WIDTH_IN, height * rows))
    panels = np.atleast_1d(drawn.subplots(rows, min(2, len(found.measures)))).ravel().tolist()
    drawn.subplots_adjust(
        left=0.09, right=0.985, bottom=0.18 / rows, top=1.0 - 0.04 / rows, wspace=0.28, hspace=0.35
    )
    for panel in panels[len(found.measures) :]:
        panel.set_visible(False)
    return drawn, panels


def _distributions(found: Yield) -> Plate:
    drawn, panels = _panels(found)
    for axes, name in zip(panels, found.measures, strict=False):
        values = found.values[name][np.isfinite(found.values[name])]
        scale = _scale(found.units[name], values)
        axes.hist(values / scale.step, bins=40, color=BLUE)
        axes.set_xlabel(f"{_words(name)} ({scale.label})".replace(" (1)", ""))
        axes.set_ylabel("robots")
        few_ticks(axes)
    caption = "How the measures are distributed over the robots whose runs reached their end."
    return Plate(to_svg(drawn, caption), caption)


def _curves(found: Yield) -> Plate:
    drawn, panels = _panels(found)
    for axes, name in zip(panels, found.measures, strict=False):
        curve = found.curves[name]
        scale = _scale(curve.unit, curve.requirement)
        at = curve.requirement / scale.step
        axes.fill_between(at, 100.0 * curve.low, 100.0 * curve.high, color=BLUE, alpha=0.25, lw=0.0)
        axes.plot(at, 100.0 * curve.share, color=BLUE, lw=1.2)
        word = "at most" if curve.less else "at least"
        axes.set_xlabel(f"{_words(name)} {word} ({scale.label})".replace(" (1)", ""))
        axes.set_ylabel("robots that meet it (%)")
        axes.set_ylim(0.0, 101.0)
        few_ticks(axes)
    caption = (
        "Share of the robots that meet a requirement, with its 95 % interval; a run that failed meets none."
    )
    return Plate(to_svg(drawn, caption), caption)


def _quantiles(found: Yield) -> str:
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
    drawn, panels = _panels(found)
    for axes, name in zip(panels, found.measures, strict=False):
        groups = [(one["dead"], one[name]) for one in found.by_dead if one[name] is not None]
        if not groups:
            continue
        at, rows = np.array([one for one, _ in groups]), np.array([row for _, row in groups])
        scale = _scale(found.units[name], rows)
        rows = rows / scale.step
        axes.errorbar(at, rows[:, 1], yerr=[rows[:, 1] - rows[:, 0], rows[:, 2] - rows[:, 1]], fmt="o", ms=4.0,
                      color=BLUE, ecolor=MUTED, lw=1.0)  # fmt: skip
        axes.set_xlabel("dead legs")
        axes.set_ylabel(f"{_words(name)} ({scale.label})".replace(" (1)", ""))
        axes.set_xticks(at)
    caption = "Median, and the range of nine robots in ten, by the number of dead legs."
    return Plate(to_svg(drawn, caption), caption)


def _dead_table(found: Yield) -> str:
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


def _costs(found: Yield) -> str:
    """What each leg's death costs on average."""
    first = found.measures[0]
    known = [(leg, *one) for leg, one in found.cost.items() if np.isfinite(one[0])]
    if not known:
        return ""
    known.sort(key=lambda one: one[1], reverse=first in {n for n in found.measures if found.curves[n].less})
    rows: list[list[Cell]] = [
        [leg, amount(cost, found.units[first]), amount(error, found.units[first])]
        for leg, cost, error in known
    ]
    told = f"<p>Mean {escape(_words(first))} with a leg dead, minus that with it alive, worst first.</p>\n"
    return told + table(
        (Column("leg", number=False), Column("difference"), Column("standard error")), rows, tall=True
    )


def _indices(found: Yield) -> Plate:
    drawn, panels = _panels(found, 3.0)
    drawn.subplots_adjust(left=0.2, wspace=0.6)  # names of grounds are long
    for axes, name in zip(panels, found.measures, strict=False):
        ranked = _ranked(found.indices.get(name, {}))[:BARS]
        at = np.arange(len(ranked))
        for offset, word, color in ((-0.2, "total", BLUE), (0.2, "first", ORANGE)):
            lines = {
                "xerr": [one[f"{word}_error"] for _, one in ranked],
                "error_kw": {"ecolor": MUTED, "lw": 0.8},
            }
            axes.barh(at + offset, [one[word] for _, one in ranked], 0.38, color=color, label=word, **lines)
        axes.set_yticks(at, [_short(group) for group, _ in ranked])
        axes.invert_yaxis()
        axes.set_xlabel(f"Sobol index of {_words(name)}")
    panels[0].legend(loc="lower right")
    caption = (
        f"Share of the variance that a leg's scatter makes alone (first) and with all it acts together with (total), "
        f"the {BARS} largest; lines are 95 % intervals."
    )
    return Plate(to_svg(drawn, caption), caption)


def _short(group: str) -> str:
    return ".".join(group.split(".")[-2:])


def _settled(index: float) -> float:
    """An index; one below a thousandth, far below any interval that is seen, is none."""
    return index if abs(index) >= 1e-3 else 0.0


def _index_table(found: Yield) -> str:
    first = found.measures[0]
    rows: list[list[Cell]] = [
        [
            group,
            *(number(_settled(one[word]), 3) for word in ("total", "total_error", "first", "first_error")),
        ]
        for group, one in _ranked(found.indices.get(first, {}))
    ]
    told = f"<p>Indices of {escape(_words(first))}; ± is the half-width of the 95 % interval.</p>\n"
    head = (Column("scatter of", number=False), Column("total"), Column("±"), Column("first"), Column("±"))
    return told + table(head, rows, tall=True)


def _scatter(found: Yield) -> str:
    from tarsus.base.spec import float_paths

    known = float_paths(found.robots.scene)
    rows: list[list[Cell]] = []
    for path, axis in {**found.robots.scatter, **found.robots.over}.items():
        unit, (low, high) = known[path].unit, axis.ends
        if high > low:
            rows.append(
                [
                    path,
                    "ground" if path in found.robots.over else "scatter",
                    amount(low, unit),
                    amount(high, unit),
                ]
            )
    head = (Column("path", number=False), Column("as", number=False), Column("from"), Column("to"))
    return table(head, rows, tall=True)


def _outcomes(found: Yield) -> str:
    rows: Sequence[Sequence[Cell]] = [[str(n), OUTCOMES[name]] for name, n in found.outcomes.items()]
    return table((Column("robots"), Column("outcome", number=False)), rows)
