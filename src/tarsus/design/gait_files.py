"""Files of gait designs: the front as data, its gaits as scenes, the table that a robot carries."""

from __future__ import annotations

import csv
import io
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from tarsus.base.spec import float_paths
from tarsus.design.adaptive import AdaptiveGait
from tarsus.design.gait_fronts import GaitFront, GaitPoint
from tarsus.design.gait_header import gait_header_text
from tarsus.files.jsontext import json_text
from tarsus.files.store import package_version, write_text
from tarsus.files.toml import scene_text

__all__ = [
    "ADAPT_FILES", "FRONT_FILES", "adapt_table", "gait_scene_names", "gait_table", "write_adapt", "write_front",
]  # fmt: skip

FRONT_FILES = ("gaits.json", "front.csv", "gait.h", "report.html", "gaits/*.toml", "gaits/*.html")
"""Names of everything that `tarsus design gait` writes at its end."""
ADAPT_FILES = ("adapt.json", "hidden.csv", "report.html")
"""Names of everything that `tarsus design adapt` writes."""


def gait_table(design: GaitFront) -> dict[str, Any]:
    """A design as plain data, SI units; NaN where there is none.

    objectives: name, unit, whether the most is best; front, nominal_front: gaits, each with ``values`` by path and,
    by objective, ``nominal``, ``risk`` and ``worst``; robust, optimum: the two gaits that are compared, and gain:
    worst value of the first over that of the second; gap: what is left open about the worst grounds; certificate:
    grounds drawn by chance at the end, those more than 2 % worse than known, and the box's share that may be so.
    """
    request, looked = design.request, design.certificate
    proof = None if looked is None else {"grounds": looked.grounds, "worse": looked.worse, "share": looked.share}
    return {
        "certificate": proof, "scene": request.scene.name, "risk": request.risk.name,
        "free": list(request.unknowns.names),
        "objectives": [{"name": one.name, "unit": one.unit, "most": one.most} for one in design.objectives],
        "front": [_point(design, one) for one in design.members],
        "nominal_front": [_point(design, one) for one in design.nominal],
        "robust": _point(design, design.robust), "optimum": _point(design, design.optimum), "gain": design.gain,
        "over": [] if request.over is None else list(request.over.paths),
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


def write_front(design: GaitFront, folder: Path) -> list[Path]:
    """Write a front into a folder; the paths of the files."""
    written = [folder / "gaits.json", folder / "front.csv"]
    write_text(written[0], json_text(gait_table(design)) + "\n")
    write_text(written[1], _csv(design))
    (folder / "gaits").mkdir(exist_ok=True)
    for name, point in gait_scene_names(design):
        target = folder / "gaits" / f"{name}.toml"
        write_text(target, scene_text(design.scene_of(point)))
        written.append(target)
    robust = design.scene_of(design.robust)
    if robust.gait is not None:
        written.append(folder / "gait.h")
        tick = min(1e-6, 1e-3 / robust.gait.frequency)  # fine enough at any frequency
        write_text(written[-1], gait_header_text(robust, tick=tick))
    return written


def _csv(design: GaitFront) -> str:
    units = {path: info.unit for path, info in float_paths(design.request.scene).items()}
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    kinds = ("nominal", "risk", "worst")
    writer.writerow(
        ["gait", *(f"{path} ({units[path]})" for path in design.request.unknowns.paths),
         *(f"{one.name} {kind} ({one.unit})" for one in design.objectives for kind in kinds),
         "energy (J)", "energy with charge recovery (J)"]
    )  # fmt: skip
    for name, point in gait_scene_names(design):
        scores = [getattr(point, kind)[j] for j in range(len(design.objectives)) for kind in kinds]
        writer.writerow(
            [name, *(f"{v:.9g}" for v in (*point.values.values(), *scores, point.energy, point.recovered))]
        )
    return stream.getvalue()


def adapt_table(design: AdaptiveGait) -> dict[str, Any]:
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
        "table": [{"when": said, "gait": number} for said, number in design.table],
        "posterior": {
            "readings": design.posterior.readings, "costs": design.posterior.costs,
            "deviations": design.posterior.deviations,
        },
        "regret": design.regret, "regret_interval": list(design.regret_interval), "fixed_regret": design.fixed_regret,
        "choice_regret": design.choice_regret, "hidden": len(design.known), "repeats": design.repeats,
        "runs": design.runs, "version": package_version(),
    }  # fmt: skip


def write_adapt(design: AdaptiveGait, folder: Path) -> list[Path]:
    """Write an adaptive gait into a folder; the paths of the files."""
    written = [folder / "adapt.json", folder / "hidden.csv"]
    write_text(written[0], json_text(adapt_table(design)) + "\n")
    objective = design.request.objectives[0]
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow(
        [*design.grounds, "gait", f"{objective.name} chosen ({objective.unit})", f"{objective.name} known"]
    )
    for i, (chosen, known) in enumerate(zip(design.chosen.tolist(), design.known.tolist(), strict=True)):
        got, best = objective.value(design.costs[i, chosen]), objective.value(known)
        writer.writerow(
            [*(f"{own[i]:.9g}" for own in design.grounds.values()), chosen, f"{got:.9g}", f"{best:.9g}"]
        )
    write_text(written[1], stream.getvalue())
    return written


def values_in_words(values: Mapping[str, float], units: Mapping[str, str]) -> str:
    """Values by path, with units."""
    from tarsus.base.units import format_quantity

    return ", ".join(
        f"{path.removeprefix('gait.')} {format_quantity(float(f'{value:.4g}'), units[path])}"
        for path, value in values.items()
    )
