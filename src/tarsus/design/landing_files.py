"""A landing design as data, as a table, and as files: the signal for any scene, a header for a microcontroller, the
table of grounds."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from tarsus.design.headers import digest, header_text
from tarsus.design.results import csv_text, write_texts
from tarsus.design.timer import in_comment
from tarsus.design.trials import Landings
from tarsus.files.jsontext import json_text
from tarsus.files.store import package_version
from tarsus.files.toml import scene_text
from tarsus.tables.numbers import amount
from tarsus.tables.table import Column, Table

if TYPE_CHECKING:
    from tarsus.design.soft_landing import LandingDesign

__all__ = ["LANDING_FILES", "landing_data", "landing_line", "landing_table", "signal_text", "write_landing"]

LANDING_FILES = ("landing.json", "signal.toml", "scene.toml", "landing.h", "scenarios.csv", "report.html")
"""Names of everything that `tarsus design landing` writes."""


def landing_data(design: LandingDesign) -> dict[str, Any]:
    """A design as plain data, SI units; NaN where there is none.

    speed [m/s]: hardest nominal touchdown of the whole period; touchdowns: a step; worst [m/s]: over the grounds;
    switching_times [s]; energy [J] a period; scenarios: what the foot does on every ground.
    """
    energy, recovered = design.energies
    request, step, found, learned = design.request, design.request.step, design.attack, design.learning
    worst = None if found is None else {
        "ground": dict(zip(design.grounds.names, found.grounds[0, 0].tolist(), strict=True)),
        "score": float(found.costs[0, 0]), "tried": found.tried,
    }  # fmt: skip
    return {
        "scene": request.scene.name, "foot": request.foot, "drive": request.drive, "risk": request.risk.name,
        "objective": request.options.objective.value, "speed": design.speed, "touchdowns": design.touchdowns,
        "worst": design.worst, "nominal_worst": design.nominal_worst, "pairs": design.pairs,
        "switching_times": list(design.switching_times), "levels": list(design.signal.levels),
        "durations": list(design.signal.durations), "period": step.period, "tick": step.period / request.ticks,
        "rounding_loss": design.loss, "energy": energy, "energy_recovered": recovered,
        "plain": _landed(design.before, 0), "nominal": _landed(design.after, 0), "regime": design.regime.words,
        "periods_to_settle": design.settle - 1, "scenarios": _scenarios(design),
        "rounds": [{"grounds": one.grounds, "score": one.score, "worst": one.worst} for one in design.rounds],
        "worst_ground": worst, "front": [
            {"pairs": one.pairs, "speed": one.speed, "energy": one.energy, "energy_recovered": one.recovered,
             "levels": list(one.signal.levels), "durations": list(one.signal.durations)}
            for one in design.front
        ], "runs": design.runs, "digest": digest(design.signal), "learning": learned and {
            "steps": learned.speeds.shape[1] - 1, "grounds": len(learned.grounds), "halved_in_ten": learned.halved,
            "median_speed": np.median(learned.speeds, axis=0).tolist(),
            "plain_speed": float(np.median(learned.plain)),
            "median_regret": np.median(learned.regret, axis=0).tolist(), "sensor": learned.sensor.value,
        }, "notes": list(design.notes), "version": package_version(),
    }  # fmt: skip


def _landed(found: Landings, at: int) -> dict[str, float]:
    names = ("speed", "impulse", "touchdowns", "contact", "peak", "lifted")
    return {name: float(getattr(found, name)[0, at]) for name in names}


def _scenarios(design: LandingDesign) -> list[dict[str, Any]]:
    plain = design.before_on_grounds.speed[0].tolist()
    return [
        {
            "ground": {path: float(own[i]) for path, own in design.grounds.values.items()},
            **_landed(design.on_grounds, i),
            "plain_speed": plain[i],
        }
        for i in range(len(design.grounds))
    ]


def landing_line(design: LandingDesign) -> str:
    """A soft landing in a line."""
    plain, softer = (amount(float(one.speed[0, 0]), "m/s") for one in (design.before, design.after))
    pairs = f"{design.pairs} pair{'s' * (design.pairs != 1)}"
    return f"LandingDesign of '{design.request.scene.name}': {softer} instead of {plain}, {pairs}"


def landing_table(design: LandingDesign) -> Table:
    """The plateaus of a soft landing under what they are for."""
    before, (energy, recovered) = design.before, design.energies
    notes = [
        f"plain step: {amount(float(before.speed[0, 0]), 'm/s')}, {before.touchdowns[0, 0]:g} touchdowns a step",
        f"designed: {amount(design.speed, 'm/s')}, {design.touchdowns:g} touchdowns a step, {design.regime.words}",
    ]
    if math.isfinite(design.worst):
        looked = "" if design.attack is None else f", {design.attack.tried} looked at"
        rival = amount(design.nominal_worst, "m/s")
        notes.append(
            f"worst: {amount(design.worst, 'm/s')} on {len(design.grounds)} grounds{looked}; the nominal design's "
            f"worst {rival}"
        )
    if math.isfinite(energy):
        notes.append(f"energy: {amount(energy, 'J')} a period, {amount(recovered, 'J')} with charge recovery")
    signal = zip(design.switching_times, design.signal.levels, design.signal.durations, strict=True)
    columns = (Column("from", "s", 6), Column("voltage", "V", 5), Column("for", "s", 6))
    return Table(landing_line(design), columns, signal, (*notes, *design.notes))


def signal_text(design: LandingDesign) -> str:
    """The signal as a table of a scene file: in the place of the scene's own ``[signals.NAME]``."""
    signal = design.signal

    def row(values: tuple[float, ...], unit: str, factor: float) -> str:
        return ", ".join(f'"{value * factor:.9g} {unit}"' for value in values)

    return (
        f"# `tarsus design landing`: foot '{design.request.foot}' of {in_comment(design.request.scene.name)}, "
        f"{design.speed:.4g} m/s; digest {digest(signal)}\n"
        f"[signals.{design.request.drive}]\n"
        'kind = "on_off"\n'
        f"levels = [{row(signal.levels, 'V', 1.0)}]\n"
        f"durations = [{row(signal.durations, 'us', 1e6)}]\n"
        "repeat = true\n"
    )


def write_landing(design: LandingDesign, folder: str | Path) -> Path:
    """Write everything but the report into a folder, which is made where it does not exist; returns the folder.

    Raises InputError where it cannot be written.
    """
    rows = _scenarios(design)
    names = [name for name in rows[0] if name != "ground"]
    table = [(*row["ground"].values(), *(row[name] for name in names)) for row in rows]
    return write_texts(folder, {
        "scene.toml": scene_text(design.scene), "signal.toml": signal_text(design), "landing.h": header_text(design),
        "scenarios.csv": csv_text((*design.grounds.names, *names), table),
        "landing.json": json_text(landing_data(design)) + "\n",
    })  # fmt: skip
