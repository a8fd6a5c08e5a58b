"""Files of a landing design: the signal for any scene, a header for a microcontroller, the table of grounds."""

from __future__ import annotations

import hashlib
import json
from pathlib import Path
from typing import Any

import numpy as np

from tarsus.base.errors import InputError
from tarsus.design.soft_landing import LandingDesign
from tarsus.design.timer import in_comment
from tarsus.files.jsontext import json_text
from tarsus.files.store import package_version, write_text
from tarsus.files.toml import write_scene
from tarsus.model.drive.waveforms import OnOff

__all__ = ["LANDING_FILES", "header_text", "landing_table", "signal_text", "write_landing"]

LANDING_FILES = ("landing.json", "signal.toml", "scene.toml", "landing.h", "scenarios.csv", "report.html")
"""Names of everything that `tarsus design landing` writes."""


def landing_table(design: LandingDesign) -> dict[str, Any]:
    """A design as plain data, SI units; NaN where there is none.

    speed [m/s]: hardest nominal touchdown of the whole period; touchdowns: a step; worst [m/s]: over the grounds;
    switching_times [s]; energy [J] a period; scenarios: what the foot does on every ground.
    """
    energy, recovered = design.energies
    request, step = design.request, design.request.step
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
        "worst_ground": _worst_ground(design), "front": [
            {"pairs": one.pairs, "speed": one.speed, "energy": one.energy, "energy_recovered": one.recovered,
             "levels": list(one.signal.levels), "durations": list(one.signal.durations)}
            for one in design.front
        ], "runs": design.runs, "digest": digest(design.signal), "learning": _learning(design),
        "notes": list(design.notes), "version": package_version(),
    }  # fmt: skip


def _landed(found: Any, at: int) -> dict[str, float]:
    return {
        name: float(getattr(found, name)[0, at])
        for name in ("speed", "impulse", "touchdowns", "contact", "peak", "lifted")
    }


def _scenarios(design: LandingDesign) -> list[dict[str, Any]]:
    paths = list(design.grounds.values)
    return [
        {
            "ground": {path: float(design.grounds.values[path][i]) for path in paths},
            **_landed(design.on_grounds, i),
            "plain_speed": float(design.before_on_grounds.speed[0, i]),
        }
        for i in range(len(design.grounds))
    ]


def _worst_ground(design: LandingDesign) -> dict[str, Any] | None:
    if design.attack is None:
        return None
    where = dict(zip(design.grounds.values, design.attack.ground.tolist(), strict=True))
    return {"ground": where, "score": design.attack.score, "tried": design.attack.tried}


def _learning(design: LandingDesign) -> dict[str, Any] | None:
    found = design.learning
    if found is None:
        return None
    return {
        "steps": found.speeds.shape[1] - 1, "grounds": len(found.grounds), "halved_in_ten": found.halved,
        "median_speed": np.median(found.speeds, axis=0).tolist(), "plain_speed": float(np.median(found.plain)),
        "median_regret": np.median(found.regret, axis=0).tolist(), "sensor": found.sensor.value,
    }  # fmt: skip


def digest(signal: OnOff) -> str:
    """A digest of a signal: the first 16 hexadecimal digits of the SHA-256 of its levels and durations, exactly."""
    told = json.dumps([[float(x).hex() for x in part] for part in (signal.levels, signal.durations)])
    return hashlib.sha256(told.encode()).hexdigest()[:16]


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


def header_text(design: LandingDesign) -> str:
    """``landing.h``: when to switch, in whole ticks of the timer, and to what, in whole millivolts.

    Raises InputError for a period of more ticks than 32 bits hold.
    """
    request, signal = design.request, design.signal
    tick = request.step.period / request.ticks
    if request.ticks >= 2**32:
        raise InputError(f"tick: {request.ticks} ticks a period do not fit into 32 bits; give a longer tick")
    times = [round(time / tick) for time in design.switching_times]
    millivolts = [round(1e3 * level) for level in signal.levels]
    count = len(times)
    worst = (
        ""
        if np.isnan(design.worst)
        else f", at most {design.worst:.4g} m/s on the grounds it was designed for"
    )
    about = f"{in_comment(request.scene.name)}, foot {request.foot}, drive {request.drive}"
    return "\n".join(
        [
            "/* Soft landing, made by `tarsus design landing`; do not edit.",
            f" * {about}: {design.speed:.4g} m/s{worst}.",
            " * Switch to landing_millivolts[i] at landing_ticks[i] after the landing edge, every period. */",
            "#ifndef TARSUS_LANDING_H", "#define TARSUS_LANDING_H", "", "#include <stdint.h>", "",
            f"#define LANDING_COUNT {count}u",
            f'#define LANDING_DIGEST "{digest(signal)}"', "",
            f"static const uint32_t landing_tick_ns = {round(tick * 1e9)}u;",
            f"static const uint32_t landing_period_ticks = {request.ticks}u;",
            f"static const uint32_t landing_ticks[LANDING_COUNT] = {{{', '.join(f'{t}u' for t in times)}}};",
            f"static const int32_t landing_millivolts[LANDING_COUNT] = {{{', '.join(map(str, millivolts))}}};",
            "", "#endif", "",
        ]
    )  # fmt: skip


def scenarios_text(design: LandingDesign) -> str:
    """The table of grounds as CSV, SI units."""
    rows = _scenarios(design)
    paths = list(design.grounds.values)
    names = [name for name in rows[0] if name != "ground"]
    lines = [",".join([*paths, *names])]
    lines += [
        ",".join(f"{value:.9g}" for value in (*(row["ground"][p] for p in paths), *(row[n] for n in names)))
        for row in rows
    ]
    return "\n".join(lines) + "\n"


def write_landing(design: LandingDesign, folder: str | Path) -> Path:
    """Write everything but the report into a folder, which is made where it does not exist; returns the folder.

    Raises InputError where it cannot be written.
    """
    target = Path(folder)
    target.mkdir(parents=True, exist_ok=True)
    write_scene(design.scene, target / "scene.toml")
    write_text(target / "signal.toml", signal_text(design))
    write_text(target / "landing.h", header_text(design))
    write_text(target / "scenarios.csv", scenarios_text(design))
    write_text(target / "landing.json", json_text(landing_table(design)) + "\n")
    return target
