"""Which numbers of a scene are data: what runs of one plan may differ in without lowering or tables of their own.

A *slot* is the place of such a number in the rows of a batch: parameters of ground laws, rest gaps, gravity and
the incline, initial
state, and everything that says what a drive does over time. Numbers that enter the tables of a structure (its masses,
springs, damping, shapes, loads) have none; a value of theirs makes a plan anew.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from threading import Lock
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from tarsus.base.errors import InputError
from tarsus.base.spec import Description, float_paths, get_value, with_values
from tarsus.model.drive.pieces import Channels
from tarsus.plan.channels import DriveRuns, check_columns, drive_courses, with_columns
from tarsus.plan.lowering import Kind, Place, Plan, distinct, gravity_on, lower_profile, of_leg, slot, started
from tarsus.plan.moving import GroundForce, ground_forces, refuse_jumps, shifts_of, velocities_at_start
from tarsus.plan.rows import Rows, marked_period, marked_rows, pack, rows_of

if TYPE_CHECKING:
    from tarsus.model.drive.signal import Signal
    from tarsus.model.scene import Scene

__all__ = [
    "Courses",
    "Kind",
    "Place",
    "bears",
    "bounded",
    "check_bounds",
    "courses_of_all",
    "rows_for",
    "slot",
    "slots",
    "unit_of",
]

Floats = NDArray[np.float64]
Courses = Callable[[Sequence[str]], Mapping[str, DriveRuns]]
"""What drives do in the runs of a plan, by name, for those whose volts are asked for."""


def slots(scene: Scene) -> dict[str, Place]:
    """Every slot of a scene by path, in file order."""
    found = {path: slot(scene, path) for path in float_paths(scene)}
    return {path: place for path, place in found.items() if place is not None}


def unit_of(path: str, plan: Plan | None) -> float:
    """What a number that is zero varies by: a gap or a point of the ground by the plan's length, a displacement so as
    to move a foot by that, a velocity by as much at the plan's rate, a number of a drive's law by the plan's force, one
    of a structure's matrix by the largest there."""
    keys = path.split(".")
    if plan is not None and keys[0] == "initial" and keys[1] in ("displacement", "velocity"):
        moves = np.abs(plan.system.normals[int(keys[2])]).max(initial=0.0)
        return float(plan.length / (moves or 1.0)) * (plan.rate if keys[1] == "velocity" else 1.0)
    if plan is not None and keys[:2] == ["ground", "motion"] and keys[-1] in _SIZES:
        order = ("displacement", "velocity", "acceleration").index(keys[3])
        return plan.length * plan.rate**order
    if plan is not None and keys[:2] == ["robot", "drives"] and "law" in keys:
        return plan.force
    if plan is not None and keys[:2] == ["robot", "structure"] and keys[2] in ("mass", "damping", "stiffness"):
        return float(np.abs(getattr(plan.system, keys[2])).max()) or 1.0
    plain = {"restitution", "adhesion", "friction", "rising"}
    shaped = keys[:2] == ["ground", "profile"] and not plain.intersection(keys[-2:])
    return plan.length if plan is not None and (keys[-1] == "gap" or shaped) else 1.0


_SIZES = ("amplitude", "offset", "level", "start", "stop")
"""Numbers of a waveform that are values of what it says."""


def bounded(scene: Scene, path: str) -> bool:
    """Whether the bounds of a number are an interval of its own, whatever else varies."""
    place = slot(scene, path)
    return of_leg(scene, path) if place is None else place.bounded


def check_bounds(scene: Scene, path: str, values: Floats) -> None:
    """Raise InputError where values (nr,) of a slot leave their bounds: bounds are intervals, so both ends suffice."""
    keys = path.split(".")
    get_value(scene, path)
    depth = len(keys) - 1
    while not isinstance(owner := get_value(scene, ".".join(keys[:depth])), Description):
        depth -= 1
    for edge in {float(values.min()), float(values.max())}:
        try:
            with_values(owner, {".".join(keys[depth:]): edge})
        except InputError as error:
            raise InputError([f"{'.'.join(keys[:depth])}.{text}" for text in error.problems]) from None


