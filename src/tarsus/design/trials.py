"""Runs of on-off signals on grounds, as one batch, what the foot does in a period, and how many periods it takes to
become periodic, by measurement.

A signal of S plateaus is a row (2S,): the levels [V], then the durations [s].
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from tarsus.base.events import IMPACTS
from tarsus.base.spec import with_values
from tarsus.model.drive.waveforms import OnOff
from tarsus.orbits.starts import Box
from tarsus.plan.lowering import lower_scene
from tarsus.solve import Session

if TYPE_CHECKING:
    from tarsus.base.workers import Workers
    from tarsus.design.grounds import Grounds
    from tarsus.model.scene import Scene
    from tarsus.solve import Batch

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

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
STATED = 1e-4
"""Share within which a speed that is stated is that of the settled motion: a unit of the four digits shown."""


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


@dataclass
class Trials:
    """Runs of a scene in which one drive is given on-off signals and one foot is watched in the last period.

    periods: of a run; runs: how many have been made.
    """

    scene: Scene
    drive: str
    foot: str
    period: float
    periods: int = 2
    threads: Workers = None
    runs: int = 0

    def __post_init__(self) -> None:
        self._sessions: dict[int, Session] = {}
        self.number = list(self.scene.robot.feet).index(self.foot)

    @property
    def since(self) -> float:
        """When the last period of a run begins [s]."""
        return (self.periods - 1) * self.period

    def on(self, signals: Floats, grounds: Grounds) -> Landings:
        """All signals (n, 2S) on all grounds; (n, ng) each."""
        return self.each(*grounds.crossed(signals)).reshaped(len(signals), len(grounds))

    def each(self, signals: Floats, grounds: Mapping[str, Floats]) -> Landings:
        """Every signal (nr, 2S) on a ground of its own, values (nr,) by path; (nr,) each."""
        batch = self._batch(signals, grounds, self.periods)
        run, rows = self._touchdowns(batch, self.since)
        before, after = np.abs(rows["speed_before"]), np.abs(rows["speed_after"])
        lost = before - after  # of energy E = m (v-^2 - v+^2) / 2 and speeds follows the impulse m (v- + v+)
        impulses = np.where(lost > 0.0, 2.0 * rows["energy"] / np.where(lost > 0.0, lost, 1.0), 0.0)
        speed, impulse, touchdowns = (np.zeros(len(batch)) for _ in range(3))
        first = np.full(len(batch), np.inf)
        np.maximum.at(speed, run, before)
        np.maximum.at(impulse, run, impulses)
        np.add.at(touchdowns, run, 1.0)
        np.minimum.at(first, run, rows["time"] - self.since)
        names = ("contact_duration", "peak", "mean_height")
        found = batch.measured(names, period=self.period, skip=self.periods - 1)
        contact, peak, height = (np.asarray(found[name].per_foot)[:, self.number] for name in names)
        air = self.period - contact
        lifted = np.where(air > 0.0, height * self.period / np.where(air > 0.0, air, 1.0), 0.0)
        done = np.where(batch.done, 1.0, np.nan)
        every = (speed, impulse, touchdowns, first, contact, np.nan_to_num(peak), np.nan_to_num(lifted))
        return Landings(*(one * done for one in every))

    def speeds(self, signals: Floats, grounds: Grounds, periods: int) -> Floats:
        """Hardest touchdown [m/s] of every period (n, periods) of longer runs on the first ground; NaN where a run did
        not reach its end."""
        return self._by_period(
            self._batch(signals, grounds.rows(np.zeros(len(signals), dtype=np.int64)), periods), periods
        )

    def put_down(self, signal: OnOff, count: int) -> Floats:
        """Hardest touchdown [m/s] in the last `SEEN` of `LONGEST` periods (count,) of a signal, from so many starts
        that are spread evenly over the usual box of `tarsus.orbits.starts`; NaN where a run did not reach its end, and
        none at all where feet remember their contacts, whose box is not known."""
        scene = with_values(self.scene, {"signals": {**self.scene.signals, self.drive: signal}})
        if lower_scene(scene).laws.remembers:
            return np.zeros(0)
        box = Box.of(scene, None)
        self.runs += count
        batch = Session(box.scene).batch(box.values(box.drawn(count, 0)), LONGEST * self.period, threads=self.threads)
        return self._by_period(batch, LONGEST)[:, -SEEN:].max(axis=1)

    def _by_period(self, batch: Batch, periods: int) -> Floats:
        """Hardest touchdown [m/s] of every period (nr, periods) of runs."""
        run, rows = self._touchdowns(batch, 0.0)
        found = np.zeros((len(batch), periods))
        turn = np.clip(np.ceil(rows["time"] / self.period) - 1.0, 0.0, periods - 1.0).astype(np.int64)
        np.maximum.at(found, (run, turn), np.abs(rows["speed_before"]))
        return np.where(batch.done[:, None], found, np.nan)

    def numbers_of(self, events: NDArray[np.void]) -> Ints:
        """Numbers of the foot's touchdowns of the last period among the events of one run."""
        own = np.isin(events["kind"], IMPACTS) & (events["foot"] == self.number)
        return np.flatnonzero(own & (events["time"] > self.since))

    def _batch(self, signals: Floats, grounds: Mapping[str, Floats], periods: int) -> Batch:
        self.runs += len(signals)
        vary = dict(zip(self._paths(signals.shape[1] // 2), signals.T, strict=True))
        session = self._session(signals.shape[1] // 2)
        return session.batch(vary | dict(grounds), periods * self.period, threads=self.threads)

    def _touchdowns(self, batch: Batch, since: float) -> tuple[Ints, dict[str, Floats]]:
        """Touchdowns of the foot after an instant [s] in all runs of a batch: numbers (k,) of the runs, and columns."""
        names = ("time", "speed_before", "speed_after", "energy")
        runs, columns = [np.zeros(0, dtype=np.int64)], [np.zeros((len(names), 0))]
        for members, table in batch.tables():
            rows, own = table.events, np.repeat(members, np.diff(table.first))
            hits = np.flatnonzero(
                np.isin(rows["kind"], np.array(IMPACTS, dtype=float))
                & (rows["foot"] == self.number)
                & (rows["time"] > since)
            )
            runs.append(own[hits])
            columns.append(np.stack([rows[name][hits] for name in names]))
        return np.concatenate(runs), dict(zip(names, np.concatenate(columns, axis=1), strict=True))

    def _paths(self, plateaus: int) -> list[str]:
        """Of the levels, then of the durations, of a signal's plateaus."""
        return [f"signals.{self.drive}.{name}.{i}" for name in ("levels", "durations") for i in range(plateaus)]

    def _session(self, plateaus: int) -> Session:
        """The scene with an on-off signal of so many plateaus, whose plan stays."""
        if plateaus not in self._sessions:
            even = OnOff(levels=(0.0,) * plateaus, durations=(self.period / plateaus,) * plateaus, repeat=True)
            changed = with_values(self.scene, {"signals": {**self.scene.signals, self.drive: even}})
            self._sessions[plateaus] = Session(changed)
        return self._sessions[plateaus]


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


def settled_periods(
    trials: Trials, signals: Floats, grounds: Grounds, within: float = SAME, tried: Sequence[int] = TRIED
) -> int:
    """Fewest periods of a run, of those tried, whose last one is within a share what it is after `LONGEST`, for `SHARE`
    of the signals (n, 2S); the last of those tried where none is."""
    speeds = trials.speeds(signals, grounds, LONGEST)
    final = speeds[:, -1]
    scale = float(np.nanmax(final, initial=0.0))
    for periods in tried:
        same = np.abs(speeds[:, periods - 1] - final) <= within * np.maximum(final, 0.01 * scale)
        if float(np.mean(same[np.isfinite(final)])) >= SHARE:
            return periods
    return tried[-1]


def stated_periods(trials: Trials, signals: Floats, grounds: Grounds) -> int:
    """Periods after which a signal (1, 2S) is judged for what is stated of it: those of the trials, or more."""
    tried = [one for one in (*TRIED, 16, 24, LONGEST) if one > trials.periods]
    return settled_periods(trials, signals, grounds, STATED, [trials.periods, *tried])


def regime_of(trials: Trials, signals: Floats, grounds: Grounds) -> Regime:
    """The regime of one signal (1, 2S) on one ground."""
    speeds = trials.speeds(signals, grounds, LONGEST)[0, -SEEN:]
    spread = SAME * max(float(np.max(speeds, initial=0.0)), 1e-12)
    for repeats in (1, 2, 3, 4):
        if np.all(np.abs(speeds[repeats:] - speeds[:-repeats]) <= spread):
            return Regime(speeds, repeats)
    return Regime(speeds, 0)
