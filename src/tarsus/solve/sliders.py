"""What an explorer's sliders turn: numbers of a scene, how far each goes, and where it lies in a packet."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import TYPE_CHECKING, Any

import numpy as np

from tarsus.base.arrays import Floats, Ints
from tarsus.base.errors import InputError
from tarsus.base.spec import FloatInfo, float_paths, with_values
from tarsus.measure.switching import squares_per_period
from tarsus.model.drive.lower import lower
from tarsus.model.drive.pieces import Channels
from tarsus.plan.channels import affects_motion, drive_courses
from tarsus.plan.rows import marked_period
from tarsus.plan.slots import Kind, Place, slots, unit_of

if TYPE_CHECKING:
    from tarsus.model.scene import Scene
    from tarsus.plan.channels import DriveRuns
    from tarsus.plan.lowering import Plan
    from tarsus.plan.rows import Rows

WIDER = 4.0
"""Factor to either side of a number of which nothing is known."""
NARROWER = 2.0
"""The same of what drives do."""
DECADE = 5.0
"""From this ratio of its ends on a slider is logarithmic."""
STOPS = {1: (81,), 2: (41, 31), 3: (31, 21, 9)}
"""Values of each number of the drives, lowered beforehand, by how many such numbers there are."""
FEWER_STOPS = {1: (41,), 2: (15, 11), 3: (7, 5, 3)}
"""The same of drives behind amplifiers that are not ideal, whose voltages are followed row by row."""
FIRST = ("amplitude", "high", "frequency", "duty", "swing_lag", "offset", "low", "phase")
"""Numbers of drives that are turned first."""
STEEP = 0.1
"""Incline [rad] to either side of level ground, at which a friction of 0.1 holds just so."""
SAME = 1e-9
"""Part of itself to which a period is a whole number of others: that of rounding, and far below any detuning."""
INSET = 0.02
"""Part of a share's range, 0 to 1, that its slider leaves out at either end."""


@dataclass(frozen=True)
class Slider:
    """One or several alike numbers of a scene that are turned together.

    value, low, high: SI; log: whether the way from end to end is logarithmic; known: whether the range is that of the
    provenance, or of draws. array, at: where in a packet the number stands; or, of what drives do, stops:
    the values that are lowered. turned: of gravity, whose two numbers there follow from its acceleration (0) and the
    incline of the ground (1) together, which of these it is.
    """

    paths: tuple[str, ...]
    value: float
    unit: str
    doc: str
    kind: Kind
    low: float
    high: float
    log: bool
    known: bool = False
    array: str = ""
    at: tuple[int, ...] = ()
    turned: int | None = None
    stops: tuple[float, ...] = ()


@dataclass(frozen=True)
class Lattice:
    """Drives lowered at all combinations of the stops of some sliders, the last one running fastest.

    pool: different channels; channels (nr, nc), shown (nr, nd): of each combination those of the plan, and volts of the
    drives; periods (nr,) [s] of the marks; drawn (nr,) [J]: electrical energy of a period, NaN where it is not the same
    in all.
    """

    pool: Channels
    channels: Ints
    shown: Ints
    periods: Floats
    drawn: Floats


def sliders_of(
    scene: Scene,
    plan: Plan,
    ranges: Mapping[str, tuple[float, float]],
    drives: Sequence[str] | None = None,
    most: int | None = None,
) -> tuple[list[Slider], list[str]]:
    """Sliders of every number that is data of a plan of a scene, those of the drives last, and paths of those that have
    none.

    ranges: ends [SI] by path, of draws or of the user; drives: numbers of drives, three at most, in place of the first
    ones of `FIRST`, of which there are so many at most.

    Raises InputError for ranges and numbers of drives that are none, and for more than three of these.
    """
    places, infos = slots(scene), float_paths(scene)
    places = {path: place for path, place in places.items() if place.kind is not Kind.MOTION}
    _check_asked(places, infos, ranges, drives)
    found, left = [], []
    for paths in _alike(places, infos):
        kind = places[paths[0]].kind
        if kind in (Kind.DRIVE, Kind.GAIT):
            continue
        one = _slider(scene, plan, paths, infos[paths[0]], kind, ranges)
        left += [] if one else [paths[0]]
        found += [replace(one, **_address(plan, [places[path] for path in paths]))] if one else []
    turned = [one for one in _turned(places, infos, drives)[:most] if one]
    movers = [_slider(scene, plan, paths, infos[paths[0]], places[paths[0]].kind, ranges) for paths in turned]
    some = [one for one in movers if one is not None]
    ideal = all(one.amplifier.ideal for one in scene.robot.drives.values())
    counts = (STOPS if ideal else FEWER_STOPS).get(len(some), ())
    own = [replace(one, stops=_stops(one, count)) for one, count in zip(some, counts, strict=True)]
    covered = {path for one in (*found, *own) for path in one.paths}
    data = [path for path in places if path not in covered and path not in left and affects_motion(path)]
    tables = [path for path in infos if path not in places]
    return [*found, *own], [*left, *data, *tables]


