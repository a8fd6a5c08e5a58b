"""Drive channels of many runs at once: what varied numbers of a drive make of its force and its volts.

Where a linear force follows an ideal amplifier, a periodic wave is one shape, scaled, shifted and delayed: runs that
differ in amplitude, offset, phase or gain share its pieces, and those that differ in frequency or duty have pieces of
their own that are made for all of them together, as are those of sequences of straight lines. Everything else is
lowered value by value.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from tarsus.base.errors import InputError
from tarsus.base.spec import with_values
from tarsus.model.drive.laws import LinearForce
from tarsus.model.drive.lower import lower
from tarsus.model.drive.pieces import TERMS, Pieces
from tarsus.model.drive.signal import Signal
from tarsus.model.drive.waveforms import Constant, OnOff, Poling, Ramp, RampedSquare, Sine, Square
from tarsus.model.scene import Drive, Scene

__all__ = ["Course", "drive_course", "felt", "gait_courses", "pool_of"]

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

LEAST = 1e-12
"""Shares of a period below this, and stretches below this share of the whole, are lowered value by value: they may
round to nothing."""


@dataclass(frozen=True)
class Course:
    """What one drive does in nr runs. pieces: channels; force, volts (nr,): numbers of those of each run, and how it
    has them, force_change, volts_change (nr, 3): factor, offset, delay [s]. periods (nr,) [s]: of its signal, NaN
    without one."""

    pieces: Sequence[Pieces]
    force: Ints
    volts: Ints
    force_change: Floats
    volts_change: Floats
    periods: Floats


@dataclass(frozen=True)
class _Shapes:
    """Voltages of nr runs by a few pieces: run i is factor[i] * pieces[which[i]](t + delay[i]) + offset[i]."""

    pieces: Sequence[Pieces]
    which: Ints
    factor: Floats
    offset: Floats
    delay: Floats
    periods: Floats


def pool_of(
    given: Sequence[Pieces], courses: Mapping[str, Course]
) -> tuple[tuple[Pieces, ...], dict[str, int]]:
    """The given channels with those of the courses behind them, and where those of each course start."""
    every, first = list(given), {}
    for name, course in courses.items():
        first[name] = len(every)
        every += course.pieces
    return tuple(every), first


def drive_course(scene: Scene, name: str, varied: Mapping[str, Floats]) -> Course:
    """What a drive does where numbers (nr,) of its signal and of itself vary, given by their paths in the scene.

    Raises InputError for values that the signal or the drive refuses, and for a drive that cannot be lowered.
    """
    wave = scene.waveforms.get(name) or Constant(level=0.0)
    head = f"signals.{name}."
    fields = {path.removeprefix(head): column for path, column in varied.items() if path.startswith(head)}
    return _course(scene, name, wave, fields, _of_drive(name, varied))


def gait_courses(
    scene: Scene, varied: Mapping[str, Floats], own: Mapping[str, Mapping[str, Floats]]
) -> dict[str, Course]:
    """The same for all drives that a gait moves, where numbers (nr,) of the gait vary; ``own``: those of drives.

    Raises InputError for a gait that refuses its values or does not fit the robot.
    """
    layout, gait = scene.robot.layout(), scene.gait
    assert gait is not None and layout is not None  # checked by Scene
    distinct, which = _distinct(list(varied.values()))
    keys = [path.removeprefix("gait.") for path in varied]
    waves: list[dict[str, Square]] = []
    for row in distinct:
        values = dict(zip(keys, row.tolist(), strict=True))
        try:
            one = with_values(gait, values)
        except InputError as error:
            raise InputError([f"gait.{text}" for text in error.problems]) from None
        faults = one.faults(layout)
        if faults:
            raise InputError([f"gait.{path}: {text}" if path else f"gait: {text}" for path, text in faults])
        waves.append(one.waveforms(layout))
    courses = {}
    for name, wave in gait.waveforms(layout).items():
        if name in scene.signals:
            continue
        fields = {
            key: np.array([getattr(one[name], key) for one in waves])[which]
            for key in ("amplitude", "frequency", "phase", "offset", "duty")
        }
        courses[name] = _course(scene, name, wave, fields, _of_drive(name, own.get(name, {})))
    return courses


def _of_drive(name: str, varied: Mapping[str, Floats]) -> dict[str, Floats]:
    head = f"robot.drives.{name}."
    return {path.removeprefix(head): column for path, column in varied.items() if path.startswith(head)}


def felt(path: str) -> bool:
    """Whether a number of a drive or its signal has a part in the motion; its supply's energy account has none."""
    return not path.endswith((".capacitance", ".recovery"))


