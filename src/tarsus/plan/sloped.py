"""Drives of straight lines with their derivatives in closed form, by however many numbers of their waveforms.

On each part of a stretch the force is a cubic of the voltage, so its derivative at a fixed place of the stretch is that
cubic's slope times the voltage's own, and what plays at rest remember. Where parts meet inside a stretch the force is
continuous: that they meet elsewhere changes nothing to first order.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tarsus.model.drive.laws import LinearForce
from tarsus.model.drive.parts import IDENTITY, Parts, to_pieces, whole_parts
from tarsus.model.drive.pieces import Pieces
from tarsus.model.drive.track import Track, TrackSlopes
from tarsus.model.scene import Scene
from tarsus.plan.channels import felt

__all__ = ["Sloped", "SlopedDrive", "sloped_drives"]

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Sloped:
    """A channel and its derivatives by P numbers: of its Q pieces, with that of a held last value, coef (Q, terms, P)
    at fixed numbers in them, begin, end (Q, P) [s]; of its period, loop (P,) [s]."""

    pieces: Pieces
    coef: Floats
    begin: Floats
    end: Floats
    loop: Floats


@dataclass(frozen=True)
class SlopedDrive:
    """Force of a drive, and its volts where they are asked for; period [s] of its signal, None without one, and its
    derivatives (P,)."""

    force: Sloped
    volts: Sloped | None
    period: float | None
    by_period: Floats


def sloped_drives(
    scene: Scene, directions: Sequence[Mapping[str, float]], charged: Collection[str]
) -> tuple[dict[str, SlopedDrive], list[dict[str, float]]]:
    """Those drives, by name, of which all that moves along directions (P) of a scene has derivatives in closed form,
    and what is left of the directions. charged: drives whose volts are asked for."""
    moves: dict[str, dict[str, Floats]] = {}
    lost: set[str] = set()
    taken: list[tuple[int, str, str]] = []
    for p, one in enumerate(directions):
        for path, weight in one.items():
            keys = path.split(".")
            if keys[0] == "signals" and len(keys) == 4:
                name, field, number = keys[1:]
            elif keys[:2] == ["robot", "drives"] and keys[3:4] != ["load"] and len(keys) > 4:
                name, field, number = keys[2], ".".join(keys[3:]), "0"
            else:
                lost.update(keys[1:2] if keys[0] == "signals" else ())
                continue
            if name in lost or not felt(path) or name not in scene.signals or name not in scene.robot.drives:
                continue
            columns = moves.setdefault(name, {})
            if field not in columns:
                columns[field] = np.zeros((_size(scene, name, field), len(directions)))
            if number.isdecimal() and int(number) < len(columns[field]):
                columns[field][int(number), p] += weight
                taken.append((p, path, name))
            else:
                lost.add(name)
    found = {
        name: _sloped(scene, name, one, name in charged) for name, one in moves.items() if name not in lost
    }
    drives = {name: one for name, one in found.items() if one is not None}
    rest = [dict(one) for one in directions]
    for p, path, name in taken:
        if name in drives:
            del rest[p][path]
    return drives, rest


def _size(scene: Scene, name: str, field: str) -> int:
    """Numbers in a field of a drive or its signal; 0 of one that is not known here."""
    if "." in field:
        known = field in ("law.gain", "law.offset") and isinstance(scene.robot.drives[name].law, LinearForce)
        return int(known)
    wave = scene.signals[name]
    values = getattr(wave, field) if field in type(wave).model_fields else None
    return len(values) if isinstance(values, tuple) else 0


def _sloped(scene: Scene, name: str, moves: Mapping[str, Floats], charged: bool) -> SlopedDrive | None:
    drive, wave = scene.robot.drives[name], scene.signals[name]
    own = {field: column for field, column in moves.items() if "." not in field}
    if not own or not drive.amplifier.ideal:
        return None
    found = wave.sloped(own)
    if found is None:
        return None
    track, slopes = found
    period, by_period = (track.period, slopes.start[-1]) if track.periodic else (None, 0.0 * slopes.start[0])
    volts = _channel(track, slopes, whole_parts(track, IDENTITY), 0.0) if charged else None
    law = drive.law
    if track.periodic and law.has_memory:
        slopes, track = slopes.twice(track), track.twice()
    parts = law.parts(track, drive.history)
    remembered = law.remembered(track, drive.history, parts, slopes)
    force = _channel(track, slopes, parts, remembered)
    if force is None or (charged and volts is None):
        return None
    if len(own) < len(moves):
        none, count = np.zeros((1, len(by_period))), track.count
        gain, offset = (moves.get(f"law.{field}", none)[0] for field in ("gain", "offset"))
        force.coef[:count, :2] += track.inner[:, :2, None] * gain
        force.coef[count:, 0] += track.last[-1] * gain
        force.coef[:, 0] += offset
    return SlopedDrive(force, volts, period, by_period)


def _channel(track: Track, slopes: TrackSlopes, parts: Parts, remembered: Floats | float) -> Sloped | None:
    """Parts of a track as a channel; None where some of them are too short to be told apart."""
    pieces = to_pieces(track, parts, track.loop if track.periodic else -1)
    if pieces.count != len(parts.stretch):
        return None
    of, l1, l2, l3 = parts.stretch, *parts.law.T[1:]
    middle, half = 0.5 * (parts.low + parts.high), 0.5 * (parts.high - parts.low)
    level, rise = track.inner[of, 0] + middle * track.inner[of, 1], half * track.inner[of, 1]
    steep = np.stack(
        [l1 + (2.0 * l2 + 3.0 * l3 * level) * level, (2.0 * l2 + 6.0 * l3 * level) * rise, 3.0 * l3 * rise**2]
    )
    first, last = slopes.first[of], slopes.last[of]
    level_by, rise_by = 0.5 * (last + first), 0.5 * (last - first)
    if (half != 1.0).any():
        level_by, rise_by = level_by + middle[:, None] * rise_by, half[:, None] * rise_by
    terms = 2 + int(np.flatnonzero(steep.any(axis=1)).max(initial=0))
    count, held = (
        len(of),
        int(not track.periodic),
    )  # a piece for the value after the last one, unless it repeats
    coef = np.zeros((count + held, terms, first.shape[1]))
    for k in range(terms - 1):
        coef[:count, k] += steep[k][:, None] * level_by
        coef[:count, k + 1] += steep[k][:, None] * rise_by
    coef[:count, 0] += remembered
    coef[count:, 0] = coef[count - 1].sum(axis=0)
    begin = slopes.start[of]
    if (parts.low != -1.0).any():
        begin = begin + (0.5 * (parts.low + 1.0))[:, None] * (slopes.start[of + 1] - begin)
    begin = np.concatenate([begin, slopes.start[-1:]])
    loop = slopes.start[-1] - slopes.start[track.loop] if track.periodic else 0.0 * begin[0]
    end = begin[1:] if track.periodic else np.concatenate([begin[1:], 0.0 * begin[:1]])
    return Sloped(pieces, coef, begin[: count + held], end, loop)
