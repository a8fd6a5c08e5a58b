"""Designs for a microcontroller: whole ticks of a timer, chosen among the neighbours of the exact times by what they
cost, whole millivolts, and C headers with a digest."""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Mapping, Sequence
from itertools import product
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from tarsus.base.errors import InputError
from tarsus.base.spec import with_values
from tarsus.base.units import format_quantity
from tarsus.model.drive.waveforms import OnOff
from tarsus.model.scene import Scene
from tarsus.solve import simulate

if TYPE_CHECKING:
    from tarsus.design.landing_design import LandingDesign

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

MOST_TICKS, FEWEST_TICKS = 1e15, 100
"""Ticks of a period: more are no whole numbers of a float any more, fewer move an edge by a percent of the period."""
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
    train, signal = design.train, design.signal
    tick = train.step.period / train.ticks
    _fits(train.ticks)
    times = [round(time / tick) for time in design.switching_times]
    about = f"{in_comment(design.request.scene.name)}, foot {train.foot}, drive {train.drive}"
    judged = not math.isnan(design.worst)
    worst = f", at most {design.worst:.4g} m/s on the grounds it was designed for" if judged else ""
    said = (
        "Soft landing, made by `tarsus design landing`; do not edit.",
        f"{about}: {design.speed:.4g} m/s{worst}.",
        "Switch to landing_millivolts[i] at landing_ticks[i] after the landing edge, every period.",
    )
    constants = {
        "uint32_t landing_tick_ns": round(tick * 1e9),
        "uint32_t landing_period_ticks": train.ticks,
        "uint32_t landing_ticks": times,
        "int32_t landing_millivolts": [round(1e3 * one) for one in signal.levels],
    }
    return _header("LANDING", said, digest(signal), len(times), constants)