def _course(
    scene: Scene, name: str, wave: Signal, fields: Mapping[str, Floats], drive_fields: Mapping[str, Floats]
) -> Course:
    columns = [*fields.values(), *drive_fields.values()]
    drive = scene.robot.drives[name]
    count = len(columns[0]) if columns else 1
    shapes, fits = None, np.zeros(count, dtype=bool)
    if (
        isinstance(drive.law, LinearForce)
        and drive.amplifier.ideal
        and set(drive_fields) <= {"law.gain", "law.offset"}
    ):
        if isinstance(wave, _SHAPED):
            _check_ends(f"signals.{name}", wave, fields)
            _check_ends(f"robot.drives.{name}", drive, drive_fields)
        shapes, fits = _shapes(wave, fields, count)
    elif isinstance(wave, OnOff) and drive.amplifier.ideal and not drive_fields:
        course, fits = _plateaus(wave, fields, drive, count)
        rest = np.flatnonzero(~fits)
        if not len(rest):
            return course
        slow = _one_by_one(scene, name, wave, {key: column[rest] for key, column in fields.items()}, {})
        return _merged(course, slow, rest)
    if shapes is None or not fits.all():
        rest = np.flatnonzero(~fits)
        slow = _one_by_one(
            scene, name, wave,
            {key: column[rest] for key, column in fields.items()},
            {key: column[rest] for key, column in drive_fields.items()},
        )  # fmt: skip
        if shapes is None:
            return slow
        fast = _linear(shapes, drive.law, drive_fields, count)
        return _merged(fast, slow, rest)
    return _linear(shapes, drive.law, drive_fields, count)


def _plateaus(
    wave: OnOff, fields: Mapping[str, Floats], drive: Drive, count: int
) -> tuple[Course, NDArray[np.bool_]]:
    """Voltages one after the other through a law with memory, and for which runs (nr,) this holds: a rate-independent
    force is as constant as they are. A drive that repeats has its first period apart, as `lower` makes it: the memory
    of what came before ends there."""
    shapes, fits = _shapes(wave, fields, count)
    assert shapes is not None
    sizes = len(wave.levels) if wave.repeat else len(wave.levels) + 1
    volts = np.array([pieces.coef[:, 0] for pieces in shapes.pieces]).reshape(-1, sizes)
    times = np.array([pieces.start for pieces in shapes.pieces]).reshape(-1, sizes + 1)
    twice = wave.repeat and drive.law.has_memory
    levels, which = _distinct(list((np.tile(volts, (1, 2)) if twice else volts).T))
    force = drive.law.forces(levels, drive.history)[which]
    if twice:
        times = np.concatenate([times, times[:, -1:] + times[:, 1:]], axis=1)
    loop = -1 if not wave.repeat else sizes if twice else 0
    same = np.tile([1.0, 0.0, 0.0], (count, 1))
    pieces = [*_straight(times, force, force, loop), *shapes.pieces]
    first = len(shapes.pieces)
    return Course(pieces, shapes.which, first + shapes.which, same, same.copy(), shapes.periods), fits


def _check_ends(where: str, of: Signal | Drive, varied: Mapping[str, Floats]) -> None:
    """Raise InputError where a value is refused: bounds are intervals, so that the lowest and the highest suffice;
    entries of one list, or numbers of one part, know nothing of each other and are looked at together."""
    groups: dict[str, list[str]] = {}
    for key in varied:
        groups.setdefault(key.rpartition(".")[0] or key, []).append(key)
    for keys in groups.values():
        problem = _refused(of, [{key: varied[key] for key in keys}])
        if problem is not None and len(keys) > 1:
            problem = _refused(of, [{key: varied[key]} for key in keys])
        if problem is not None:
            raise InputError([f"{where}.{text}" for text in problem.problems]) from None


def _refused(of: Signal | Drive, parts: Sequence[Mapping[str, Floats]]) -> InputError | None:
    """What is wrong with the lowest or the highest values of some numbers, each part by itself."""
    for part in parts:
        lowest, highest = (tuple(float(end(one)) for one in part.values()) for end in (np.min, np.max))
        for edge in {lowest, highest}:
            try:
                one = with_values(of, dict(zip(part, edge, strict=True)))
                _ = one.period if isinstance(one, Signal) else None
            except InputError as error:
                return error
    return None


