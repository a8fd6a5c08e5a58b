"""Candidates on grounds: every signal on every ground as one batch, and what the foot does in a period."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from tarsus.base.events import IMPACTS
from tarsus.base.spec import with_values
from tarsus.base.workers import Workers
from tarsus.design.over import Grounds
from tarsus.model.drive.waveforms import OnOff
from tarsus.model.scene import Scene
from tarsus.solve.codes import EventColumns
from tarsus.solve.gradients import GradientBatch, GradientRun
from tarsus.solve.results import Batch, Part
from tarsus.solve.session import Session

__all__ = ["Landings", "Trials", "landings_of"]

Floats = NDArray[np.float64]


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

    @property
    def failed(self) -> NDArray[np.bool_]:
        """Runs that did not reach their end."""
        return np.isnan(self.speed)


@dataclass
class Trials:
    """Runs of a scene in which one drive is given on-off signals and one foot is watched.

    periods: of a run; counted: how many of its last ones are looked at. runs: how many have been made.
    """

    scene: Scene
    drive: str
    foot: str
    period: float
    periods: int = 2
    counted: int = 1
    threads: Workers = None
    runs: int = 0

    def __post_init__(self) -> None:
        self._sessions: dict[int, Session] = {}

    def __call__(
        self, levels: Floats, durations: Floats, grounds: Grounds, *, every: bool = False
    ) -> Landings:
        """All candidates, levels [V] and durations [s] (n, S), on all grounds; ``every``: candidate i on ground i."""
        count, ng = len(levels), len(grounds)
        if every:
            who, where = np.arange(count), np.arange(ng)
        else:
            who, where = np.repeat(np.arange(count), ng), np.tile(np.arange(ng), count)
        batch = self.batch(levels[who], durations[who], {p: own[where] for p, own in grounds.values.items()})
        found = landings_of(batch, self.foot, self.period, self.periods, self.counted)
        return found if every else found.reshaped(count, ng)

    def batch(self, levels: Floats, durations: Floats, values: Mapping[str, Floats]) -> Batch:
        """Runs (nr,) of signals (nr, S) with other numbers (nr,) by path."""
        self.runs += len(levels)
        vary = dict(zip(self.paths(levels.shape[1]), [*durations.T, *levels.T], strict=True))
        session = self._session(levels.shape[1])
        return session.batch(vary | dict(values), self.periods * self.period, threads=self.threads)

    def sloped(
        self, levels: Floats, durations: Floats, values: Mapping[str, Floats], moving: Sequence[int]
    ) -> tuple[GradientRun, ...]:
        """Runs (nr,) of one signal (S,) on grounds of other numbers (nr,) by path, with derivatives by those of
        ``moving`` among `paths`."""
        every = self.paths(len(levels))
        own = zip(every, [*durations, *levels], strict=True)
        count = len(next(iter(values.values()))) if values else 1
        vary = {path: np.full(count, value) for path, value in own}
        found = self._session(len(levels)).batch(
            vary | dict(values), self.periods * self.period, threads=self.threads,
            gradients=[every[i] for i in moving],
        )  # fmt: skip
        assert isinstance(found, GradientBatch)
        self.runs += len(found)
        return found.made

    def approach(self, levels: Floats, durations: Floats, until: float) -> tuple[float, Floats]:
        """An instant [s] of the last period counted, ``until`` or just before the foot first touches where that comes
        first, and the structure's displacements and velocities (2n,) then."""
        self.runs += 1
        own = zip(self.paths(len(levels)), [*durations.tolist(), *levels.tolist()], strict=True)
        session = self._session(len(levels))
        since = (self.periods - self.counted) * self.period
        run = session.run(dict(own), self.periods * self.period)
        events = run.events
        mine = events["foot"] == list(self.scene.robot.feet).index(self.foot)
        within = (events["time"] > since) & (events["time"] <= since + until)
        hits = events["time"][mine & within & np.isin(events["kind"], IMPACTS)]
        time = float(hits[0]) * (1.0 - 1e-12) if len(hits) else since + until
        found = run.states(np.array([time]))
        return time - since, np.concatenate([found.x[:, 0], found.v[:, 0]])

    def paths(self, plateaus: int) -> list[str]:
        """Of the durations, then of the levels, of a signal's plateaus."""
        return [f"signals.{self.drive}.{name}.{i}" for name in ("durations", "levels") for i in range(plateaus)]

    def _session(self, plateaus: int) -> Session:
        """The scene with an on-off signal of so many plateaus, whose plan stays."""
        if plateaus not in self._sessions:
            even = OnOff(levels=(0.0,) * plateaus, durations=(self.period / plateaus,) * plateaus, repeat=True)
            changed = with_values(self.scene, {"signals": {**self.scene.signals, self.drive: even}})
            self._sessions[plateaus] = Session(changed)
        return self._sessions[plateaus]


def landings_of(batch: Batch, foot: str, period: float, periods: int, counted: int) -> Landings:
    """What a foot does in the last ``counted`` of ``periods`` periods [s] of every run of a batch; (nr,) each."""
    number = list(batch.scene.robot.feet).index(foot)
    speed, impulse, touchdowns, first = (np.zeros(len(batch)) for _ in range(4))
    first[:] = np.inf
    since = (periods - counted) * period
    for part in batch.parts:
        _touchdowns(part, number, since, speed, impulse, touchdowns, first)
    names = ("contact_duration", "peak", "mean_height")
    found = batch.measured(names, period=period, skip=periods - counted)
    contact, peak, height = (_of_foot(found[name], number) for name in names)
    air = period - contact
    lifted = np.where(air > 0.0, height * period / np.where(air > 0.0, air, 1.0), 0.0)
    done = np.where(batch.done, 1.0, np.nan)
    return Landings(
        speed * done, impulse * done, touchdowns / counted * done, (first - since) * done, contact * done,
        np.nan_to_num(peak) * done, np.nan_to_num(lifted) * done,
    )  # fmt: skip


def _of_foot(measured: object, number: int) -> Floats:
    per_foot = getattr(measured, "per_foot", None)
    assert per_foot is not None
    return per_foot[:, number]


def _touchdowns(
    part: Part, foot: int, since: float, speed: Floats, impulse: Floats, touchdowns: Floats, first: Floats
) -> None:
    """Enter the touchdowns of a foot after an instant [s] into the numbers (nr,) of a whole batch.

    The impulse follows from the energy that an impact takes, E = m (v-^2 - v+^2) / 2, and its speeds: m (v- + v+).
    """
    rows = EventColumns([part.log.events])
    own = np.repeat(part.members, np.diff(part.log.event_end, prepend=0))
    hits = np.flatnonzero(
        np.isin(rows["kind"], np.array(IMPACTS, dtype=float))
        & (rows["foot"] == foot)
        & (rows["time"] > since)
    )
    run, before, after = own[hits], np.abs(rows["speed_before"][hits]), np.abs(rows["speed_after"][hits])
    lost = before - after
    blow = np.where(lost > 0.0, 2.0 * rows["energy"][hits] / np.where(lost > 0.0, lost, 1.0), 0.0)
    np.maximum.at(speed, run, before)
    np.maximum.at(impulse, run, blow)
    np.add.at(touchdowns, run, 1.0)
    np.minimum.at(first, run, rows["time"][hits])
