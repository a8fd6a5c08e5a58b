"""Runs of on-off signals on grounds, as one batch, and what the foot does in their last period.

A signal of S plateaus is a row (2S,): the levels [V], then the durations [s].
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from tarsus.base.events import IMPACTS

if TYPE_CHECKING:
    from tarsus.design.grounds import Grounds
    from tarsus.design.pulse_train import PulseTrain
    from tarsus.design.runs import Runs
    from tarsus.solve import Batch

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


@dataclass(frozen=True)
class Landings:
    """What one foot does in a period, of n candidates on ng grounds, each (n, ng).

    speed [m/s]: of the hardest touchdown; impulse [N s]: the largest of a touchdown; touchdowns: number of them, those
    of chatter included; first [s]: when the first one comes after the landing edge, infinite without one; contact [s];
    peak [m]: highest gap; lifted [m]: mean gap while in the air. NaN: the run did not reach its end. A foot that never
    touches has speed, impulse and touchdowns 0, and contact 0 or the whole period.
    """

    speed: Floats
    impulse: Floats
    touchdowns: Floats
    first: Floats
    contact: Floats
    peak: Floats
    lifted: Floats

    def reshaped(self, *shape: int) -> Landings:
        return Landings(*(getattr(self, one.name).reshape(shape) for one in fields(self)))


@dataclass(frozen=True)
class Trials:
    """Runs in which the foot of pulses is watched in the last period."""

    runs: Runs

    @property
    def train(self) -> PulseTrain:
        """Signals, rows (2S,), that runs take."""
        assert self.runs.free.pulses is not None
        return self.runs.free.pulses

    def on(self, signals: Floats, grounds: Grounds) -> Landings:
        """All signals (n, 2S) on all grounds; (n, ng) each."""
        return self.each(*grounds.crossed(signals)).reshaped(len(signals), len(grounds))

    def each(self, signals: Floats, grounds: Mapping[str, Floats]) -> Landings:
        """Every signal (nr, 2S) on a ground of its own, values (nr,) by path; (nr,) each."""
        batch, period = self.runs.batch(signals, grounds), self.train.step.period
        number, since = list(self.runs.scene.robot.feet).index(self.train.foot), self.runs.duration - period
        run, rows = _touchdowns(batch, number, since)
        before, after = np.abs(rows["speed_before"]), np.abs(rows["speed_after"])
        lost = before - after  # of energy E = m (v-^2 - v+^2) / 2 and speeds follows the impulse m (v- + v+)
        impulses = np.where(lost > 0.0, 2.0 * rows["energy"] / np.where(lost > 0.0, lost, 1.0), 0.0)
        speed, impulse, touchdowns = (np.zeros(len(batch)) for _ in range(3))
        first = np.full(len(batch), np.inf)
        np.maximum.at(speed, run, before)
        np.maximum.at(impulse, run, impulses)
        np.add.at(touchdowns, run, 1.0)
        np.minimum.at(first, run, rows["time"] - since)
        names = ("contact_duration", "peak", "mean_height")
        found = batch.measured(names, period=period, skip=round(since / period))
        contact, peak, height = (np.asarray(found[name].per_foot)[:, number] for name in names)
        air = period - contact
        lifted = np.where(air > 0.0, height * period / np.where(air > 0.0, air, 1.0), 0.0)
        done = np.where(batch.done, 1.0, np.nan)
        every = (speed, impulse, touchdowns, first, contact, np.nan_to_num(peak), np.nan_to_num(lifted))
        return Landings(*(one * done for one in every))


def _touchdowns(batch: Batch, foot: int, since: float) -> tuple[Ints, dict[str, Floats]]:
    """Touchdowns of a foot after an instant [s] in all runs of a batch: numbers (k,) of the runs, and columns."""
    names = ("time", "speed_before", "speed_after", "energy")
    runs, columns = [np.zeros(0, dtype=np.int64)], [np.zeros((len(names), 0))]
    for members, table in batch.tables():
        rows, own = table.events, np.repeat(members, np.diff(table.first))
        hits = np.flatnonzero(
            np.isin(rows["kind"], np.array(IMPACTS, dtype=float)) & (rows["foot"] == foot) & (rows["time"] > since)
        )
        runs.append(own[hits])
        columns.append(np.stack([rows[name][hits] for name in names]))
    return np.concatenate(runs), dict(zip(names, np.concatenate(columns, axis=1), strict=True))
