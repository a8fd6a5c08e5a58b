"""Voltage of a sweep: where, and how far, the force of a drive follows it like that of a linear one."""

from __future__ import annotations

import numpy as np

from tarsus.model.robot import Drive

SWEEP_V = 0.2
"""Amplitude of the sweeps [V]: low, as in section 2.3.1."""

_BIASES = np.arange(-8.0, 8.01, 1.0)
"""Voltages [V] about which a sweep may swing, those that the other records reach."""

_HARMONICS = 0.01
"""Harmonics over the fundamental of the drive's force up to which a sweep is good."""


def sweep_level(drive: Drive) -> tuple[float, float]:
    """Amplitude and offset [V] of the sweeps, as a laboratory tunes them on its device: about 0 V unless the force
    hardly follows the voltage there; then where it follows most, and weaker while it has harmonics."""
    if _following(drive, SWEEP_V, 0.0)[1] < _HARMONICS:
        return SWEEP_V, 0.0
    offset = max(_BIASES.tolist(), key=lambda volts: _following(drive, SWEEP_V, volts)[0])
    level = SWEEP_V
    while level > 0.1 * SWEEP_V and _following(drive, level, offset)[1] > _HARMONICS:
        level = 0.5 * level
    return level, offset


def _following(drive: Drive, level: float, offset: float) -> tuple[float, float]:
    """Fundamental of the force [N] under a small sine about a voltage, and its harmonics over it: of its second period,
    before which plays that move forget what was, and others add a constant."""
    cycle = np.sin(2.0 * np.pi * np.arange(256) / 256.0)
    volts = offset + level * np.concatenate([cycle, cycle])
    force = drive.law.force(volts)[256:]
    size = np.abs(np.fft.rfft(force))[1:] / 128.0
    return float(size[0]), float(np.linalg.norm(size[1:]) / size[0]) if size[0] > 0.0 else np.inf
