"""How many periods a motion needs to become periodic, by measurement; and what it becomes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tarsus.design.grounds import Grounds
from tarsus.design.trials import Trials

__all__ = ["Regime", "regime_of", "settled_periods"]

Floats = NDArray[np.float64]

SAME = 0.01
"""Touchdown speeds within this share are the same: a tenth of the scatter of a measured coefficient of restitution."""
SHARE = 0.95
"""Share of a sample of signals that must have settled: a few grazing ones never do, and are judged at the end."""
LONGEST = 32
"""Periods after which a motion is taken for what it will stay: a mode of damping ratio 1 % at 30 oscillations a period
has forgotten its start long before."""
SEEN = 8
"""Last periods that are compared: enough to see a motion that repeats after two or four."""
TRIED = (2, 3, 4, 6, 8, 12)
"""Lengths of a run in periods: longer ones are of motions that hardly settle, and every candidate pays for them."""


@dataclass(frozen=True)
class Regime:
    """What the periodic motion is. speeds (np,) [m/s]: hardest touchdown of each of the last periods; repeats: after
    how many periods, 0 where it does not within `SEEN`."""

    speeds: Floats
    repeats: int

    @property
    def words(self) -> str:
        if self.repeats == 1:
            return "periodic"
        if self.repeats:
            return f"repeats after {self.repeats} periods"
        return f"not periodic: touchdowns of {self.speeds.min():.3g} to {self.speeds.max():.3g} m/s"


def settled_periods(trials: Trials, signals: Floats, grounds: Grounds) -> int:
    """Fewest periods of a run whose last one is, for `SHARE` of the signals (n, 2S), what it is after `LONGEST`."""
    speeds = trials.speeds(signals, grounds, LONGEST)
    final = speeds[:, -1]
    scale = float(np.nanmax(final, initial=0.0))
    for periods in TRIED:
        same = np.abs(speeds[:, periods - 1] - final) <= SAME * np.maximum(final, 0.01 * scale)
        if float(np.mean(same[np.isfinite(final)])) >= SHARE:
            return periods
    return TRIED[-1]


def regime_of(trials: Trials, signals: Floats, grounds: Grounds) -> Regime:
    """The regime of one signal (1, 2S) on one ground."""
    speeds = trials.speeds(signals, grounds, LONGEST)[0, -SEEN:]
    spread = SAME * max(float(np.max(speeds, initial=0.0)), 1e-12)
    for repeats in (1, 2, 3, 4):
        if np.all(np.abs(speeds[repeats:] - speeds[:-repeats]) <= spread):
            return Regime(speeds, repeats)
    return Regime(speeds, 0)