def gait_header_text(scene: Scene, *, tick: float = 1e-6) -> str:
    """``gait.h`` of a walker's gait: ticks of the rise and the fall of every drive, every period, and millivolts.

    Parameters
    ----------
    scene
        Of a walker with a gait, such as `tarsus.design.Design.scene_of` gives.
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
    falls = [(rise + round(wave.duty * exact)) % period for rise, wave in zip(rises, waves.values(), strict=True)]
    low, high = (round(1e3 * volts) for volts in (gait.low, gait.high))
    said = (
        f"Gait of {in_comment(scene.name)}, {gait.kind}, {gait.frequency:.6g} Hz; made by tarsus, do not edit.",
        f"Drives in order: {', '.join(waves)}.",
        "Each goes to gait_high_millivolts at gait_rise_ticks[i], to gait_low_millivolts at gait_fall_ticks[i]",
        "of every period. A fall that comes before the rise ends the high part that the period before began.",
    )
    said += _on_ticks(scene, tick, period, rises, falls)
    own = digest([round(tick * 1e9), period, rises, falls, low, high, list(waves)])
    constants = {
        "uint32_t gait_tick_ns": round(tick * 1e9),
        "uint32_t gait_period_ticks": period,
        "int32_t gait_low_millivolts": low,
        "int32_t gait_high_millivolts": high,
        "uint32_t gait_rise_ticks": rises,
        "uint32_t gait_fall_ticks": falls,
    }
    return _header("GAIT", said, own, len(waves), constants)


def _on_ticks(scene: Scene, tick: float, period: int, rises: Sequence[int], falls: Sequence[int]) -> tuple[str, ...]:
    """What rounding to ticks does to a gait: sentences on its frequency and edges, and on how fast plain runs of both
    walk."""
    assert scene.gait is not None
    layout = scene.robot.layout()
    assert layout is not None
    waves = {
        name: with_values(
            wave,
            {
                "frequency": 1.0 / (period * tick),
                "duty": (fall - rise) % period / period,
                "phase": -2.0 * math.pi * rise / period,
            },
        )
        for (name, wave), rise, fall in zip(scene.gait.waveforms(layout).items(), rises, falls, strict=True)
    }
    rounded = with_values(scene, {"gait": None, "signals": {**waves, **scene.signals}})
    runs = simulate(rounded), simulate(scene)
    found = [run.measures.get("mean_speed") if run.ok else None for run in runs]
    on, before = ("no way" if one is None else f"{1e3 * one.value:.4g} mm/s" for one in found)
    return (
        f"On ticks it has {1.0 / (period * tick):.6g} Hz, and edges within {1e6 * tick:.4g} us of where they were.",
        f"In a run of {scene.duration:g} s from its start the robot makes {on} so, and {before} before rounding.",
    )


def drives_header_text(
    name: str, volts: Mapping[str, tuple[Sequence[int], Sequence[float]]], period: int, tick: float
) -> str:
    """``drives.h``: for every drive the ticks of a period at which its volts change, and to what, in millivolts.

    Parameters
    ----------
    name
        What the tables are of.
    volts
        By drive: ticks in order, the first 0, and the volts [V] from each of them on.
    period
        Ticks of the period.
    tick
        Of the timer [s].

    Raises
    ------
    InputError
        For a period of more ticks than 32 bits hold, and for no drives.
    """
    _fits(period)
    if not volts:
        raise InputError("the robot has no drive: there is nothing to tabulate")
    counts = [len(times) for times, _ in volts.values()]
    times = [int(one) for ticks, _ in volts.values() for one in ticks]
    levels = [round(1e3 * one) for _, values in volts.values() for one in values]
    begins = [sum(counts[:k]) for k in range(len(counts) + 1)]
    said = (
        f"Drives of {in_comment(name)}; made by tarsus, do not edit.",
        f"In order: {in_comment(', '.join(volts))}.",
        "Drive i goes to drives_millivolts[k] at drives_ticks[k] of every period, for k from drives_begin[i] to",
        "drives_begin[i + 1] - 1.",
    )
    constants = {
        "uint32_t drives_tick_ns": round(tick * 1e9),
        "uint32_t drives_period_ticks": period,
        "uint32_t drives_count": len(volts),
        "uint32_t drives_begin": begins,
        "uint32_t drives_ticks": times,
        "int32_t drives_millivolts": levels,
    }
    own = digest([round(tick * 1e9), period, begins, times, levels, list(volts)])
    return _header("DRIVES", said, own, len(times), constants)


def _fits(ticks: int) -> None:
    if ticks >= 2**WIDEST:
        raise InputError(f"tick: {ticks} ticks a period do not fit into {WIDEST} bits; give a longer tick")


def _header(kind: str, said: Sequence[str], own: str, count: int, constants: Mapping[str, int | list[int]]) -> str:
    """A header of numbers and rows of numbers by type and name, most of them of ``count``, under a comment."""

    def line(name: str, value: int | list[int]) -> str:
        suffix = "u" if name.startswith("u") else ""
        if isinstance(value, int):
            return f"static const {name} = {value}{suffix};"
        size = f"{kind}_COUNT" if len(value) == count else str(len(value))
        return f"static const {name}[{size}] = {{{', '.join(f'{one}{suffix}' for one in value)}}};"

    guard = f"TARSUS_{kind}_H"
    comment = "\n * ".join(said)
    lines = [
        f"/* {comment} */",
        f"#ifndef {guard}",
        f"#define {guard}",
        "",
        "#include <stdint.h>",
        "",
        f"#define {kind}_COUNT {count}u",
        f'#define {kind}_DIGEST "{own}"',
        "",
        *(line(name, value) for name, value in constants.items()),
        "",
        "#endif",
        "",
    ]
    return "\n".join(lines)


MOST = 729
"""Neighbours that are tried at most: one tick to either side of six edges."""


def in_comment(text: str) -> str:
    """A text as it may stand in a comment of C, C++ or TOML: one printable line that neither begins nor ends one."""
    line = " ".join("".join(c if c.isprintable() else " " for c in text).split())
    return line.replace("*/", "* /").replace("/*", "/ *")


def in_ticks(period: float, tick: float) -> int:
    """Ticks in a period [s]. Raises InputError where a tick [s] is none, or longer than a hundredth of the period."""
    if not tick > 0.0:
        raise InputError(f"tick: expected a time above 0 s, got {tick:g} s")
    if period / tick > MOST_TICKS:
        raise InputError(f"tick: {tick:g} s is more than 1e15 times in a period of {period:g} s; give a longer one")
    count = round(period / tick)
    if count < FEWEST_TICKS:
        shown = format_quantity(float(f"{tick:.4g}"), "s")
        raise InputError(
            f"tick: a timer of {shown} has {count} ticks in a period of {period:g} s, expected at least 100"
        )
    return count


def neighbours(durations: Floats, total: int, rng: np.random.Generator) -> Ints:
    """Ticks (n, S) of plateaus, at least one each and ``total`` together, whose edges lie within a tick of those of the
    durations (S,); the first row is plain rounding."""
    edges = np.cumsum(durations)[:-1] / durations.sum() * total
    near = np.rint(edges)
    inner = len(edges)
    shifts = np.array(list(product((0, -1, 1), repeat=inner))) if 3**inner <= MOST else None
    if shifts is None:
        shifts = np.concatenate([np.zeros((1, inner), dtype=int), rng.integers(-1, 2, size=(MOST - 1, inner))])
    moved = near + shifts[np.argsort(np.abs(shifts).sum(axis=1), kind="stable")]
    ticks = np.diff(np.column_stack([np.zeros(len(moved)), moved, np.full(len(moved), total)]), axis=1)
    return ticks[(ticks >= 1).all(axis=1)].astype(np.int64)
