"""Designs for a microcontroller: C headers with whole ticks of a timer and whole millivolts, and a digest."""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from tarsus.base.errors import InputError
from tarsus.design.timer import in_comment, in_ticks
from tarsus.model.drive.waveforms import OnOff
from tarsus.model.scene import Scene

if TYPE_CHECKING:
    from tarsus.design.soft_landing import LandingDesign

__all__ = ["digest", "gait_header_text", "header_text"]

WIDEST = 32
"""Bits of a timer's counter: what a header counts ticks in."""


def digest(content: OnOff | Sequence[Any]) -> str:
    """A digest of a signal, its levels and durations exactly, or of other numbers and words: the first 16 hexadecimal
    digits of the SHA-256."""
    if isinstance(content, OnOff):
        content = [[float(x).hex() for x in part] for part in (content.levels, content.durations)]
    return hashlib.sha256(json.dumps(content).encode()).hexdigest()[:16]


def header_text(design: LandingDesign) -> str:
    """``landing.h``: when to switch, in whole ticks of the timer, and to what, in whole millivolts.

    Raises InputError for a period of more ticks than 32 bits hold.
    """
    request, signal = design.request, design.signal
    tick = request.step.period / request.ticks
    _fits(request.ticks)
    times = [round(time / tick) for time in design.switching_times]
    about = f"{in_comment(request.scene.name)}, foot {request.foot}, drive {request.drive}"
    judged = not math.isnan(design.worst)
    worst = f", at most {design.worst:.4g} m/s on the grounds it was designed for" if judged else ""
    said = (
        "Soft landing, made by `tarsus design landing`; do not edit.",
        f"{about}: {design.speed:.4g} m/s{worst}.",
        "Switch to landing_millivolts[i] at landing_ticks[i] after the landing edge, every period.",
    )
    constants = {
        "uint32_t landing_tick_ns": round(tick * 1e9), "uint32_t landing_period_ticks": request.ticks,
        "uint32_t landing_ticks": times, "int32_t landing_millivolts": [round(1e3 * one) for one in signal.levels],
    }  # fmt: skip
    return _header("LANDING", said, digest(signal), len(times), constants)


def gait_header_text(scene: Scene, *, tick: float = 1e-6) -> str:
    """``gait.h`` of a walker's gait: ticks of the rise and the fall of every drive, every period, and millivolts.

    Parameters
    ----------
    scene
        Of a walker with a gait, such as `tarsus.design.GaitFront.scene_of` gives.
    tick
        Of the timer [s]; edges are rounded to whole ones.

    Raises
    ------
    InputError
        For a scene without a gait, a tick longer than a hundredth of the period, and a period of more ticks than
        32 bits hold.
    """
    layout = scene.robot.layout()
    if scene.gait is None or layout is None:
        raise InputError("the scene has no gait: a header of one needs a walker whose drives follow [gait]")
    gait, waves = scene.gait, scene.gait.waveforms(layout)
    period, exact = in_ticks(1.0 / gait.frequency, tick), 1.0 / gait.frequency / tick
    _fits(period)
    rises = [round(-wave.phase / (2.0 * math.pi) % 1.0 * exact) % period for wave in waves.values()]
    falls = [
        (rise + round(wave.duty * exact)) % period for rise, wave in zip(rises, waves.values(), strict=True)
    ]
    low, high = (round(1e3 * volts) for volts in (gait.low, gait.high))
    said = (
        f"Gait of {in_comment(scene.name)}, {gait.kind}, {gait.frequency:.6g} Hz; made by tarsus, do not edit.",
        f"Drives in order: {', '.join(waves)}.",
        "Each goes to gait_high_millivolts at gait_rise_ticks[i], to gait_low_millivolts at gait_fall_ticks[i]",
        "of every period. A fall that comes before the rise ends the high part that the period before began.",
    )
    own = digest([round(tick * 1e9), period, rises, falls, low, high, list(waves)])
    constants = {
        "uint32_t gait_tick_ns": round(tick * 1e9), "uint32_t gait_period_ticks": period,
        "int32_t gait_low_millivolts": low, "int32_t gait_high_millivolts": high,
        "uint32_t gait_rise_ticks": rises, "uint32_t gait_fall_ticks": falls,
    }  # fmt: skip
    return _header("GAIT", said, own, len(waves), constants)


def _fits(ticks: int) -> None:
    if ticks >= 2**WIDEST:
        raise InputError(f"tick: {ticks} ticks a period do not fit into {WIDEST} bits; give a longer tick")


def _header(
    kind: str, said: Sequence[str], own: str, count: int, constants: Mapping[str, int | list[int]]
) -> str:
    """A header of numbers and rows of ``count`` numbers by type and name, under a comment."""

    def line(name: str, value: int | list[int]) -> str:
        suffix = "u" if name.startswith("u") else ""
        if isinstance(value, int):
            return f"static const {name} = {value}{suffix};"
        return f"static const {name}[{kind}_COUNT] = {{{', '.join(f'{one}{suffix}' for one in value)}}};"

    guard = f"TARSUS_{kind}_H"
    comment = "\n * ".join(said)
    lines = [
        f"/* {comment} */", f"#ifndef {guard}", f"#define {guard}", "", "#include <stdint.h>", "",
        f"#define {kind}_COUNT {count}u", f'#define {kind}_DIGEST "{own}"', "",
        *(line(name, value) for name, value in constants.items()), "", "#endif", "",
    ]  # fmt: skip
    return "\n".join(lines)
