"""How many periods a motion needs to become periodic, by measurement; and what it becomes."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from tarsus.design.over import Grounds
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
_TRIED = (2, 3, 4, 6, 8, 12)


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


def settled_periods(trials: Trials, levels: Floats, durations: Floats, grounds: Grounds) -> int:
    """Fewest periods of a run whose last one is, for `SHARE` of the signals (n, S), what it is after `LONGEST`."""
    final = replace(trials, periods=LONGEST)(levels, durations, grounds).speed
    scale = float(np.nanmax(final, initial=0.0))
    for periods in _TRIED:
        found = replace(trials, periods=periods)(levels, durations, grounds).speed
        same = np.abs(found - final) <= SAME * np.maximum(final, 0.01 * scale)
        if float(np.mean(same[np.isfinite(final)])) >= SHARE:
            return periods
    return _TRIED[-1]


def regime_of(trials: Trials, levels: Floats, durations: Floats, grounds: Grounds) -> Regime:
    """The regime of one signal (1, S) on one ground."""
    speeds = np.array(
        [
            replace(trials, periods=LONGEST - SEEN + k + 1)(levels, durations, grounds).speed[0, 0]
            for k in range(SEEN)
        ]
    )
    spread = SAME * max(float(np.max(speeds, initial=0.0)), 1e-12)
    for repeats in (1, 2, 3, 4):
        if np.all(np.abs(speeds[repeats:] - speeds[:-repeats]) <= spread):
            return Regime(speeds, repeats)
    return Regime(speeds, 0)
