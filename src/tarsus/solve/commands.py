"""Commands to drives during a run: voltages of many robots from moments of their own on, and what the drives remember
of those before."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from tarsus.base.errors import InputError
from tarsus.model.drive.law import VoltageLaw
from tarsus.model.drive.lower import TERMS, lower_track
from tarsus.model.drive.output import amplified
from tarsus.model.drive.pieces import Channels
from tarsus.model.drive.signal import Signal
from tarsus.model.drive.track import Track, constant_track, joined, linear_track

if TYPE_CHECKING:
    from tarsus.model.robot import Drive

Floats = NDArray[np.float64]

MOST_VISITED = 24
"""Voltages that are kept before those that no play remembers are dropped."""


@dataclass(frozen=True)
class Command:
    """The command to one drive in nr robots, as R courses of voltage.

    which (nr,): the course of each; begun (R,) [s]: since when; past (R, H) [V]: visited before; level (R,) [V]: of
    courses that are one voltage each, which need no tracks; tracks: of others, the volts of the time since then, asked
    for and behind the amplifier. late (R, nl): of laws that go by the rate what they lag then (`VoltageLaw.late`).
    """

    which: NDArray[np.intp]
    begun: Floats
    past: Floats
    level: Floats | None
    tracks: tuple[Track, Track] | None
    late: Floats | None = None

    @property
    def asked(self) -> Track:
        """Volts of the time since then that are asked for."""
        return self.tracks[0] if self.tracks is not None else constant_track(self.level)

    @property
    def given(self) -> Track:
        """And those behind the amplifier."""
        return self.tracks[1] if self.tracks is not None else constant_track(self.level)

    @classmethod
    def own(cls, drive: Drive, wave: Signal, count: int, varied: bool) -> Command:
        """Of robots that follow a signal from their start on; varied: each has its own numbers of it."""
        courses = count if varied else 1
        asked = _of_runs(wave.track(), courses)
        past = np.broadcast_to(np.array(drive.history, dtype=float), (courses, len(drive.history)))
        which = np.arange(count) if varied else np.zeros(count, dtype=np.intp)
        given = _amplified(drive, asked, past)
        if not drive.law.by_rate:
            return cls(which, np.zeros(courses), past, None, (asked, given))
        late = np.tile(drive.law.late(given.picked(np.array([0])), drive.history), (courses, 1))
        return cls(which, np.zeros(courses), past, None, (asked, given), late)

    def changed(self, drive: Drive, asked: Track | Floats, time: Floats) -> Command:
        """Another course for all robots, or voltages (nr,) that are held, from times (nr,) [s] on."""
        late = self._lagging(drive, time) if drive.law.by_rate else None
        ideal, own = drive.amplifier.ideal, np.arange(len(time))
        past = self.visited(time) if drive.law.has_memory or not ideal else np.zeros((len(time), 0))
        if ideal and not isinstance(asked, Track):
            return Command(own, time.copy(), past, asked, None, late)
        track = asked if isinstance(asked, Track) else constant_track(asked)
        return Command(own, time.copy(), past, None, (track, _amplified(drive, track, past)), late)

    def _lagging(self, drive: Drive, time: Floats) -> Floats:
        """What the law lags (nr, nl) at times (nr,) [s], robot by robot."""
        assert self.late is not None
        given, since = self.given, time - self.begun[self.which]
        return np.array(
            [
                drive.law.late(given.picked(np.array([c])), tuple(self.past[c]), self.late[c], float(since[r]))
                for r, c in enumerate(self.which.tolist())
            ]
        )

    def with_runs(self, other: Command, robots: NDArray[np.intp]) -> Command:
        """The same, but for some robots that follow another command."""
        which = self.which.copy()
        which[robots] = len(self.begun) + other.which[robots]
        wide = max(self.past.shape[1], other.past.shape[1])
        past = np.concatenate([_padded(self.past, wide), _padded(other.past, wide)])[which]
        begun, own = np.concatenate([self.begun, other.begun])[which], np.arange(len(which))
        late = None
        if self.late is not None and other.late is not None:
            late = np.concatenate([self.late, other.late])[which]
        if self.level is not None and other.level is not None:
            return Command(own, begun, past, np.concatenate([self.level, other.level])[which], None, late)
        asked, given = joined([self.asked, other.asked]), joined([self.given, other.given])
        return Command(own, begun, past, None, (asked.picked(which), given.picked(which)), late)

    def volts(self, time: Floats, *, asked: bool = False) -> Floats:
        """Volts (nr,) at times (nr,) [s], those that are asked for or those behind the amplifier; after a jump."""
        if self.level is not None:
            return self.level[self.which]
        track = (self.asked if asked else self.given).picked(self.which)
        return _at(track, _within(track, time - self.begun[self.which]), after=True)

    def visited(self, time: Floats) -> Floats:
        """Volts (nr, H') visited by times (nr,) [s], the present ones last."""
        if self.level is not None:  # since some time: no step is of no length
            return remembered(np.concatenate([self.past, self.level[:, None]], axis=1)[self.which])
        track = self.given.picked(self.which)
        since = time - self.begun[self.which]
        if (track.loops >= 0).any():  # drives with a memory have forgotten all but the first rounds
            track = track.twice().twice()
        since = _within(track, since)
        last = np.where(since > 0.0, _at(track, since, after=False), np.nan)
        past = self.past[self.which]
        last = np.where(np.isnan(last), past[:, -1] if past.shape[1] else 0.0, last)
        counts = np.diff(track.runs)
        place = np.arange(track.count) - np.repeat(track.runs[:-1], counts)
        out = np.repeat(last[:, None], 2 * int(counts.max()) + 1, axis=1)
        begun, ended = (one < since[track.run] for one in (track.begin, track.end))
        out[track.run[begun], 2 * place[begun]] = track.first[begun]
        out[track.run[ended], 2 * place[ended] + 1] = track.last[ended]
        return remembered(np.concatenate([past, out], axis=1))

    def lowered(self, drive: Drive, charged: bool) -> tuple[Channels, Channels | None]:
        """Forces [N] of the courses by the robots' own time, and volts where they are asked for."""
        if self.late is None:
            force, volts = lower_track(self.given, drive.law, tuple(self.past.T), volts=charged)
        else:
            courses = [self.given.picked(np.array([c])) for c in range(len(self.begun))]
            parts = [
                lower_track(one, drive.law, tuple(past), volts=charged, late=late)
                for one, past, late in zip(courses, self.past, self.late, strict=True)
            ]
            force = Channels.joined([one for one, _ in parts])
            volts = Channels.joined([one for _, one in parts if one is not None]) if charged else None
        return self._by_time(force), self._by_time(volts) if charged and volts is not None else None

    def _by_time(self, channels: Channels) -> Channels:
        begun = np.repeat(self.begun, channels.counts)
        return replace(channels, begin=channels.begin + begun, end=channels.end + begun)

    def arrays(self) -> dict[str, Any]:
        """Its numbers by name, from which `of` makes it again."""
        out: dict[str, Any] = {"which": self.which, "begun": self.begun, "past": self.past}
        out |= {} if self.late is None else {"late": self.late}
        if self.tracks is None:
            return out | {"level": self.level}
        for name, track in zip(("asked", "given"), self.tracks, strict=True):
            parts = {one.name: getattr(track, one.name) for one in fields(Track)}
            out |= {f"{name}.{key}": value for key, value in parts.items() if value is not None}
        return out

    @classmethod
    def of(cls, arrays: Mapping[str, Any]) -> Command:
        """That of the numbers."""
        tracks = None
        if "level" not in arrays:
            asked, given = (
                Track(**{one.name: arrays.get(f"{name}.{one.name}") for one in fields(Track)})  # type: ignore[arg-type]
                for name in ("asked", "given")
            )
            tracks = asked, given
        return cls(arrays["which"], arrays["begun"], arrays["past"], arrays.get("level"), tracks, arrays.get("late"))


def held(
    commands: Sequence[tuple[Command, Drive, bool]], robots: int, varied: bool
) -> tuple[Channels, NDArray[np.int64]] | None:
    """What `Command.lowered` makes of commands that are one voltage each, at once: channels of all, and which (nr, nc)
    each robot is driven by, forces, then volts of charged drives. None of other commands, of laws that go by the rate,
    and where numbers of drives are ``varied`` of which a law knows one at a time."""
    values, volts = [], []
    for of, drive, charged in commands:
        if of.level is None or drive.law.by_rate or (varied and type(drive.law).held is VoltageLaw.held):
            return None
        values.append(drive.law.held(of.level, of.past))
        volts += [of.level] if charged else []
    courses = [of for of, _, _ in commands] + [of for of, _, charged in commands if charged]
    begin = np.concatenate([of.begun for of in courses])
    count = len(begin)
    coef = np.zeros((count, TERMS))
    coef[:, 0] = np.concatenate([*values, *volts])
    ones = np.ones(count, dtype=np.intp)
    channels = Channels(ones, -ones, begin, begin + 1.0, coef, ones.astype(bool), np.full(count, np.nan))
    which = np.empty((robots, len(courses)), dtype=np.int64)
    first = 0
    for c, of in enumerate(courses):
        which[:, c] = of.which + first
        first += len(of.begun)
    return channels, which


def row_of(given: Any, count: int) -> Floats | None:
    """One number for all robots, or one for each, as (nr,); None of anything else."""
    try:
        found = np.asarray(given, dtype=float)
        return np.broadcast_to(found, (count,)).copy() if found.ndim < 2 else None
    except (TypeError, ValueError):
        return None


def asked_of(name: str, wave: Any, count: int, since: Floats, seconds: float, ramp: bool) -> Track | Floats:
    """The course (nr) that a drive is asked for: voltages (nr,), held, or reached by a ramp from those ``since`` (nr,)
    [V] on, after so many seconds; or waveforms from now on. Raises InputError for what is neither."""
    if isinstance(wave, Signal):
        return _of_runs(wave.track(), count)
    if isinstance(wave, Sequence) and len(wave) and all(isinstance(one, Signal) for one in wave):
        if len(wave) != count:
            raise InputError(f"drive.{name}: expected a waveform for each of {count} robots, got {len(wave)}")
        return joined([_of_runs(one.track(), 1) for one in wave])
    if isinstance(wave, float) and count == 1 and not ramp and math.isfinite(wave):
        return np.array([wave])
    level = row_of(wave, count)
    if level is None:
        raise InputError(f"drive.{name}: expected volts, one or {count} numbers, or waveforms, got {wave!r}")
    if not np.isfinite(level).all():
        bad = level[~np.isfinite(level)][0]
        raise InputError(f"drive.{name}: expected finite volts, got {float(bad)!r}")
    return course(level, since, seconds, ramp) if ramp else level


def course(level: Any, since: Floats, seconds: float, ramp: bool) -> Track:
    """A voltage (nr,), which may carry derivatives: held, or reached from those before."""
    if not ramp:
        return constant_track(level)
    times = [np.zeros(len(since)), np.full(len(since), seconds)]
    return linear_track(times, [since], [level], periodic=False, hold=True)


def remembered(past: Floats) -> Floats:
    """Voltages (nr, H) visited one after the other, without those that larger moves since have wiped out: a drive with
    plays is in the same state after both. Only where there are many."""
    if past.shape[1] <= MOST_VISITED:
        return past
    kept = [_turns(row.tolist()) for row in past]
    wide = max(map(len, kept))
    return np.array([row + [row[-1]] * (wide - len(row)) for row in kept])


def _turns(volts: Sequence[float]) -> list[float]:
    """Extremes of a sequence that no later ones enclose; before the first there is 0 V, where drives are born, which is
    like an extreme of the same size on the other side."""
    out: list[float] = []
    for v in volts:
        if out and v == out[-1]:
            continue
        if len(out) > 1 and (v - out[-1]) * (out[-1] - out[-2]) > 0.0:
            out.pop()  # it only goes on
        elif len(out) == 1 and v * out[0] > 0.0 and abs(v) > abs(out[0]):
            out.pop()
        out.append(v)
        while len(out) > 2 and abs(out[-1] - out[-2]) >= abs(out[-2] - out[-3]):
            del out[-3:-1]
        if len(out) == 2 and abs(out[1]) >= abs(out[0]):
            del out[0]
    return out


def _padded(past: Floats, wide: int) -> Floats:
    """As many voltages of each: the last one again and again, 0 V where there is none."""
    left = wide - past.shape[1]
    last = past[:, -1:] if past.shape[1] else np.zeros((len(past), 1))
    return past if not left else np.concatenate([past, np.repeat(last, left, axis=1)], axis=1)


def _of_runs(track: Track, count: int) -> Track:
    """As many runs of the one, or those that there are."""
    if len(track.loops) == count:
        return track
    if len(track.loops) != 1:
        raise InputError(f"expected waveforms of {count} robots, got numbers of {len(track.loops)}")
    return track.picked(np.zeros(count, dtype=np.intp))


def _amplified(drive: Drive, asked: Track, past: Floats) -> Track:
    """What the amplifier makes of it, which gives the last of the past volts until then."""
    if drive.amplifier.ideal:
        return asked
    return amplified(asked, drive.amplifier.stage(), past[:, -1] if past.shape[1] else 0.0)


def _within(track: Track, since: Floats) -> Floats:
    """Times (R,) [s] of its runs, those of what repeats within its last round."""
    close = track.end[track.runs[1:] - 1]
    period = np.where(track.loops >= 0, track.periods, 1.0)
    over = (track.loops >= 0) & (since >= close)
    return np.where(over, close - period + np.fmod(since - close, period), since)


def _at(track: Track, since: Floats, *, after: bool) -> Floats:
    """Volts (R,) at times (R,) [s], where they jump those after or before."""
    begun = track.begin <= since[track.run] if after else track.begin < since[track.run]
    number = np.maximum(np.add.reduceat(begun.astype(np.intp), track.runs[:-1]) - 1, 0)
    stretch = track.runs[:-1] + number
    begin, end = track.begin[stretch], track.end[stretch]
    xi = np.clip(2.0 * (since - begin) / (end - begin) - 1.0, -1.0, 1.0)
    return np.where(xi == 1.0, track.last[stretch], track.values(stretch, xi))
