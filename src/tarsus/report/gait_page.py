"""The report of a gait design: the front, its gaits, why to believe the worst grounds; a click plays a gait."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import count
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from tarsus.base.spec import float_paths
from tarsus.design.adaptive import AdaptiveGait
from tarsus.design.gait_files import gait_scene_names, values_in_words
from tarsus.design.gait_fronts import CLOSED, GaitFront, GaitPoint
from tarsus.design.walk_objectives import WalkObjective
from tarsus.files.store import package_version, write_text
from tarsus.report.figures import Plate
from tarsus.report.html import MISSING, Cell, Column, Markup, amount, escape, figure, number, page, table
from tarsus.report.run_page import report_html
from tarsus.report.style import (
    BLUE,
    GREEN,
    MUTED,
    RULE,
    VERMILION,
    Scale,
    figure_style,
    scale_of,
    stack,
    to_svg,
)
from tarsus.solve.simulate import simulate

__all__ = ["adapt_html", "gait_html", "write_adapt_report", "write_gait_report"]


def write_gait_report(design: GaitFront, folder: Path, *, play: bool = True) -> list[Path]:
    """Write the page of a front as report.html and, with ``play``, beside it the pages of its gaits, each walking
    on the ground that is worst for it; the paths. Raises InputError if they cannot be written."""
    pages = []
    if play:
        (folder / "gaits").mkdir(exist_ok=True)
        for name, point in gait_scene_names(design):
            run: Any = simulate(design.scene_of(point, worst=True), design.request.duration)
            target = folder / "gaits" / f"{name}.html"
            write_text(target, report_html(run))
            pages.append(target)
    write_text(folder / "report.html", gait_html(design, linked=play))
    return [folder / "report.html", *pages]


def gait_html(design: GaitFront, *, linked: bool = False) -> str:
    """The page as text; ``linked``: whether there are pages of the gaits beside it."""
    request, numbers = design.request, count(1)
    judged = request.over is not None
    with figure_style():
        parts = [
            f"<h1>Gaits: {escape(request.scene.name)}</h1>\n", f'<p class="lede">{escape(_lede(design))}</p>\n',
            figure(_front_figure(design, linked), next(numbers)),
            "<h2>Gaits of the front</h2>\n",
            '<p class="lede">A click on a gait plays it on the ground that is worst for it.</p>\n' if linked and
            judged else "", _gaits(design, linked),
        ]  # fmt: skip
    if judged:
        parts += ["<h2>Grounds</h2>\n", _believed(design), _rounds(design), _grounds(design)]
    parts.append(_footer(design))
    return page(f"{request.scene.name} – gaits", "".join(parts))


def _lede(design: GaitFront) -> str:
    names = " against ".join(one.name for one in design.objectives)
    free = ", ".join(design.request.unknowns.names)
    told = (
        f"{names}; free: {free}; {design.candidates} gaits tried in {design.runs} walks of "
        f"{design.request.duration:g} s."
    )
    if design.request.over is None:
        return told
    return f"{told} Risk of each objective: {design.request.risk.name}, over {', '.join(design.request.over.paths)}."


def _front_figure(design: GaitFront, linked: bool) -> Plate:
    """The front: nominal values and those under the risk, in the first two objectives."""
    objectives = design.objectives[:2]
    drawn, (axes,) = stack([3.0], legend_rows=1)
    judged = design.request.over is not None
    sets = (
        [("nominal optimum's front, on its own ground", design.nominal, "nominal", MUTED)] if judged else []
    )
    if judged:
        sets.append(("the front, on its own ground", design.members, "nominal", BLUE))
    sets.append(
        (
            f"the front, {design.request.risk.name}" if judged else "the front",
            design.members,
            "risk",
            VERMILION,
        )
    )
    if len(objectives) == 1:
        objectives = (objectives[0], objectives[0])
    scales = [_scale(one, j, design) for j, one in enumerate(objectives)]
    for label, points, kind, colour in sets:
        own = np.array(
            [[getattr(point, kind)[min(j, len(point.risk) - 1)] for j in range(2)] for point in points]
        )
        _scatter(axes, own, scales, label, colour, linked and points is design.members)
    for axis, one, scale in (
        (axes.set_xlabel, objectives[1], scales[1]),
        (axes.set_ylabel, objectives[0], scales[0]),
    ):
        axis(f"{one.name} ({scale.label})" if scale.label not in ("1", "") else one.name)
    axes.grid(color=RULE, linewidth=0.4)
    axes.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=3, borderaxespad=0.2)
    words = f"Gaits that no other beats in {' and '.join(one.name for one in design.objectives)}."
    return Plate(to_svg(drawn, "the front"), words)


def _scatter(
    axes: Axes, points: np.ndarray, scales: Sequence[Scale], label: str, colour: str, linked: bool
) -> None:
    x, y = points[:, 1] / scales[1].step, points[:, 0] / scales[0].step
    drawn = axes.scatter(x, y, s=22, color=colour, label=label, zorder=3)
    if linked:
        drawn.set_urls([f"gaits/gait-{i:02d}.html" for i in range(1, len(x) + 1)])
        for i, (left, up) in enumerate(zip(x, y, strict=True), start=1):
            axes.annotate(str(i), (left, up), xytext=(3, 3), textcoords="offset points", fontsize=7)


def _scale(one: WalkObjective, j: int, design: GaitFront) -> Scale:
    if one.unit == "1":
        return Scale(1.0, "1")
    values = [point.nominal[min(j, len(point.nominal) - 1)] for point in (*design.members, *design.nominal)]
    return scale_of(one.unit, np.array(values))


def _gaits(design: GaitFront, linked: bool) -> str:
    judged = design.request.over is not None
    units = {path: info.unit for path, info in float_paths(design.request.scene).items()}
    columns = [Column("gait", number=False), Column("values", number=False)]
    for one in design.objectives:
        columns.append(Column(f"{one.name}, own ground" if judged else one.name))
        columns += [Column(f"{one.name}, worst found")] if judged and one.grounded else []
    priced = any(one.priced for one in design.objectives)
    columns += [Column("energy with charge recovery")] if priced else []
    rows: list[list[Cell]] = []
    for name, point in gait_scene_names(design):
        title = f'<a href="gaits/{name}.html">{name}</a>' if linked else escape(name)
        row: list[Cell] = [Markup(title), values_in_words(_few(point), units)]
        for j, one in enumerate(design.objectives):
            row.append(amount(point.nominal[j], one.unit))
            row += [amount(point.worst[j], one.unit)] if judged and one.grounded else []
        row += [amount(point.recovered, "J")] if priced else []
        rows.append(row)
    return table(columns, rows, wrap=True)


def _few(point: GaitPoint, most: int = 8) -> Mapping[str, float]:
    """The first values; all are in front.csv."""
    return dict(list(point.values.items())[:most])


def _believed(design: GaitFront) -> str:
    one, loss = design.objectives[0], design.request.options.loss
    best, own = design.optimum, design.robust
    said = (
        f"On its own ground the nominal optimum has a {one.name} of {amount(best.nominal[0], one.unit)}, on the "
        f"worst found {amount(best.worst[0], one.unit)}; the robust gait, of those that lose at most "
        f"{100 * loss:g} % on their own ground, {amount(own.nominal[0], one.unit)} and "
        f"{amount(own.worst[0], one.unit)}."
    )
    parts = [f'<p class="verdict">{escape(said)}</p>\n']
    if np.isfinite(design.gap):
        closed = design.gap <= CLOSED
        text = (
            f"The last attack found no gait of the front worse by more than {100 * design.gap:.2g} % than on the "
            f"{len(design.grounds)} grounds that it was judged on."
        )
        parts.append(f'<p class="verdict{"" if closed else " failed"}">{escape(text)}</p>\n')
    return "".join(parts)


def _rounds(design: GaitFront) -> str:
    rows = [
        [str(i), one.what, str(one.grounds), f"{100 * one.gap:.2g} %"] for i, one in enumerate(design.rounds)
    ]
    return (
        table(
            [Column("round"), Column("for", number=False), Column("active grounds"), Column("gap found")],
            rows,
        )
        if rows
        else ""
    )


def _grounds(design: GaitFront) -> str:
    units = {path: info.unit for path, info in float_paths(design.request.scene).items()}
    paths = list(design.grounds.values)
    rows = [
        [str(i), *(number(float(design.grounds.values[p][i])) for p in paths)]
        for i in range(len(design.grounds))
    ]
    return table([Column("ground"), *(Column(p, units[p]) for p in paths)], rows, tall=len(rows) > 20)


def _footer(design: GaitFront) -> str:
    return (
        f"<footer><p>All gaits are judged on the same grounds. Seed {design.request.options.seed}; Tarsus "
        f"{escape(package_version())}. Values of every gait: front.csv, gaits.json, gaits/*.toml.</p></footer>\n"
    )


def write_adapt_report(design: AdaptiveGait, path: Path) -> Path:
    """Write the page of an adaptive gait and return its path. Raises InputError if it cannot be written."""
    write_text(path, adapt_html(design))
    return path


def adapt_html(design: AdaptiveGait) -> str:
    """The page as text."""
    units = {path: info.unit for path, info in float_paths(design.request.scene).items()}
    one = design.request.objectives[0]
    words = " and ".join(sense.value for sense in design.sense)
    count = len(design.probes)
    told = f"probes: {count}, {design.probe_steps} steps each" if count else "no probe is worth its steps"
    lede = (
        f"{one.name} of {design.request.scene.name}; sensed: {words}; {told}; "
        f"judged on {len(design.known)} hidden grounds over {', '.join(design.grounds)}."
    )
    low, high = design.regret_interval
    lost = [
        ["the table", f"{100 * design.regret:.2g} % ({100 * low:.2g} to {100 * high:.2g} %)"],
        ["the best single gait", f"{100 * design.fixed_regret:.2g} %"],
        ["always the best of these gaits", f"{100 * design.choice_regret:.2g} %"],
    ]  # fmt: skip
    gaits = [[str(i) + (" (probe)" if i in design.probes else ""), values_in_words(own, units) or MISSING]
             for i, own in enumerate(design.gaits)]  # fmt: skip
    with figure_style():
        drawn = figure(_hidden_figure(design), 1)
    parts = [
        f"<h1>Adaptive gait: {escape(design.request.scene.name)}</h1>\n", f'<p class="lede">{escape(lede)}</p>\n',
        "<h2>The choice</h2>\n",
        table([Column("chosen", number=False), Column("gait")], [[said, str(gait)] for said, gait in design.table]),
        "<h2>The gaits</h2>\n", table([Column("gait", number=False), Column("values", number=False)], gaits),
        "<h2>What is lost</h2>\n",
        table([Column("chosen by", number=False), Column("lost against the gait that knows the ground")], lost),
        drawn,
    ]  # fmt: skip
    return page(f"{design.request.scene.name} – adaptive gait", "".join(parts))


def _hidden_figure(design: AdaptiveGait) -> Plate:
    """What is reached on every hidden ground against what is known to be possible there."""
    one = design.request.objectives[0]
    known = one.value(design.known)
    got = one.value(design.costs[np.arange(len(known)), design.chosen])
    scale = scale_of(one.unit, known) if one.unit != "1" else Scale(1.0, "1")
    drawn, (axes,) = stack([2.8], legend_rows=1)
    ends = [0.0, float(max(known.max(), got.max())) / scale.step]
    axes.plot(ends, ends, color=GREEN, label="nothing lost")
    axes.scatter(known / scale.step, got / scale.step, s=9, color=BLUE, label="hidden ground", zorder=3)
    axes.set_xlabel(f"{one.name} of the gait that knows the ground ({scale.label})")
    axes.set_ylabel(f"reached ({scale.label})")
    axes.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=2, borderaxespad=0.2)
    return Plate(to_svg(drawn, "hidden grounds"), f"{one.name.capitalize()} on the hidden grounds.")
