"""The report of a design: the front, its candidates, why to believe the worst grounds; a click plays one."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from markupsafe import Markup
from matplotlib.axes import Axes

from tarsus.design.adaptive_gait import AdaptiveGait
from tarsus.design.front import Design
from tarsus.design.results import units_of
from tarsus.report.pages import PageFigure, Section, noted, sections_page, write_page
from tarsus.report.panel_grid import name_axes, panel
from tarsus.report.run_page import report_html
from tarsus.report.style import BLUE, GREEN, RULE, VERMILION
from tarsus.solve import simulate
from tarsus.tables.table import Column, Table


def write_gait_report(design: Design, folder: Path, *, play: bool = True) -> list[Path]:
    """Write the page of a front as report.html and, with ``play``, next to it the pages of its gaits, each walking
    on the ground that is worst for it; the paths. Raises InputError if they cannot be written."""
    pages = []
    if play:
        (folder / f"{design.request.noun}s").mkdir(exist_ok=True)
        for name, point in design.named:
            scene = design.scene_of(point, worst=True)
            title = f"{scene.name}, {name}" + (" on the ground that is worst for it" if design.request.over else "")
            run: Any = simulate(scene.model_copy(update={"name": title}))
            pages.append(write_page(report_html(run), folder / f"{design.request.noun}s" / f"{name}.html"))
    return [write_page(gait_html(design, linked=play), folder / "report.html"), *pages]


def gait_html(design: Design, *, linked: bool = False) -> str:
    """The page as text; ``linked``: whether there are pages of the gaits next to it."""
    request, judged = design.request, design.request.over is not None
    objectives, noun = [one.name for one in design.objectives], request.noun
    about = f"{' against '.join(objectives)}; free: {', '.join(request.free.names)}."
    if request.over is not None:
        about += f" Risk of each objective: {request.risk.name}, over {', '.join(request.over.names)}."
    alone = f"One {noun} is best in {' and in '.join(objectives)}: there is nothing to weigh."
    click = f"A click on a {noun} plays it on the ground that is worst for it." if linked and judged else ""
    sections = [
        Section("The front", _front_figure(design, linked) or alone),
        Section(f"{noun.capitalize()}s of the front", click, _part(design, linked, motions=False)),
        Section("What the motions are", MOTIONS, _part(design, linked, motions=True)),
        Section("What one percent costs", PERCENTS, design.percents.table()),
        Section("Grounds", JUDGED, _rounds(design), _grounds(design)) if judged else None,
    ]
    footer = (
        f"All {noun}s are judged on the same grounds. Seed {request.options.seed}. Values of every {noun}: front.csv, "
        f"{noun}s.json, {noun}s/*.toml."
    )
    scene, notes = request.scene.name, noted(design.table())
    return sections_page(f"{noun.capitalize()}s: {scene}", [about, notes], sections, footer)


MOTIONS = (
    "On the own ground, means over starts: shares of the time that a foot is down and that no foot is; heave of the "
    "body, highest minus lowest; how much of a foot's way is sliding; and whether contacts repeat from drive period to "
    "drive period."
)
PERCENTS = (
    "The first of the front, on its own ground: what a percent more of each number adds, as a mean over starts with "
    "its error. The worst is that within a percent to either side."
)
JUDGED = (
    "All are judged by the same starts and grounds, each with an attack of its own whose worst grounds all were put "
    "on. Robust is the first of the front, optimum the best on its own ground of all that were judged."
)


def _front_figure(design: Design, linked: bool) -> PageFigure | None:
    """The front in its first two objectives; nothing of a single gait."""
    if len(design.members) < 2:
        return None
    objectives = " and ".join(one.name for one in design.objectives)
    caption = f"{design.request.noun.capitalize()}s that no other beats in {objectives}."
    return panel(2.6, lambda axes: draw_front(axes, design, linked=linked), caption)


def draw_front(axes: Axes, design: Design, *, linked: bool = False) -> None:
    """Nominal values of a front and those under the risk, the first objective over the second; linked: to pages of the
    candidates."""
    sets = [("the front", "risk", VERMILION)]
    if design.request.over is not None:
        risk = f"the front, {design.request.risk.name}"
        sets = [("the front, on its own ground", "nominal", BLUE), (risk, "risk", VERMILION)]
    pair = [min(j, len(design.objectives) - 1) for j in (1, 0)]
    for label, kind, colour in sets:
        x, y = (np.array([getattr(point, kind)[j] for point in design.members]) for j in pair)
        _scatter(axes, x, y, label, colour, design.request.noun if linked else "")
    name_axes(axes, *((one.name, one.unit) for one in (design.objectives[j] for j in pair)))
    axes.grid(color=RULE, linewidth=0.4)


def _scatter(axes: Axes, x: np.ndarray, y: np.ndarray, label: str, colour: str, noun: str) -> None:
    """Candidates as dots; those with a noun, which have pages, with their numbers and a link each."""
    drawn = axes.scatter(x, y, s=22, color=colour, label=label, zorder=3)
    if noun:
        drawn.set_urls([f"{noun}s/{noun}-{i:02d}.html" for i in range(1, len(x) + 1)])
        for i, place in enumerate(zip(x, y, strict=True), start=1):
            axes.annotate(str(i), place, xytext=(3, 3), textcoords="offset points", fontsize=7)


def _part(design: Design, linked: bool, *, motions: bool) -> Table:
    """Columns of the design's table: what candidates reach and what makes them, or what their motions are."""
    whole, names = design.table(), {one.name for one in design.robust.motion.columns}
    kept = [j for j, one in enumerate(whole.columns) if j and (one.name in names) is motions]
    rows = [(_linked(row[0].split(", "), design.request.noun, linked), *(row[j] for j in kept)) for row in whole.rows]
    return Table("", [whole.columns[j] for j in (0, *kept)], rows)


def _linked(names: Sequence[str], noun: str, linked: bool) -> Markup:
    link = Markup('<a href="{1}s/{0}.html">{0}</a>')
    return Markup(", ").join(link.format(name, noun) if linked else name for name in names)


def _rounds(design: Design) -> Table:
    rows = [(i, one.what, one.grounds, one.gap) for i, one in enumerate(design.rounds)]
    return Table("", ("round", "for", "active grounds", Column("gap found", "%", 2)), rows)


def _grounds(design: Design) -> Table:
    columns = [Column(*one) for one in units_of(design.request.scene, design.grounds.values).items()]
    rows = enumerate(zip(*design.grounds.values.values(), strict=True))
    return Table("", ("ground", *columns), [(i, *row) for i, row in rows])


def adapt_html(design: AdaptiveGait) -> str:
    """The page as text."""
    table, request, scene = design.table(), design.request, design.request.scene.name
    probes = f"probes: {len(design.probes)}, {design.probe_steps} steps each"
    about = (
        f"{request.objectives[0].name} of {scene}; sensed: {' and '.join(one.value for one in design.sense)}; "
        f"{probes if design.probes else 'no probe is worth its steps'}; judged on {len(design.known)} hidden grounds "
        f"over {', '.join(design.grounds.names)}."
    )
    sections = [Section("The gaits", table.bare(), noted(table)), Section("What is lost", _hidden_figure(design))]
    footer = "Probes are sensed in the first steps from a stand. All numbers are in adapt.json, hidden.csv."
    return sections_page(f"Adaptive gait: {scene}", [about], sections, footer)


def _hidden_figure(design: AdaptiveGait) -> PageFigure:
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
