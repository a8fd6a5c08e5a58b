"""The report of a design: the front, its candidates, why to believe the worst grounds; a click plays one."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from markupsafe import Markup
from matplotlib.axes import Axes

from tarsus.base.spec import float_paths
from tarsus.design.adaptive_gait import AdaptiveGait
from tarsus.design.front import Design
from tarsus.design.judge import CLOSED
from tarsus.design.results import units_of, values_in_words
from tarsus.report.pages import Plate, Section, said, sections_page, write_page
from tarsus.report.run_page import report_html
from tarsus.report.sheet import name_axes, panel
from tarsus.report.style import BLUE, GREEN, RULE, VERMILION
from tarsus.solve import simulate
from tarsus.tables.numbers import amount, number
from tarsus.tables.table import Column, Table

MOST_VALUES = 8
"""Values of a gait in its row, two lines of it: all are in front.csv."""


def write_gait_report(design: Design, folder: Path, *, play: bool = True) -> list[Path]:
    """Write the page of a front as report.html and, with ``play``, beside it the pages of its gaits, each walking
    on the ground that is worst for it; the paths. Raises InputError if they cannot be written."""
    pages = []
    if play:
        (folder / f"{design.request.noun}s").mkdir(exist_ok=True)
        for name, point in design.named:
            run: Any = simulate(design.scene_of(point, worst=True))
            pages.append(write_page(report_html(run), folder / f"{design.request.noun}s" / f"{name}.html"))
    return [write_page(gait_html(design, linked=play), folder / "report.html"), *pages]


def gait_html(design: Design, *, linked: bool = False) -> str:
    """The page as text; ``linked``: whether there are pages of the gaits beside it."""
    request, judged = design.request, design.request.over is not None
    objectives, noun = [one.name for one in design.objectives], request.noun
    about = [
        f"{' against '.join(objectives)}; free: {', '.join(request.free.names)}; {design.candidates} tried in "
        f"{design.runs} runs; {request.motion}."
    ]
    if request.over is not None:
        about[0] += f" Risk of each objective: {request.risk.name}, over {', '.join(request.over.names)}."
    alone = f"One {noun} is best in {' and in '.join(objectives)}: there is nothing to weigh."
    click = f"A click on a {noun} plays it on the ground that is worst for it." if linked and judged else ""
    sections = [
        Section("The front", _front_figure(design, linked) or alone),
        Section(f"{noun.capitalize()}s of the front", click, _gaits(design, linked)),
        Section("What the motions are", MOTIONS, _motions(design, linked), *map(said, design.remarks)),
        Section("What one percent costs", _percents(design), design.percents.table()),
        Section("Grounds", *_judged(design), _rounds(design), _grounds(design)) if judged else None,
    ]
    footer = (
        f"All {noun}s are judged on the same grounds. Seed {request.options.seed}. Values of every {noun}: front.csv, "
        f"{noun}s.json, {noun}s/*.toml."
    )
    scene = request.scene.name
    return sections_page(
        f"{noun.capitalize()}s: {scene}", [*about, _lasting(design)], sections, footer, head=f"{scene} – {noun}s"
    )


MOTIONS = (
    "On the own ground, means over starts: shares of the time that a foot is down and that no foot is; heave of the "
    "body, highest minus lowest; how much of a foot's way is sliding; and whether contacts repeat from drive period to "
    "drive period."
)


def _lasting(design: Design) -> str:
    """Of which motion the numbers are."""
    request = design.request
    if request.starts is None:
        return said(
            f"All values, worst cases and shares below are {request.motion}: of an episode from one start, not of "
            "settled motion. A longer run, or another start, may give other values."
        )
    return (
        f"All numbers are of the {request.motion}, whose first third is left out: on the own ground the mean of starts "
        "that it was not chosen by, on other grounds the worst of grounds and starts. "
        f"{design.spread_of}."
    )


def _percents(design: Design) -> str:
    """What the table of percents is."""
    percents = design.percents
    return (
        "The first of the front, on its own ground: what a percent more of each number adds to its "
        f"{percents.measure}, as a mean over starts with its error. The worst is that within a percent to "
        "either side. With all of them off at once by up to a percent the worst is "
        f"{amount(percents.box, percents.unit, 3)}."
    )


def _judged(design: Design) -> list[str]:
    """By what the gaits were judged, and what was found against them."""
    told: list[str] = [
        "All are judged alike: by the same starts, on the same grounds, each with an attack of its own whose "
        "worst grounds all were put on. The front is of the worst that was found; robust is its first, optimum "
        "the one of all that were judged that is best on its own ground."
    ]
    if design.verdict:
        told.append(said(design.verdict))
    if np.isfinite(design.gap):
        told.append(
            said(
                f"The last attack found none worse by more than {number(100 * design.gap, 2)} % than on the "
                f"{len(design.grounds)} grounds and starts that it was judged on",
                failed=design.gap > CLOSED,
            )
        )
    if (drawn := design.certificate) is not None:
        told.append(
            f"Every one shown was put on {drawn.grounds} grounds and starts drawn by chance. At most {drawn.worse} of "
            "them were more than 2 % worse for it than all that was known before: with 95 % confidence no more than "
            f"{number(100 * drawn.share, 2)} % of the box are."
        )
    return told


def _front_figure(design: Design, linked: bool) -> Plate | None:
    """The front: nominal values and those under the risk, in the first two objectives; nothing of a single gait."""
    sets = [("the front", design.members, "risk", VERMILION)]
    if design.request.over is not None:
        sets = [
            ("the front, on its own ground", design.members, "nominal", BLUE),
            (f"the front, {design.request.risk.name}", design.members, "risk", VERMILION),
        ]
    if all(len(points) < 2 for _, points, _, _ in sets):
        return None
    pair, noun = [min(j, len(design.objectives) - 1) for j in (1, 0)], design.request.noun
    shown = [design.objectives[j] for j in pair]

    def draw(axes: Axes) -> None:
        for label, points, kind, colour in sets:
            x, y = (np.array([getattr(point, kind)[j] for point in points]) for j in pair)
            _scatter(axes, x, y, label, colour, noun if linked and points is design.members else "")
        name_axes(axes, *((one.name, one.unit) for one in shown))
        axes.grid(color=RULE, linewidth=0.4)

    objectives = " and ".join(one.name for one in design.objectives)
    return panel(2.6, draw, f"{noun.capitalize()}s that no other beats in {objectives}.")


def _scatter(axes: Axes, x: np.ndarray, y: np.ndarray, label: str, colour: str, noun: str) -> None:
    """Candidates as dots; those with a noun, which have pages, with their numbers and a link each."""
    drawn = axes.scatter(x, y, s=22, color=colour, label=label, zorder=3)
    if noun:
        drawn.set_urls([f"{noun}s/{noun}-{i:02d}.html" for i in range(1, len(x) + 1)])
        for i, place in enumerate(zip(x, y, strict=True), start=1):
            axes.annotate(str(i), place, xytext=(3, 3), textcoords="offset points", fontsize=7)


def _gaits(design: Design, linked: bool) -> Table:
    judged = design.request.over is not None
    units = {path: info.unit for path, info in float_paths(design.request.scene).items()}
    columns: list[Column | str] = [design.request.noun, "values"]
    for one in design.objectives:
        columns.append(Column(f"{one.name}, own ground" if judged else one.name, one.unit))
        columns += [Column(f"{one.name}, worst found", one.unit)] if judged and one.grounded else []
        columns += [Column(f"{one.name}, 95 %", one.unit, 3)] if one.grounded else []
    priced = any(one.priced for one in design.objectives)
    columns += [Column("energy with charge recovery", "J")] if priced else []
    rows = []
    for names, point in design.once:
        row: list[Any] = [
            _linked(names, design.request.noun, linked),
            values_in_words(dict(list(point.values.items())[:MOST_VALUES]), units),
        ]
        for j, one in enumerate(design.objectives):
            row += [point.nominal[j], point.worst[j]] if judged and one.grounded else [point.nominal[j]]
            row += [point.intervals[j]] if one.grounded else []
        rows.append([*row, point.recovered] if priced else row)
    return Table("", columns, rows)


def _linked(names: Sequence[str], noun: str, linked: bool) -> Markup:
    link = Markup('<a href="{1}s/{0}.html">{0}</a>')
    return Markup(", ").join(link.format(name, noun) if linked else name for name in names)


def _motions(design: Design, linked: bool) -> Table:
    rows = [(_linked(names, design.request.noun, linked), *point.motion.row) for names, point in design.once]
    return Table("", [design.request.noun, *design.robust.motion.columns], rows)


def _rounds(design: Design) -> Table:
    rows = [(i, one.what, one.grounds, one.gap) for i, one in enumerate(design.rounds)]
    return Table("", ("round", "for", "active grounds", Column("gap found", "%", 2)), rows)


def _grounds(design: Design) -> Table:
    columns = [Column(*one) for one in units_of(design.request.scene, design.grounds.values).items()]
    rows = enumerate(zip(*design.grounds.values.values(), strict=True))
    return Table("", ("ground", *columns), [(i, *row) for i, row in rows])


def adapt_html(design: AdaptiveGait) -> str:
    """The page as text."""
    units = {path: info.unit for path, info in float_paths(design.request.scene).items()}
    lost = [
        ("the table", design.regret, tuple(design.regret_interval)),
        ("the best single gait", design.fixed_regret, None),
        ("always the best of these gaits", design.choice_regret, None),
    ]
    gaits = [
        (f"{i} (probe)" if i in design.probes else str(i), values_in_words(own, units) or None)
        for i, own in enumerate(design.gaits)
    ]
    against = "lost against the gait that knows the ground"
    request, scene = design.request, design.request.scene.name
    sections = [
        Section("The choice", Table("", ("chosen", "gait"), [(words, str(n)) for words, n in design.rule])),
        Section("The gaits", Table("", ("gait", "values"), gaits)),
        Section(
            "What is lost",
            Table("", ("chosen by", Column(against, "%", 2), Column("95 % interval", "%", 2)), lost),
            _hidden_figure(design),
        ),
    ]
    probes = f"probes: {len(design.probes)}, {design.probe_steps} steps each"
    about = (
        f"{request.objectives[0].name} of {scene}; sensed: {' and '.join(one.value for one in design.sense)}; "
        f"{probes if design.probes else 'no probe is worth its steps'}; judged on {len(design.known)} hidden grounds "
        f"over {', '.join(design.grounds.names)}."
    )
    episode = ": an episode from one start, not the settled motion" if request.starts is None else ""
    judged = f"Gaits are judged by {request.motion}{episode}. Probes are sensed in the first steps from a stand."
    footer = "All numbers are in adapt.json, the hidden grounds in hidden.csv."
    return sections_page(
        f"Adaptive gait: {scene}", [about, said(judged)], sections, footer, head=f"{scene} – adaptive gait"
    )


def _hidden_figure(design: AdaptiveGait) -> Plate:
    """What is reached on every hidden ground against what is known to be possible there."""
    one = design.request.objectives[0]
    known = one.value(design.known)
    got = one.value(design.costs[np.arange(len(known)), design.chosen])
    ends = [0.0, float(max(known.max(), got.max()))]

    def draw(axes: Axes) -> None:
        axes.plot(ends, ends, color=GREEN, label="nothing lost")
        axes.scatter(known, got, s=9, color=BLUE, label="hidden ground", zorder=3)
        name_axes(axes, (f"{one.name} of the gait that knows the ground", one.unit), ("reached", one.unit))

    return panel(
        2.5, draw, f"{one.name.capitalize()} on the hidden grounds, over that of the gait that knows the ground."
    )