def rows_for(
    scene: Scene,
    plan: Plan,
    values: Mapping[str, Floats],
    duration: float,
    *,
    scaled: bool = True,
    count: int = 1,
    courses: Courses | None = None,
) -> Rows:
    """Runs of a plan of a scene that differ in slots.

    Parameters
    ----------
    scene, plan
        The scene, and what it was lowered to.
    values
        Values (nr,) by path, each of a slot and within its bounds.
    duration
        Of every run [s]: periods longer than that are none.
    scaled
        Whether tolerances refer to the lengths and forces of every run, not to those of the plan.
    count
        How many runs there are where no value differs.
    courses
        What the drives do in these runs, of those whose volts are asked for, where it is known already.

    Raises
    ------
    InputError
        Where a run would start below the ground or does not stand, and for drives that cannot be lowered.
    """
    if not values:
        return marked_rows(plan, count, duration)
    base = rows_of(plan, len(next(iter(values.values()))))
    by_kind: dict[Kind, dict[str, tuple[int, Floats]]] = {kind: {} for kind in Kind}
    for path, column in values.items():
        place = slot(scene, path)
        assert place is not None
        by_kind[place.kind][path] = (place.at, column)
    feet = plan.feet
    for path, (at, column) in by_kind[Kind.LAW].items():
        place = slot(scene, path)
        own = slice(None) if place is None or place.feet is None else list(place.feet)
        base.parameters[:, own, at] = column[:, None]
    for at, column in by_kind[Kind.GAP].values():
        base.sources[:, at] = column
    if turned := {at: column for at, column in by_kind[Kind.GRAVITY].values()}:
        own = [np.full(len(base), one) for one in scene.ground.falling]
        base.sources[:, feet:] = gravity_on(*(turned.get(at, one) for at, one in enumerate(own))).T
    for at, column in by_kind[Kind.INITIAL].values():
        base.initial[:, at] = column
    _start_in_laboratory(scene, by_kind, base)
    if shaped := {path: column for path, (_, column) in by_kind[Kind.PROFILE].items()}:
        base.profile[:] = _profiles(scene, shaped)
    refuse_jumps(scene, duration, _waves(scene, by_kind))
    rows = _driven(scene, plan, by_kind, base, duration, courses)
    initial, scales = started(plan, rows, _idle(scene, plan, values, len(rows)), list(scene.robot.feet))
    return replace(rows, initial=initial.reshape(rows.initial.shape), scales=scales if scaled else rows.scales)


def _profiles(scene: Scene, values: Mapping[str, Floats]) -> Floats:
    """The profiles (nr, .) of the grounds of runs that differ in numbers of their shape."""
    rows, which = distinct(np.stack(list(values.values()), axis=1))
    own = [
        with_values(scene.ground, dict(zip((path.removeprefix("ground.") for path in values), row, strict=True)))
        for row in rows.tolist()
    ]
    return np.array([lower_profile(one, scene.across) for one in own])[which]


def bears(scene: Scene, path: str) -> bool:
    """Whether a number has a part in how a walker stands that starts so: the film, restitution and friction bear
    nothing at rest, and volts nothing before they come."""
    idle: tuple[str, ...] = ("ground.film.", "ground.restitution.", "ground.friction.", "initial.")
    if scene.initial.standing is not None and not scene.initial.standing.driven:
        idle += ("gait.", "signals.")
    return not path.startswith(idle)


def _idle(scene: Scene, plan: Plan, values: Mapping[str, Floats], count: int) -> Floats:
    """Forces (nr, nd) [N] that drives exert without volts, where a walker stands without."""
    out = np.repeat(plan.idle[None], count, axis=0)
    for d, (name, drive) in enumerate(scene.robot.drives.items()):
        head = f"robot.drives.{name}."
        own = {path.removeprefix(head): column for path, column in values.items() if path.startswith(head)}
        if own and scene.initial.standing is not None:
            rows, which = distinct(np.stack(list(own.values()), axis=1))
            one = [with_values(drive, dict(zip(own, row.tolist(), strict=True))).exerted() for row in rows]
            out[:, d] = np.array(one)[which]
    return out


