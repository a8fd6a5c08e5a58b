"""The report of a gait design: the front, its gaits, why to believe the worst grounds; a click plays a gait."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from tarsus.base.spec import float_paths
from tarsus.design.adaptive_gait import AdaptiveGait
from tarsus.design.gait_front import GaitFront, GaitPoint
from tarsus.design.judge import CLOSED
from tarsus.design.results import values_in_words
from tarsus.design.walks import WalkObjective
from tarsus.files.store import write_text
from tarsus.report.figures import Plate
from tarsus.report.html import MISSING, Cell, Column, Markup, amount, number, page, table
from tarsus.report.render import rendered
from tarsus.report.run_page import report_html
from tarsus.report.sheet import Sheet, plate
from tarsus.report.style import BLUE, GREEN, MUTED, RULE, VERMILION, Scale, scale_of
from tarsus.solve.simulate import simulate

__all__ = ["adapt_html", "gait_html", "write_adapt_report", "write_gait_report"]


def write_gait_report(design: GaitFront, folder: Path, *, play: bool = True) -> list[Path]:
    """Write the page of a front as report.html and, with ``play``, beside it the pages of its gaits, each walking
    on the ground that is worst for it; the paths. Raises InputError if they cannot be written."""
    pages = []
    if play:
        (folder / "gaits").mkdir(exist_ok=True)
        for name, point in design.named:
            run: Any = simulate(design.scene_of(point, worst=True), design.request.duration)
            target = folder / "gaits" / f"{name}.html"
            write_text(target, report_html(run))
            pages.append(target)
    write_text(folder / "report.html", gait_html(design, linked=play))
    return [folder / "report.html", *pages]


def gait_html(design: GaitFront, *, linked: bool = False) -> str:
    """The page as text; ``linked``: whether there are pages of the gaits beside it."""
    judged = design.request.over is not None
    told = {"optimum": design.optimum, "robust": design.robust, "rounds": _rounds(design),
            "grounds": _grounds(design)} if judged else {}  # fmt: skip
    body = rendered(
        "gait.html", design=design, request=design.request, objectives=design.objectives, judged=judged,
        linked=linked, first=design.objectives[0], front=_front_figure(design, linked), gaits=_gaits(design, linked),
        closed=design.gap <= CLOSED if np.isfinite(design.gap) else None, **told,
    )  # fmt: skip
    return page(f"{design.request.scene.name} – gaits", body)


def _front_figure(design: GaitFront, linked: bool) -> Plate:
    """The front: nominal values and those under the risk, in the first two objectives."""
    judged = design.request.over is not None
    sets = [("the front", design.members, "risk", VERMILION)]
    if judged:
        sets = [
            ("nominal optimum's front, on its own ground", design.nominal, "nominal", MUTED),
            ("the front, on its own ground", design.members, "nominal", BLUE),
            (f"the front, {design.request.risk.name}", design.members, "risk", VERMILION),
        ]
    up, along = (design.objectives[0], design.objectives[min(1, len(design.objectives) - 1)])
    scales = [_scale(one, j, design) for j, one in enumerate((up, along))]

    def draw(sheet: Sheet) -> None:
        (axes,) = sheet.grid(1, 2.6)
        for label, points, kind, colour in sets:
            own = np.array(
                [[getattr(point, kind)[min(j, len(point.risk) - 1)] for j in range(2)] for point in points]
            )
            _scatter(axes, own, scales, label, colour, linked and points is design.members)
        axes.set_xlabel(f"{along.name} ({scales[1].label})".removesuffix(" (1)"))
        axes.set_ylabel(f"{up.name} ({scales[0].label})".removesuffix(" (1)"))
        axes.grid(color=RULE, linewidth=0.4)
        sheet.legend(axes)

    return plate(draw, f"Gaits that no other beats in {' and '.join(one.name for one in design.objectives)}.")


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


def _gaits(design: GaitFront, linked: bool) -> Markup:
    judged = design.request.over is not None
    units = {path: info.unit for path, info in float_paths(design.request.scene).items()}
    columns = [Column("gait", number=False), Column("values", number=False)]
    for one in design.objectives:
        columns.append(Column(f"{one.name}, own ground" if judged else one.name))
        columns += [Column(f"{one.name}, worst found")] if judged and one.grounded else []
    priced = any(one.priced for one in design.objectives)
    columns += [Column("energy with charge recovery")] if priced else []
    rows: list[list[Cell]] = []
    for name, point in design.named:
        title = Markup('<a href="gaits/{0}.html">{0}</a>').format(name) if linked else name
        row: list[Cell] = [title, values_in_words(_few(point), units)]
        for j, one in enumerate(design.objectives):
            row.append(amount(point.nominal[j], one.unit))
            row += [amount(point.worst[j], one.unit)] if judged and one.grounded else []
        row += [amount(point.recovered, "J")] if priced else []
        rows.append(row)
    return table(columns, rows)


def _few(point: GaitPoint, most: int = 8) -> Mapping[str, float]:
    """The first values; all are in front.csv."""
    return dict(list(point.values.items())[:most])


def _rounds(design: GaitFront) -> Markup:
    rows = [
        [str(i), one.what, str(one.grounds), f"{100 * one.gap:.2g} %"] for i, one in enumerate(design.rounds)
    ]
    head = [Column("round"), Column("for", number=False), Column("active grounds"), Column("gap found")]
    return table(head, rows) if rows else Markup()


def _grounds(design: GaitFront) -> Markup:
    units = {path: info.unit for path, info in float_paths(design.request.scene).items()}
    paths = list(design.grounds.values)
    rows = [
        [str(i), *(number(float(design.grounds.values[p][i])) for p in paths)]
        for i in range(len(design.grounds))
    ]
    return table([Column("ground"), *(Column(p, units[p]) for p in paths)], rows, tall=len(rows) > 20)


def write_adapt_report(design: AdaptiveGait, path: Path) -> Path:
    """Write the page of an adaptive gait and return its path. Raises InputError if it cannot be written."""
    write_text(path, adapt_html(design))
    return path


def adapt_html(design: AdaptiveGait) -> str:
    """The page as text."""
    units = {path: info.unit for path, info in float_paths(design.request.scene).items()}
    low, high = design.regret_interval
    lost = [
        ["the table", f"{100 * design.regret:.2g} % ({100 * low:.2g} to {100 * high:.2g} %)"],
        ["the best single gait", f"{100 * design.fixed_regret:.2g} %"],
        ["always the best of these gaits", f"{100 * design.choice_regret:.2g} %"],
    ]  # fmt: skip
    gaits = [[str(i) + (" (probe)" if i in design.probes else ""), values_in_words(own, units) or MISSING]
             for i, own in enumerate(design.gaits)]  # fmt: skip
    body = rendered(
        "adapt.html", design=design, objective=design.request.objectives[0], hidden=_hidden_figure(design),
        rule=table([Column("chosen", number=False), Column("gait")], [[said, str(n)] for said, n in design.rule]),
        gaits=table([Column("gait", number=False), Column("values", number=False)], gaits),
        lost=table([Column("chosen by", number=False), Column("lost against the gait that knows the ground")], lost),
    )  # fmt: skip
    return page(f"{design.request.scene.name} – adaptive gait", body)


def _hidden_figure(design: AdaptiveGait) -> Plate:
    """What is reached on every hidden ground against what is known to be possible there."""
    one = design.request.objectives[0]
    known = one.value(design.known)
    got = one.value(design.costs[np.arange(len(known)), design.chosen])
    scale = scale_of(one.unit, known) if one.unit != "1" else Scale(1.0, "1")
    ends = [0.0, float(max(known.max(), got.max())) / scale.step]

    def draw(sheet: Sheet) -> None:
        (axes,) = sheet.grid(1, 2.5)
        axes.plot(ends, ends, color=GREEN, label="nothing lost")
        axes.scatter(known / scale.step, got / scale.step, s=9, color=BLUE, label="hidden ground", zorder=3)
        axes.set_xlabel(f"{one.name} of the gait that knows the ground ({scale.label})".removesuffix(" (1)"))
        axes.set_ylabel(f"reached ({scale.label})".removesuffix(" (1)"))
        sheet.legend(axes)

    return plate(
        draw, f"{one.name.capitalize()} on the hidden grounds, over that of the gait that knows the ground."
    )
