"""The animation of a walk in a page: its data as compact text, and the player that draws it, all in one fragment."""

from __future__ import annotations

import base64
import json
from collections.abc import Sequence
from html import escape
from importlib.resources import files
from string import Template
from typing import Any

import numpy as np

from tarsus.report.html import amount
from tarsus.report.motion import Motion, frame_limit
from tarsus.report.stage import BACK, Stage, stage_of
from tarsus.report.walk_figures import still

CHARACTERS = 290_000
"""Characters of series in a payload at most."""

MOST_DRIVES = 6
"""Different drive voltages drawn at most."""

SAME = 1e-6
"""Drive voltages that differ by less than this part of the largest are one."""


def walk_section(motion: Motion, index: int | None = None) -> str:
    """The animation as an HTML fragment that needs nothing else: no file, no network, no library.

    `index` numbers it among a page's figures.

    It holds at most 2000 frames, fewer where there are many legs, so that it stays below 400 kB. Where no script
    runs, and in print, it is a still of four moments.
    """
    drives = _distinct(motion)
    thin = motion.thinned(frame_limit(len(motion.legs), len(drives), CHARACTERS))
    stage = stage_of(thin)
    picture = still(thin, stage)
    return Template(_part("player.html")).substitute(
        style=_part("player.css"),
        still=picture.svg,
        moments=escape(picture.caption),
        number="" if index is None else f"<b>Figure {index}.</b> ",
        caption=escape(_caption(thin, stage)),
        data=_script_text(payload(thin, stage, drives)),
        draw=_part("player_draw.js"),
        play=_part("player.js"),
    )


def _part(name: str) -> str:
    return files("tarsus.report").joinpath(name).read_text(encoding="utf-8")


def payload(motion: Motion, stage: Stage, drives: Sequence[tuple[str, int]] = ()) -> dict[str, Any]:
    """A motion as plain data for the player: names, numbers [SI], and series packed by `packed`.

    `drives` are (label, row of volts) of the voltages to draw.
    """
    return {
        "legs": list(motion.legs),
        "hips": [[float(f"{value:.9g}") for value in hip] for hip in motion.hips],
        "stage": {
            "x": _numbers(stage.x),
            "y": _numbers(stage.y),
            "z": _numbers(stage.z),
            "box": _numbers(stage.box),
            "length": stage.length,
            "leg": stage.leg,
            "thick": stage.thick,
            "true": stage.true,
            "up": stage.up,
            "along": stage.along,
            "force": stage.force,
            "back": list(BACK),
        },
        "period": motion.period,
        "frames": len(motion.time),
        "time": packed(motion.time[None, :], 16),
        "body": {name: packed(values[None, :], 16) for name, values in motion.body.items()},
        "foot_x": packed(motion.foot_x, 16),
        "foot_z": packed(motion.foot_z, 16),
        "normal": packed(motion.normal, 8),
        "friction": packed(motion.friction, 8),
        "state": packed_states(motion.state),
        "drives": [label for label, _ in drives],
        "volts": packed(motion.volts[[row for _, row in drives]], 8) if drives else None,
    }


def packed(values: np.ndarray, bits: int) -> dict[str, Any]:
    """Numbers (rows, nt) as base64 of little-endian integers q of 8 or 16 bits: value = (low + q) step.

    Zero is kept exactly where it is among the values or between them. What is not finite becomes zero.
    """
    finite = np.nan_to_num(np.asarray(values, dtype=float), posinf=0.0, neginf=0.0)
    least, most = float(finite.min(initial=0.0)), float(finite.max(initial=0.0))
    if finite.size and (finite.min() > 0.0 or finite.max() < 0.0):
        least, most = float(finite.min()), float(finite.max())
    step = (most - least) / (2**bits - 2) or abs(most) or 1.0
    low = int(np.floor(least / step))
    whole = np.clip(np.rint(finite / step) - low, 0, 2**bits - 1).astype("<u2" if bits == 16 else "u1")
    return {"bits": bits, "low": low, "step": step, "data": base64.b64encode(whole.tobytes()).decode()}


def unpacked(channel: dict[str, Any], rows: int) -> np.ndarray:
    """What `packed` made, (rows, nt), as the player reads it."""
    kind = "<u2" if channel["bits"] == 16 else "u1"
    whole = np.frombuffer(base64.b64decode(channel["data"]), dtype=kind)
    return ((channel["low"] + whole.astype(float)) * channel["step"]).reshape(rows, -1)


def packed_states(state: np.ndarray) -> str:
    """States (nl, nt) of 0 to 3, row after row, four to a byte from its low bits up, as base64."""
    flat = np.asarray(state, dtype=np.uint8).reshape(-1)
    fours = np.pad(flat, (0, -len(flat) % 4)).reshape(-1, 4)
    return base64.b64encode((fours << np.array([0, 2, 4, 6], np.uint8)).sum(axis=1).astype(np.uint8)).decode()


def _distinct(motion: Motion) -> list[tuple[str, int]]:
    """The different drive voltages: (names of the drives that share one, row)."""
    alike: dict[int, list[str]] = {}
    for row, name in enumerate(motion.drives):
        volts = motion.volts[row]
        near = SAME * max(float(np.abs(volts).max()), 1e-12)
        first = next((r for r in alike if float(np.abs(motion.volts[r] - volts).max()) <= near), row)
        alike.setdefault(first, []).append(name)
    few = list(alike.items())[:MOST_DRIVES]
    return [(names[0] if len(names) == 1 else f"{names[0]} +{len(names) - 1}", row) for row, names in few]


def _caption(motion: Motion, stage: Stage) -> str:
    first, last = (amount(float(time), "s") for time in (motion.time[0], motion.time[-1]))
    places = "places of the hips are to scale"
    if not stage.true:
        places = "legs that the model has at one place are drawn side by side"
    return (
        f"The walk from {first} to {last}, seen from the robot's right, its left side paler and set back. Motion is "
        f"drawn larger by the factors chosen; {places}; length of legs and thickness of body are not the model's. "
        "Ticks on the ground are travel of the body's centre, which the small triangle shows. "
        "Arrows are forces of the ground on the feet."
    )


def _numbers(values: Any) -> list[float]:
    return [float(f"{value:.9g}") for value in values]


def _script_text(content: dict[str, Any]) -> str:
    """JSON that no HTML parser can mistake for markup."""
    return json.dumps(content, separators=(",", ":"), ensure_ascii=False, allow_nan=False).replace(
        "<", "\\u003c"
    )
