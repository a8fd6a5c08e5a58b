"""A gait for a microcontroller: when every drive rises and falls, in whole ticks of a timer."""

from __future__ import annotations

import hashlib
import json
import math

from tarsus.base.errors import InputError
from tarsus.design.timer import in_comment, in_ticks
from tarsus.model.scene import Scene

__all__ = ["gait_header_text"]


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
    period = in_ticks(1.0 / gait.frequency, tick)
    if period >= 2**32:
        raise InputError(f"tick: {period} ticks a period do not fit into 32 bits; give a longer tick")
    exact = 1.0 / gait.frequency / tick
    rises = [round(-wave.phase / (2.0 * math.pi) % 1.0 * exact) % period for wave in waves.values()]
    falls = [
        (rise + round(wave.duty * exact)) % period for rise, wave in zip(rises, waves.values(), strict=True)
    ]
    low, high = (round(1e3 * volts) for volts in (gait.low, gait.high))
    told = json.dumps([round(tick * 1e9), period, rises, falls, low, high, list(waves)])
    digest = hashlib.sha256(told.encode()).hexdigest()[:16]

    def row(ticks: list[int]) -> str:
        return ", ".join(f"{one}u" for one in ticks)

    return "\n".join(
        [
            f"/* Gait of {in_comment(scene.name)}, {gait.kind}, {gait.frequency:.6g} Hz; made by tarsus, do not edit.",
            f" * Drives in order: {', '.join(waves)}.",
            " * Each goes to gait_high_millivolts at gait_rise_ticks[i], to gait_low_millivolts at gait_fall_ticks[i]",
            " * of every period. A fall that comes before the rise ends the high part that the period before began. */",
            "#ifndef TARSUS_GAIT_H", "#define TARSUS_GAIT_H", "", "#include <stdint.h>", "",
            f"#define GAIT_COUNT {len(waves)}u",
            f'#define GAIT_DIGEST "{digest}"', "",
            f"static const uint32_t gait_tick_ns = {round(tick * 1e9)}u;",
            f"static const uint32_t gait_period_ticks = {period}u;",
            f"static const int32_t gait_low_millivolts = {low};",
            f"static const int32_t gait_high_millivolts = {high};",
            f"static const uint32_t gait_rise_ticks[GAIT_COUNT] = {{{row(rises)}}};",
            f"static const uint32_t gait_fall_ticks[GAIT_COUNT] = {{{row(falls)}}};",
            "", "#endif", "",
        ]
    )  # fmt: skip
