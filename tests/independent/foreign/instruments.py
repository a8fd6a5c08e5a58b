"""What instruments add to a channel: coarse steps, lost fringes, coloured noise, a slow high-pass."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.signal import butter, lfilter

from independent.foreign.world import World

Floats = NDArray[np.float64]
FRINGE = 316.4e-9
"""Half a wavelength [m], by which a displacement is off once its decoder has lost a fringe."""
LOST = 4
"""Samples at most that a drop-out of the light lasts."""


def noise(count: int, size: float, world: World, random: np.random.Generator) -> Floats:
    """Noise of a channel (count,), white or with a power that falls along a power of the frequency."""
    white = random.standard_normal(count)
    if not world.colour:
        return size * white
    lines = np.arange(count // 2 + 1, dtype=float)
    lines[0] = 1.0
    out = np.fft.irfft(np.fft.rfft(white) * lines ** (-0.5 * world.colour), count)
    return size * out / out.std()


def seen_by(
    motion: Floats, rate: float, quantity: str, still: float, world: World, random: np.random.Generator
) -> Floats:
    """A channel as its instrument shows it: behind a high-pass whose capacitor has settled at what the channel is at
    rest but for its noise (``still``), with drop-outs, in steps of its range."""
    out = motion
    if world.coupled and quantity == "x":
        b, a = butter(1, 2.0 * world.coupled / rate, "high")
        out = still + lfilter(b, a, out - still)
    if world.high_v and quantity == "v":
        b, a = butter(1, 2.0 * world.high_v / rate, "high")
        out = lfilter(b, a, out)
    if world.lost:
        out = out.copy()
        for at in random.integers(0, len(out), random.poisson(world.lost * len(out) / rate)).tolist():
            for_ = slice(at, at + 1 + int(random.integers(LOST)))
            if quantity == "v":
                out[for_] += np.ptp(motion) * random.uniform(-0.5, 0.5)
            else:
                out[at:] += FRINGE * float(random.integers(-2, 3))
    if world.bits:
        step = 4.0 * np.ptp(out) / 2.0**world.bits
        out = step * np.round(out / step)
    return out
