"""Energy of a switched drive: C dV^2 for every rise (`tarsus.measure.switching`), of many signals at once."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tarsus.model.drive.waveforms import OnOff
from tarsus.model.robot import Drive

Floats = NDArray[np.float64]

RECOVERY = 2.0 / 3.0
"""Share of the charge that a supply with charge recovery gets back, where the drive does not say: with it one third of
the energy of plain on-off switching is drawn."""


def energies(drive: Drive, squares: Floats, unsaid: float = RECOVERY) -> tuple[Floats, Floats]:
    """Energy [J] of sums of squared rises [V^2], plain and with charge recovery; NaN where the voltage of a drive
    without capacitance rises. unsaid: share that a drive recovers which does not say."""
    plain = np.where(squares > 0.0, (np.nan if drive.capacitance is None else drive.capacitance) * squares, 0.0)
    return plain, (1.0 - (unsaid if drive.recovery is None else drive.recovery)) * plain


def energy_of(drive: Drive, signal: OnOff) -> tuple[float, float]:
    """Plain energy and that with charge recovery [J] of a period of a signal that repeats."""
    plain, recovered = energies(drive, period_rises(np.array([signal.levels])))
    return float(plain[0]), float(recovered[0])


def period_rises(levels: Floats) -> Floats:
    """Sum (n,) [V^2] of the squared rises, from every low to the next high, of levels (n, S) that repeat."""
    begin = np.argmin(levels, axis=1)
    around = (begin[:, None] + np.arange(levels.shape[1] + 1)) % levels.shape[1]
    volts = np.take_along_axis(levels, around, axis=1)  # from a lowest voltage on, once around
    total, low, high = np.zeros(len(volts)), volts[:, 0], volts[:, 0]
    for level in volts.T[1:]:
        falls = level < high
        total = total + np.where(falls, (high - low) ** 2, 0.0)
        low, high = np.where(falls, level, low), level.copy()
    return total + (high - low) ** 2