def _linear(shapes: _Shapes, law: object, varied: Mapping[str, Floats], count: int) -> Course:
    """Force and volts of shapes through a linear law."""
    assert isinstance(law, LinearForce)
    gain = varied.get("law.gain", np.full(count, law.gain))
    offset = varied.get("law.offset", np.full(count, law.offset))
    volts = np.stack([shapes.factor, shapes.offset, shapes.delay], axis=1)
    force = np.stack([gain * shapes.factor, gain * shapes.offset + offset, shapes.delay], axis=1)
    return Course(shapes.pieces, shapes.which, shapes.which, force, volts, shapes.periods)


def _merged(fast: Course, slow: Course, rest: Ints) -> Course:
    """The fast course with the runs ``rest`` of the slow one in their places."""
    first = len(fast.pieces)
    out = Course(
        [*fast.pieces, *slow.pieces], fast.force.copy(), fast.volts.copy(), fast.force_change, fast.volts_change,
        fast.periods.copy(),
    )  # fmt: skip
    out.force[rest], out.volts[rest] = first + slow.force, first + slow.volts
    out.force_change[rest], out.volts_change[rest] = slow.force_change, slow.volts_change
    out.periods[rest] = slow.periods
    return out


def _one_by_one(
    scene: Scene, name: str, wave: Signal, fields: Mapping[str, Floats], drive_fields: Mapping[str, Floats]
) -> Course:
    """Every different drive lowered by itself."""
    drive = scene.robot.drives[name]
    distinct, which = _distinct([*fields.values(), *drive_fields.values()])
    pieces: list[Pieces] = []
    periods: list[float] = []
    for row in distinct:
        values = row.tolist()
        try:
            one = with_values(wave, dict(zip(fields, values, strict=False)))
        except InputError as error:
            raise InputError([f"signals.{name}.{text}" for text in error.problems]) from None
        try:
            named = dict(zip(drive_fields, values[len(fields) :], strict=True))
            other = with_values(drive, named) if named else drive
        except InputError as error:
            raise InputError([f"robot.drives.{name}.{text}" for text in error.problems]) from None
        pieces += lower(other.actuator_volts(one), other.law, other.history)
        periods.append(one.period or math.nan)
    as_it_is = np.tile([1.0, 0.0, 0.0], (len(which), 1))
    return Course(pieces, 2 * which, 2 * which + 1, as_it_is, as_it_is.copy(), np.array(periods)[which])


def _distinct(columns: Sequence[Floats]) -> tuple[Floats, Ints]:
    """Different rows of columns (nr,), and the number of the one each run has."""
    rows, which = np.unique(np.stack(columns, axis=1), axis=0, return_inverse=True)
    return rows, which.reshape(-1).astype(np.int64)


_SHAPED = (Sine, Square, RampedSquare, Constant, Ramp, Poling, OnOff)


def _shapes(
    wave: Signal, varied: Mapping[str, Floats], count: int
) -> tuple[_Shapes | None, NDArray[np.bool_]]:
    """A wave's voltages by few shapes, and for which runs (nr,) that holds; None for a wave that has no such shape."""

    def field(name: str) -> Floats:
        return varied[name] if name in varied else np.full(count, float(getattr(wave, name)))

    def fields(name: str) -> Floats:
        own = getattr(wave, name)
        return np.stack([varied.get(f"{name}.{i}", np.full(count, x)) for i, x in enumerate(own)], axis=1)

    if isinstance(wave, (Sine, Square, RampedSquare)):
        return _periodic(wave, field, count)
    none = np.full(count, np.nan)
    if isinstance(wave, Constant):
        level = field("level")[:, None]
        times = np.broadcast_to([0.0, 1.0], (count, 2))
        return _lines(times, level, level, none, repeat=False)
    if isinstance(wave, Ramp):
        start, stop, end = field("start"), field("stop"), field("duration")
        return _lines(
            *_held(np.stack([0.0 * end, end], axis=1), start[:, None], stop[:, None]), none, repeat=False
        )
    if isinstance(wave, Poling):
        level, hold, fall = field("level"), field("hold"), field("fall")
        times = np.stack([0.0 * hold, hold, hold + fall], axis=1)
        first, last = np.stack([level, level], axis=1), np.stack([level, 0.0 * level], axis=1)
        return _lines(*_held(times, first, last), none, repeat=False)
    if isinstance(wave, OnOff):
        levels, ends = fields("levels"), np.cumsum(fields("durations"), axis=1)
        times = np.concatenate([np.zeros((count, 1)), ends], axis=1)
        if not wave.repeat:
            return _lines(*_held(times, levels, levels), none, repeat=False)
        shapes, fits = _lines(times, levels, levels, ends[:, -1], repeat=True)
        return shapes, fits & (np.ptp(levels, axis=1) > 0.0)
    return None, np.zeros(count, dtype=bool)