def _check_asked(
    places: Mapping[str, Place], infos: Mapping[str, FloatInfo], ranges: Mapping[str, Any], drives: Sequence[str] | None
) -> None:
    faults = [f"{path}: the scene has no such number" for path in (*ranges, *(drives or ())) if path not in infos]
    for path in drives or ():
        if path in infos and (path not in places or places[path].bounded):
            faults.append(f"{path}: is not a number that a drive takes")
    if len(drives or ()) > max(STOPS):
        faults.append(f"an explorer turns {max(STOPS)} numbers of drives at most, got {len(drives or ())}")
    if faults:
        raise InputError(faults)


def _alike(places: Mapping[str, Place], infos: Mapping[str, FloatInfo]) -> list[list[str]]:
    """Paths by slider: numbers of feet, and of drives, that are the same of all go together."""
    groups: dict[Any, list[str]] = defaultdict(list)
    for path in places:
        keys = path.split(".")
        of = {("robot", "feet"): 2, ("robot", "drives"): 2, ("signals",): 1}
        many = next((n for head, n in of.items() if tuple(keys[: len(head)]) == head), None)
        key = path if many is None else (*keys[:many], *keys[many + 1 :], infos[path].value)
        groups[key].append(path)
    return list(groups.values())


def _turned(
    places: Mapping[str, Place], infos: Mapping[str, FloatInfo], drives: Sequence[str] | None
) -> list[list[str]]:
    """Paths of the sliders of drives."""
    groups = [one for one in _alike(places, infos) if not places[one[0]].bounded]
    if drives is not None:
        return [next(one for one in groups if path in one) for path in dict.fromkeys(drives)]
    signals = [one for one in groups if not one[0].startswith("robot.")]
    chosen = [one for last in FIRST for one in signals if one[0].rpartition(".")[2] == last]
    return [one for one in chosen if infos[one[0]].value != 0.0][: max(STOPS)]


def _address(plan: Plan, places: Sequence[Place]) -> dict[str, Any]:
    """Where the number stands in a packet."""
    kind = places[0].kind
    if kind is Kind.LAW:
        width = plan.laws.parameters.shape[1]
        return {
            "array": "rows.parameters",
            "at": tuple(
                foot * width + place.at
                for place in places
                for foot in (range(plan.feet) if place.feet is None else place.feet)
            ),
        }
    if kind is Kind.INITIAL:
        return {"array": "rows.initial", "at": (places[0].at,)}
    if kind is Kind.GRAVITY:
        return {"array": "rows.sources", "at": (plan.feet, plan.feet + 1), "turned": places[0].at}
    return {"array": "rows.sources", "at": tuple(one.at for one in places)}


def _slider(
    scene: Scene, plan: Plan, paths: Sequence[str], info: FloatInfo, kind: Kind, ranges: Mapping[str, Any]
) -> Slider | None:
    """The slider of numbers that are alike; None where nothing says how far it could go."""
    known = next((ranges[path] for path in paths if path in ranges), None) or scene.interval(paths[0])
    ends = known if known is not None and known[0] < known[1] else _guess(scene, plan, paths[0], info)
    if ends is None:
        return None
    low, high = min(ends[0], info.value), max(ends[1], info.value)
    if not _allowed(scene, paths, low) or not _allowed(scene, paths, high):
        return None
    log = low > 0.0 and high / low >= DECADE and not _share(scene, paths[0], info)
    return Slider(tuple(paths), info.value, info.unit, info.doc, kind, low, high, log, known is not None)


def _guess(scene: Scene, plan: Plan, path: str, info: FloatInfo) -> tuple[float, float] | None:
    """How far a number may go of which nothing is known."""
    value, name = info.value, path.rpartition(".")[2]
    if _share(scene, path, info):
        return INSET, 1.0 - INSET
    if path == "ground.incline":  # up and down, and on level ground as far as feet of low friction hold
        reach = max(NARROWER * abs(value), STEEP)
        return -reach, reach
    if value == 0.0:
        reach = 10.0 * unit_of(path, plan)
        if path.startswith("initial.displacement."):
            return -0.5 * reach, 0.5 * reach
        return (0.0, reach) if name == "gap" and math.isfinite(reach) else None
    factor = NARROWER if path.startswith(("signals.", "gait.", "robot.drives.")) else WIDER
    if value < 0.0:
        return factor * value, value / factor
    return value / factor, factor * value


def _share(scene: Scene, path: str, info: FloatInfo) -> bool:
    """Whether a number lies between 0 and 1."""
    return info.unit == "1" and 0.0 <= info.value <= 1.0 and not _allowed(scene, [path], 1.0 + INSET)


