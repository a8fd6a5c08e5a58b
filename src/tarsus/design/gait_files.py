"""Gait designs as data, as tables, and as files: the front, its gaits as scenes, the table that a robot carries."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from tarsus.design.headers import gait_header_text
from tarsus.design.results import csv_text, units_of, write_texts
from tarsus.files.jsontext import json_text
from tarsus.files.store import package_version
from tarsus.files.toml import scene_text
from tarsus.tables.numbers import amount, interval, percent
from tarsus.tables.table import Column, Table

if TYPE_CHECKING:
    from tarsus.design.adaptive import AdaptiveGait
    from tarsus.design.gait_fronts import GaitFront, GaitPoint

__all__ = [
    "ADAPT_FILES", "FRONT_FILES", "adapt_data", "adapt_line", "adapt_table", "gait_data", "gait_line",
    "gait_scene_names", "gait_table", "write_adapt", "write_front",
]  # fmt: skip

FRONT_FILES = ("gaits.json", "front.csv", "gait.h", "report.html", "gaits/*.toml", "gaits/*.html")
"""Names of everything that `tarsus design gait` writes at its end."""
ADAPT_FILES = ("adapt.json", "hidden.csv", "report.html")
"""Names of everything that `tarsus design adapt` writes."""
TICK, TICKS = 1e-6, 1000
"""Tick of the timer of `gait.h` [s], and the least number of them in a period: shorter ones where the gait is fast."""
SHOWN = 4
"""Numbers of a gait in a table; all are in the files."""


def gait_data(design: GaitFront) -> dict[str, Any]:
    """A design as plain data, SI units; NaN where there is none.

    objectives: name, unit, whether the most is best; front, nominal_front: gaits, each with ``values`` by path and,
    by objective, ``nominal``, ``risk`` and ``worst``; robust, optimum: the two gaits that are compared, and gain:
    worst value of the first over that of the second; gap: what is left open about the worst grounds; certificate:
    grounds drawn by chance at the end, those more than 2 % worse than known, and the box's share that may be so.
    """
    request, looked = design.request, design.certificate
    proof = (
        None if looked is None else {"grounds": looked.grounds, "worse": looked.worse, "share": looked.share}
    )
    return {
        "certificate": proof, "scene": request.scene.name, "risk": request.risk.name,
        "free": list(request.unknowns.names),
        "objectives": [{"name": one.name, "unit": one.unit, "most": one.most} for one in design.objectives],
        "front": [_point(design, one) for one in design.members],
        "nominal_front": [_point(design, one) for one in design.nominal],
        "robust": _point(design, design.robust), "optimum": _point(design, design.optimum), "gain": design.gain,
        "over": [] if request.over is None else list(request.over.names),
        "grounds": [
            {path: float(own[i]) for path, own in design.grounds.values.items()} for i in range(len(design.grounds))
        ],
        "gap": design.gap, "rounds": [{"what": one.what, "grounds": one.grounds, "gap": one.gap} for one in
        design.rounds], "candidates": design.candidates, "runs": design.runs, "reused": design.reused, "duration":
        request.duration, "version": package_version(),
    }  # fmt: skip


def _point(design: GaitFront, point: GaitPoint) -> dict[str, Any]:
    names = [one.name for one in design.objectives]
    named = {key: dict(zip(names, getattr(point, key), strict=True)) for key in ("nominal", "risk", "worst")}
    return {
        "values": dict(point.values), **named, "worst_ground": dict(point.worst_ground), "energy": point.energy,
        "energy_recovered": point.recovered,
    }  # fmt: skip


def gait_scene_names(design: GaitFront) -> list[tuple[str, GaitPoint]]:
    """File names, without ending, of the gaits that get files of their own."""
    members = [(f"gait-{number:02d}", point) for number, point in enumerate(design.members, start=1)]
    return [*members, ("robust", design.robust), ("optimum", design.optimum)]


def gait_line(design: GaitFront) -> str:
    """A front of gaits in a line."""
    names = " against ".join(one.name for one in design.objectives)
    return f"GaitFront of '{design.request.scene.name}': {len(design.members)} gaits, {names}"


def gait_table(design: GaitFront) -> Table:
    """The gaits of a front, the robust one and the nominal optimum: what they reach, and the numbers that make them."""
    judged = design.request.over is not None
    paths = design.request.unknowns.paths[:SHOWN]
    columns, kinds = [Column("gait")], []
    for j, one in enumerate(design.objectives):
        for kind in ("nominal", "worst") if judged and one.grounded else ("nominal",):
            columns.append(Column(f"worst {one.name}" if kind == "worst" else one.name, one.unit))
            kinds.append((kind, j))
    columns += [Column(path, unit) for path, unit in units_of(design.request.scene, paths).items()]
    rows = [
        (name, *(getattr(point, kind)[j] for kind, j in kinds), *(point.values[path] for path in paths))
        for name, point in gait_scene_names(design)
    ]
    read = f", {design.reused} read" if design.reused else ""
    notes = [
        f"{design.candidates} gaits tried, {design.runs} walks{read}",
        f"all numbers are of walks of {amount(design.request.duration, 's')} from one start, not of settled motion",
    ]
    if judged and design.gap == design.gap:
        notes.append(
            f"gap of the worst grounds: {percent(design.gap, 2)}; {len(design.grounds)} grounds active"
        )
    if design.certificate is not None:
        looked = design.certificate
        notes.append(
            f"of {looked.grounds} grounds drawn by chance at the end {looked.worse} were more than 2 % worse for any "
            f"gait shown than known; at most {percent(looked.share, 2)} of the box are (95 %)"
        )
    if judged:
        notes.append(
            f"worst {design.objectives[0].name}, robust gait over nominal optimum: {design.gain:.3g}"
        )
    return Table(gait_line(design), columns, rows, notes)


def write_front(design: GaitFront, folder: str | Path) -> Path:
    """Write a front into a folder; returns the folder. Raises InputError where it cannot be written."""
    texts = {"gaits.json": json_text(gait_data(design)) + "\n", "front.csv": _front_csv(design)}
    for name, point in gait_scene_names(design):
        texts[f"gaits/{name}.toml"] = scene_text(design.scene_of(point))
    robust = design.scene_of(design.robust)
    if robust.gait is not None:
        texts["gait.h"] = gait_header_text(robust, tick=min(TICK, 1.0 / (TICKS * robust.gait.frequency)))
    return write_texts(folder, texts)


def _front_csv(design: GaitFront) -> str:
    kinds = ("nominal", "risk", "worst")
    paths = units_of(design.request.scene, design.request.unknowns.paths)
    head = ["gait", *(f"{path} ({unit})" for path, unit in paths.items()),
            *(f"{one.name} {kind} ({one.unit})" for one in design.objectives for kind in kinds),
            "energy (J)", "energy with charge recovery (J)"]  # fmt: skip
    rows = [
        (name, *point.values.values(),
         *(getattr(point, kind)[j] for j in range(len(design.objectives)) for kind in kinds),
         point.energy, point.recovered)
        for name, point in gait_scene_names(design)
    ]  # fmt: skip
    return csv_text(head, rows)


def adapt_data(design: AdaptiveGait) -> dict[str, Any]:
    """An adaptive gait as plain data, SI units.

    table: how often each gait is chosen on the table's grounds, in words; gaits: values by path; probes: numbers of the
    gaits that are walked first, so many steps each; posterior: what the robot carries: ``readings`` of the probes and
    ``costs`` of the gaits on each of its grounds, and one standard ``deviations`` of each reading; regret: mean loss on
    the hidden grounds against the gait that knows the ground, with its 95 % interval; fixed_regret: of the best single
    gait; choice_regret: were the best of these gaits always chosen.
    """
    return {
        "scene": design.request.scene.name, "objective": design.request.objectives[0].name,
        "sense": [one.value for one in design.sense], "senses": list(design.senses),
        "probes": list(design.probes), "probe_steps": design.probe_steps, "gaits": [dict(one) for one in design.gaits],
        "table": [{"when": said, "gait": number} for said, number in design.rule],
        "posterior": {
            "readings": design.posterior.readings, "costs": design.posterior.costs,
            "deviations": design.posterior.deviations,
        },
        "regret": design.regret, "regret_interval": list(design.regret_interval), "fixed_regret": design.fixed_regret,
        "choice_regret": design.choice_regret, "hidden": len(design.known), "repeats": design.repeats,
        "runs": design.runs, "version": package_version(),
    }  # fmt: skip


def adapt_line(design: AdaptiveGait) -> str:
    """Adaptive gaits in a line."""
    name = design.request.scene.name
    return f"AdaptiveGait of '{name}': {len(design.gaits)} gaits, regret {percent(design.regret)}"


def adapt_table(design: AdaptiveGait) -> Table:
    """The few gaits, how often each is taken on the hidden grounds, and what is lost there."""
    units = units_of(design.request.scene, design.gaits[0])
    columns = ["gait", "taken", *(Column(path, unit) for path, unit in units.items())]
    rows = [
        (f"{number}{' (probe)' * (number in design.probes)}",
         f"{int((design.chosen == number).sum())} of {len(design.chosen)}", *gait.values())
        for number, gait in enumerate(design.gaits)
    ]  # fmt: skip
    low, high = design.regret_interval
    notes = [f"gait {number} {said}" for said, number in design.rule]
    notes.append(
        f"lost on {len(design.known)} hidden grounds: {percent(design.regret, 2)} ({interval(low, high, '%', 2)}); the "
        f"best single gait loses {percent(design.fixed_regret, 2)}, the best of these each time "
        f"{percent(design.choice_regret, 2)}"
    )
    return Table(adapt_line(design), columns, rows, notes)


def write_adapt(design: AdaptiveGait, folder: str | Path) -> Path:
    """Write an adaptive gait into a folder; returns the folder. Raises InputError where it cannot be written."""
    objective = design.request.objectives[0]
    head = [
        *design.grounds.names,
        "gait",
        f"{objective.name} chosen ({objective.unit})",
        f"{objective.name} known",
    ]
    rows = [
        (
            *ground,
            int(chosen),
            float(objective.value(design.costs[i, chosen])),
            float(objective.value(design.known[i])),
        )
        for i, (ground, chosen) in enumerate(
            zip(design.grounds.points().tolist(), design.chosen, strict=True)
        )
    ]
    return write_texts(
        folder, {"adapt.json": json_text(adapt_data(design)) + "\n", "hidden.csv": csv_text(head, rows)}
    )