def _periodic(
    wave: Sine | Square | RampedSquare, field: Callable[[str], Floats], count: int
) -> tuple[_Shapes, NDArray[np.bool_]]:
    """Offset and amplitude times a shape of size one; what has no amplitude or no edge is none of these."""
    amplitude, period = field("amplitude"), 1.0 / field("frequency")
    cycles = field("phase") / (2.0 * math.pi)
    fits = amplitude > 0.0
    if isinstance(wave, Sine):
        unit = _unit_sine()
        lengths, which = _distinct([period])
        pieces = [
            Pieces(unit.start * length, unit.coef, unit.kink, unit.loop) for length in lengths[:, 0].tolist()
        ]
    else:
        duty = field("duty")
        fits = fits & (duty > LEAST) & (duty < 1.0 - LEAST)
        rows, which = _distinct([period, np.where(fits, duty, 0.5)])
        one, zero = np.ones(len(rows)), np.zeros(len(rows))
        if isinstance(wave, Square):
            edges = np.stack([zero, rows[:, 1], one], axis=1)
            first = last = np.stack([one, -one], axis=1)
        else:  # from the foot of the ramp that t = 0 is the middle of
            ramp = 0.5 * rows[:, 1]
            edges = np.stack([zero, ramp, 0.5 * one, 0.5 + ramp, one], axis=1)
            first, last = np.stack([-one, one, one, -one], axis=1), np.stack([one, one, -one, -one], axis=1)
            cycles = cycles + 0.25 * duty
        pieces = _straight(edges * rows[:, :1], first, last, 0)
    delay = np.remainder(cycles, 1.0) * period
    return _Shapes(pieces, which, amplitude, field("offset"), delay, period), fits


@lru_cache(maxsize=1)
def _unit_sine() -> Pieces:
    return lower(Sine(amplitude=1.0, frequency=1.0), LinearForce(gain=1.0))[1]


def _held(times: Floats, first: Floats, last: Floats) -> tuple[Floats, Floats, Floats]:
    """Lines followed by their last value, so that the corner at their end is one like every other."""
    end = times[:, -1:]
    return (
        np.concatenate([times, end + np.maximum(1.0, end)], axis=1),
        np.concatenate([first, last[:, -1:]], axis=1),
        np.concatenate([last, last[:, -1:]], axis=1),
    )


def _lines(
    times: Floats, first: Floats, last: Floats, periods: Floats, *, repeat: bool
) -> tuple[_Shapes, NDArray[np.bool_]]:
    """Sequences of straight lines as they are; those with a line of no length, to rounding, are none of these."""
    size = times.shape[1]
    fits = np.asarray((np.diff(times, axis=1) > LEAST * times[:, -1:]).all(axis=1))
    columns = np.where(fits[:, None], np.concatenate([times, first, last], axis=1), 0.0)
    rows, which = _distinct(list(columns.T))
    sound = (np.diff(rows[:, :size], axis=1) > 0.0).all(axis=1)
    rows[~sound, :size] = np.arange(size)  # in the place of those that do not fit
    pieces = _straight(
        rows[:, :size], rows[:, size : 2 * size - 1], rows[:, 2 * size - 1 :], 0 if repeat else -1
    )
    one, zero = np.ones(len(times)), np.zeros(len(times))
    return _Shapes(pieces, which, one, zero, zero.copy(), periods), fits


def _straight(times: Floats, first: Floats, last: Floats, loop: int) -> list[Pieces]:
    """Lines from ``first`` (C, S) to ``last`` (C, S) between ``times`` (C, S + 1); kinks where value or slope jumps."""
    slope = (last - first) / np.diff(times, axis=1)
    kink = first != np.roll(last, 1, axis=1)
    kink |= np.abs(slope - np.roll(slope, 1, axis=1)) > 1e-12 * np.abs(slope).max(axis=1, keepdims=True)
    if loop < 0:
        kink[:, 0] = True
    coef = np.zeros((*first.shape, TERMS))
    coef[:, :, 0] = np.where(first == last, first, 0.5 * first + 0.5 * last)
    coef[:, :, 1] = 0.5 * (last - first)
    return [Pieces(times[i], coef[i], kink[i], loop) for i in range(len(times))]