def _allowed(scene: Scene, paths: Sequence[str], value: float) -> bool:
    try:
        with_values(scene, dict.fromkeys(paths, value))
    except InputError:
        return False
    return True


def _stops(one: Slider, count: int) -> tuple[float, ...]:
    """Values of a drive's number: even steps of three digits, its own among them."""
    even = np.geomspace(one.low, one.high, count) if one.low > 0.0 else np.linspace(one.low, one.high, count)
    if one.low > 0.0 and not one.log:
        even = np.linspace(one.low, one.high, count)
    stops = [float(f"{value:.3g}") for value in even]
    stops[int(np.abs(even - one.value).argmin())] = one.value
    return tuple(sorted({min(max(value, one.low), one.high) for value in stops}))


def lattice_of(scene: Scene, plan: Plan, rows: Rows, sliders: Sequence[Slider], duration: float) -> Lattice:
    """What drives do at all combinations of the stops of sliders, in runs of one duration [s].

    Raises InputError for stops that a signal, a gait or a drive refuses.
    """
    axes = [one for one in sliders if one.stops]
    combined = list(product(*(one.stops for one in axes)))
    grid = np.array(combined, dtype=float).reshape(len(combined), len(axes))
    values = {path: grid[:, k] for k, one in enumerate(axes) for path in one.paths}
    names, count = list(scene.robot.drives), len(grid)
    courses = drive_courses(scene, values, names) if values else {}
    signals = scene.actuator_volts
    volts = [lower(signals[name], one.law, one.history)[1] for name, one in scene.robot.drives.items()]
    pool, nc = [Channels.of(rows.pool), Channels.of(volts)], len(plan.channels)
    which = np.tile(np.concatenate([rows.channels[0], len(pool[0]) + np.arange(len(names))]), (count, 1))
    periods = np.repeat(plan.periods[:, None], count, axis=1)
    places: dict[int, int] = {}  # of courses that several drives share
    for name, course in courses.items():
        d = names.index(name)
        assert course.volts is not None
        first = places.setdefault(id(course), sum(map(len, pool)))
        if first == sum(map(len, pool)):
            pool += [course.force, course.volts]
        which[:, d] = first + course.which
        for c in (*plan.channels_of(d)[1:], nc + d):
            which[:, c] = first + len(course.force) + course.which
        periods[d] = course.periods
    channels, where = _different(Channels.joined(pool))
    which = where[which]
    marked = marked_period(periods, duration)
    return Lattice(channels, which[:, :nc], which[:, nc:], marked, _drawn(scene, courses, marked))


def _drawn(scene: Scene, courses: Mapping[str, DriveRuns], marked: Floats) -> Floats:
    """Electrical energy (nr,) [J] of a period (nr,) [s] of the marks, NaN where drives do not repeat with it."""
    out, known = np.zeros(len(marked)), dict[int, Floats]()  # by course, which several drives share
    for name, drive in scene.robot.drives.items():
        course = courses.get(name)
        if course is None:
            track = scene.actuator_volts[name].track()
            squares, period = squares_per_period(track), track.periods
            if (track.first == track.last).all() and np.ptp(track.first) == 0.0:  # at rest
                continue
        else:
            if id(course) not in known:
                known[id(course)] = squares_per_period(course.track)[course.which]
            squares, period = known[id(course)], course.periods
        times = marked / period
        whole = np.abs(times - np.round(times)) < SAME * times
        capacitance = np.nan if drive.capacitance is None else drive.capacitance
        energy = capacitance * (1.0 - (drive.recovery or 0.0)) * squares * np.round(times)
        out += np.where(whole, np.where(squares > 0.0, energy, squares), np.nan)
    return out


def _different(channels: Channels) -> tuple[Channels, Ints]:
    """Channels without those that are the same, and the number there of each."""
    if not len(channels):
        return channels, np.zeros(0, dtype=np.int64)
    first: dict[bytes, int] = {}
    kept, where = [], np.zeros(len(channels), dtype=np.int64)
    starts, arrays = channels.first, channels.arrays
    for c, count in enumerate(channels.counts):
        own = slice(starts[c], starts[c] + count)
        key = b"".join(
            (
                arrays["starts"][starts[c] + c : starts[c] + c + count + 1].tobytes(),
                arrays["coef"][own].tobytes(),
                arrays["kink"][own].tobytes(),
                arrays["loops"][c : c + 1].tobytes(),
            )
        )
        where[c] = first.setdefault(key, len(first))
        if where[c] == len(kept):
            kept.append(c)
    rows = np.concatenate([starts[c] + np.arange(int(channels.counts[c])) for c in kept])
    return Channels(
        channels.counts[kept],
        channels.loops[kept],
        channels.begin[rows],
        channels.end[rows],
        channels.coef[rows],
        channels.kink[rows],
        channels.periods[kept],
    ), where
