"""PoleCandidate poles of a band: those that models of many orders share, in the whole band and in parts of it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from tarsus.base.arrays import Complexes, Floats
from tarsus.modes.frf import Frf
from tarsus.modes.lscf import fit_poles, pole_tracks
from tarsus.modes.lsfd import background_columns, modal_columns, stacked

_SHARE_OF_ORDERS = 0.15
"""Part of the orders that must have a pole: weak modes appear late."""
_FEWEST_ORDERS = 8
"""Orders that suffice; by chance poles of noise agree in three or four."""
_HEAVIEST = 0.3
"""Damping ratio beyond which a pole is background."""
_PART = 160
"""Lines of a part: eight for each of twenty orders."""
_MOST_PARTS = 31
"""Parts at most, so that wide bands cost no more."""
_PART_ORDER = 20
"""Order of the models of a part, for ten modes in it."""
_CLEAR = 0.7
"""Share of the response that a pole of a part must make up: poles of few lines fit noise more easily."""
_WIDEST = 1.0 / 16.0
"""Half-power half-width over the part up to which a pole differs from background: its band is an eighth."""


class PoleCandidate(NamedTuple):
    """A pole [rad/s]; orders: how many models have it; strength: its largest peak in units of the root mean square of a
    response in the whole band."""

    pole: complex
    orders: int
    strength: float


def candidate_poles(band: Frf, poles: dict[int, Complexes], smallest: float) -> list[PoleCandidate]:
    """Poles of the whole band that may be modes, strongest first.

    Parameters
    ----------
    band
        Responses.
    poles
        Of models of the whole band by order [rad/s].
    smallest
        Share of the response that a mode must make up near its own frequency, in at least one channel.
    """
    return sorted(_weighty(band, poles, smallest, _level(band)), key=lambda one: -one.strength)


def poles_of_parts(band: Frf, smallest: float) -> list[PoleCandidate]:
    """Poles of parts of the band that may be modes, strongest first.

    In a wide band models spend their order on the wide and strong resonances. So models of order 20 and less are fitted
    to overlapping parts of 160 lines or more. A pole counts if both parts that it lies in have it, if its half-power
    band is less than an eighth of the part, and if it makes up at least 70 % of the response near its own frequency, or
    ``smallest`` where that is more.

    Parameters
    ----------
    band, smallest
        As in `candidate_poles`.
    """
    level, parts = _level(band), list(_parts(band))
    found = []
    for part in parts:
        orders = range(2, min(_PART_ORDER, len(part.frequency) // 4) + 1)
        poles = fit_poles(part.frequency, part.values, orders)
        widest = _WIDEST * 2.0 * np.pi * part.line * len(part.frequency)
        here = _weighty(part, poles, max(smallest, _CLEAR), level)
        found.append([one for one in here if abs(one.pole.real) < widest])
    common = []
    for k, here in enumerate(found):
        low = parts[k - 1].frequency[-1] if k else -np.inf
        high = parts[k + 1].frequency[0] if k + 1 < len(parts) else np.inf
        following = found[k + 1] if k + 1 < len(parts) else []
        for one in here:
            alone = low < one.pole.imag / (2.0 * np.pi) < high
            if alone or any(abs(one.pole - other.pole) <= reach(one.pole, band.line) for other in following):
                common.append(one)
    return sorted(common, key=lambda one: -one.strength)


def reach(pole: complex, line: float) -> float:
    """Half a half-power band, or half the line spacing where that is more [rad/s]."""
    return max(abs(pole.real), np.pi * line)


def _level(band: Frf) -> Floats:
    """Root mean square of every response (nc,)."""
    return np.sqrt(np.mean(np.abs(band.values.reshape(-1, len(band.frequency))) ** 2, axis=1))


def _parts(band: Frf) -> Iterator[Frf]:
    """Parts of a band, each overlapping the next by half; none where there is only one."""
    count = len(band.frequency)
    half = max(_PART // 2, -(-count // (_MOST_PARTS + 1)))
    for start in range(0, count - 2 * half, half):
        stop = count if start + 3 * half > count else start + 2 * half
        yield band.lines(slice(start, stop))


def _weighty(part: Frf, poles: dict[int, Complexes], smallest: float, level: Floats) -> list[PoleCandidate]:
    """Poles that eight orders, or 15 %, have in common and that make up enough of the response; the others are dropped,
    weakest first."""
    fewest = max(_SHARE_OF_ORDERS * len(poles), min(_FEWEST_ORDERS, len(poles) / 3.0))
    tracks = [(pole, count) for pole, count in pole_tracks(poles, part.line) if count >= fewest and _sought(pole, part)]
    found = np.array([pole for pole, _ in tracks], dtype=complex)
    alive, strength = _shares(part, found, smallest, level)
    return [PoleCandidate(*tracks[k], size) for k, size in zip(alive, strength, strict=True)]


def _sought(pole: complex, frf: Frf) -> bool:
    """Whether a pole lies inside the band and is a mode of it rather than its background."""
    f = pole.imag / (2.0 * np.pi)
    inside = frf.frequency[0] + 2.0 * frf.line < f < frf.frequency[-1] - 2.0 * frf.line
    span = frf.frequency[-1] - frf.frequency[0]
    return bool(inside and abs(pole.real) < _HEAVIEST * abs(pole) and abs(pole.real) / np.pi < span / 2.0)


def _shares(part: Frf, poles: Complexes, smallest: float, level: Floats) -> tuple[Sequence[int], Sequence[float]]:
    """Which poles make up at least a share of some response in their half-power band, and their strength."""
    frequency, line = part.frequency, part.line
    channels = part.values.reshape(-1, len(frequency))
    half = np.maximum(np.abs(poles.real), np.pi * line) / (2.0 * np.pi)
    near = np.abs(frequency - poles.imag[:, None] / (2.0 * np.pi)) <= half[:, None]
    count = np.maximum(near.sum(axis=1), 1)
    local = np.sqrt((np.abs(channels) ** 2) @ near.T / count)
    unit = np.abs(1.0 / (2.0j * np.pi * frequency - poles[:, None])) ** 2
    gain = np.sqrt(np.sum(unit * near, axis=1) / count)
    columns = np.concatenate([modal_columns(frequency, poles), background_columns(frequency, 2)], axis=1)
    design = stacked(columns, 0)
    scale = np.linalg.norm(design, axis=0)
    basis, triangle = np.linalg.qr(design / scale)
    target = basis.T @ stacked(channels, 1).T
    alive = np.arange(len(poles))
    while len(alive):
        used = np.concatenate([alive, alive + len(poles), np.arange(2 * len(poles), len(scale))])
        found = np.linalg.lstsq(triangle[:, used], target, rcond=None)[0] / scale[used, None]
        size = np.abs(found[: len(alive)] + 1.0j * found[len(alive) : 2 * len(alive)]).T * gain[alive]
        share = np.max(_ratio(size, local[:, alive]), axis=0)
        weakest = int(np.argmin(share))
        if share[weakest] >= smallest:
            return alive.tolist(), np.max(_ratio(size, level[:, None]), axis=0).tolist()
        alive = np.delete(alive, weakest)
    return [], []


def _ratio(above: Floats, below: Floats) -> Floats:
    out = np.zeros(np.broadcast_shapes(above.shape, below.shape))
    return np.divide(above, below, out=out, where=below > 0.0)