def _driven(
    scene: Scene,
    plan: Plan,
    by_kind: Mapping[Kind, Mapping[str, tuple[int, Floats]]],
    base: Rows,
    duration: float,
    known: Courses | None,
) -> Rows:
    """The rows with the channels and the period of every run."""
    names = list(scene.robot.drives)
    periods = np.repeat(plan.periods[:, None], len(base), axis=1)
    varied = {path: column for kind in _OF_DRIVES for path, (_, column) in by_kind[kind].items()}
    charged = [names[d] for d in plan.charged]
    courses = drive_courses(scene, varied, charged) if known is None else known(charged)
    pool = [Channels.of(base.pool)]
    for name, course in courses.items():
        d = names.index(name)
        for c, channels in zip(plan.channels_of(d), (course.force, course.volts), strict=False):
            assert channels is not None
            base.channels[:, c] = sum(map(len, pool)) + course.which
            pool.append(channels)
        periods[d] = course.periods
    for c, (one, wave) in enumerate(_shaken(scene, plan, by_kind), start=len(names)):
        if wave is not None:
            made = one.channels(wave)  # one for all where a derivative knows nothing of what varies
            base.channels[:, c] = sum(map(len, pool)) + (np.arange(len(base)) if len(made) > 1 else 0)
            pool.append(made)
            periods[c] = wave.periods()
    channels = Channels.joined(pool)
    signals = pack(channels) if len(pool) > 1 else base.signals
    base.scales[:, 2] = marked_period(periods, duration)
    return replace(base, pool=channels, signals=signals)


def _waves(scene: Scene, by_kind: Mapping[Kind, Mapping[str, tuple[int, Floats]]]) -> dict[str, Signal]:
    """Waveforms of ground that moves of which numbers (nr,) vary, by direction. Raises InputError for wrong values."""
    out = {}
    for direction, shift in shifts_of(scene).items():
        head = f"ground.motion.{direction}.{shift.word}."
        own = {
            path.removeprefix(head): column
            for path, (_, column) in by_kind[Kind.MOTION].items()
            if path.startswith(head)
        }
        if own:
            check_columns(head.rstrip("."), shift.wave, own)
            out[direction] = with_columns(shift.wave, own)
    return out


def _shaken(
    scene: Scene, plan: Plan, by_kind: Mapping[Kind, Mapping[str, tuple[int, Floats]]]
) -> Iterator[tuple[GroundForce, Signal | None]]:
    """The forces of ground that moves, and their waveforms where numbers of them vary."""
    waves = _waves(scene, by_kind)
    for one in ground_forces(scene, plan.system):
        yield one, waves.get(one.direction)


def _start_in_laboratory(scene: Scene, by_kind: Mapping[Kind, Mapping[str, tuple[int, Floats]]], base: Rows) -> None:
    """Velocities (nr, n) at the start that are given in the laboratory, as ones against the ground."""
    if not scene.initial.in_laboratory:
        return
    own = {direction: one.wave for direction, one in shifts_of(scene).items()}
    before = velocities_at_start(scene, own)
    n = before.shape[1]
    for at, _ in by_kind[Kind.INITIAL].values():
        if at >= n:
            base.initial[:, at] -= before[0, at - n]
    base.initial[:, n:] += before - velocities_at_start(scene, own | _waves(scene, by_kind))


_OF_DRIVES = (Kind.GAIT, Kind.DRIVE)
"""Kinds of numbers that a drive's course depends on."""


def courses_of_all(scene: Scene, values: Mapping[str, Floats]) -> Callable[[NDArray[np.int64]], Courses]:
    """What drives do in all runs of a batch, made once for plans that differ in other numbers than the drives'; by the
    numbers of a plan's runs."""
    varied = {
        path: column
        for path, column in values.items()
        if (place := slot(scene, path)) is not None and place.kind in _OF_DRIVES
    }
    made: dict[tuple[str, ...], dict[str, DriveRuns]] = {}
    lock = Lock()

    def of(runs: NDArray[np.int64]) -> Courses:
        def known(charged: Sequence[str]) -> dict[str, DriveRuns]:
            with lock:
                if tuple(charged) not in made:
                    made[tuple(charged)] = drive_courses(scene, varied, charged)
            return {name: course.of_runs(runs) for name, course in made[tuple(charged)].items()}

        return known

    return of
