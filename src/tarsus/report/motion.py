"""What a walker's animation and figures need of a run: plain arrays over time, by leg and by drive."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from tarsus.base.errors import InputError
from tarsus.files.series import Variables
from tarsus.files.settled import drive_period
from tarsus.model.profile import line_between
from tarsus.model.structure.walker import RIGID

if TYPE_CHECKING:
    from tarsus.solve import Run

AIR, STUCK, SLIPPING = 0, 1, 2
"""States of a foot."""

PER_PERIOD = 64
"""Frames that show one drive period well."""

MOST_FRAMES = 2000
"""Frames of an animation at most."""

_NOTHING = np.zeros((0, 0))


@dataclass(frozen=True)
class Motion:
    """A walker at nt times [s]: nl legs with their feet, nd drives. x is forward, y to the left, z up.

    body: coordinates by name, each (nt,) [m, rad]; hips (nl, 3) [m]: at rest, from the body's centre of mass;
    foot_x, foot_z (nl, nt) [m]: place of a foot along the way, from where the body's centre started, and its height
    above the ground; state (nl, nt): 0 in the air, 1 stuck, 2 slipping; normal, friction (nl, nt) [N]: force of the
    ground on a foot, upward and forward; volts (nd, nt) [V]; period [s]: the drives', None if none repeats; incline
    [rad]: by which the ground rises forward; ground: of uneven ground the different lines below feet, each (n, 2) [m],
    places and heights, none of level ground; line: the number of each leg's, (nl,); moved (2, nt) [m]: of ground that
    moves its displacements along the way and upward, else zeros. Raises InputError, with every array
    that does not fit, unless the shapes are these.
    """

    time: np.ndarray
    body: Mapping[str, np.ndarray]
    legs: tuple[str, ...]
    hips: np.ndarray
    foot_x: np.ndarray
    foot_z: np.ndarray
    state: np.ndarray
    normal: np.ndarray
    friction: np.ndarray
    drives: tuple[str, ...] = ()
    volts: np.ndarray = field(default_factory=lambda: _NOTHING)
    period: float | None = None
    incline: float = 0.0
    ground: tuple[np.ndarray, ...] = ()
    line: tuple[int, ...] = ()
    moved: np.ndarray | None = None

    def __post_init__(self) -> None:
        nt, nl, nd = len(self.time), len(self.legs), len(self.drives)
        wanted = {name: (nl, nt) for name in _PER_FOOT} | {"time": (nt,), "hips": (nl, 3)}
        wanted |= {"volts": (nd, nt)} if nd else {}
        faults = [
            f"{name}: expected the shape {shape}, got {np.shape(getattr(self, name))}"
            for name, shape in wanted.items()
            if np.shape(getattr(self, name)) != shape
        ]
        faults += [
            f"body.{name}: expected the shape {(nt,)}, got {np.shape(values)}"
            for name, values in self.body.items()
            if np.shape(values) != (nt,)
        ]
        faults += [
            f"body.{name}: expected one of {', '.join(RIGID)}" for name in self.body if name not in RIGID
        ]
        if nt < 2 or nl < 1:
            faults.append(f"a motion needs two times and one leg, got {nt} and {nl}")
        if faults:
            raise InputError(faults)

    def coordinate(self, name: str) -> np.ndarray:
        """A coordinate of the body (nt,), zero where it has none."""
        return self.body.get(name, np.zeros(len(self.time)))

    @property
    def ground_shift(self) -> np.ndarray:
        """Displacements of the ground (2, nt) [m], along the way and upward."""
        return np.zeros((2, len(self.time))) if self.moved is None else self.moved

    def still(self) -> Motion:
        """The same as seen from its ground."""
        return replace(self, moved=None)

    @property
    def hip_shift_x(self) -> np.ndarray:
        """Displacement of the hips along the way (nl, nt) [m]."""
        turned = np.outer(self.hips[:, 2], self.coordinate("pitch")) - np.outer(
            self.hips[:, 1], self.coordinate("yaw")
        )
        return self.coordinate("surge") + turned

    @property
    def hip_shift_z(self) -> np.ndarray:
        """Displacement of the hips upward (nl, nt) [m]."""
        turned = np.outer(self.hips[:, 1], self.coordinate("roll"))
        turned -= np.outer(self.hips[:, 0], self.coordinate("pitch"))
        return self.coordinate("heave") + turned

    def taken(self, chosen: np.ndarray | slice) -> Motion:
        """The motion at some of its times only."""
        cut = {
            f.name: getattr(self, f.name)[..., chosen]
            for f in fields(self)
            if f.name in (*_PER_FOOT, "time")
            or (f.name == "volts" and self.drives)
            or (f.name == "moved" and self.moved is not None)
        }
        return replace(self, body={name: values[chosen] for name, values in self.body.items()}, **cut)

    def thinned(self, most: int) -> Motion:
        """At most `most` of its times, about evenly spread from the first to the last."""
        if len(self.time) <= most:
            return self
        even = np.linspace(self.time[0], self.time[-1], most)
        after = np.clip(np.searchsorted(self.time, even), 1, len(self.time) - 1)
        nearer = even - self.time[after - 1] < self.time[after] - even
        return self.taken(np.unique(after - nearer))


_PER_FOOT = ("foot_x", "foot_z", "state", "normal", "friction")


def frame_limit(legs: int, drives: int, characters: int) -> int:
    """Frames of so many legs and drives that fit in so many characters of payload, MOST_FRAMES at most.

    A frame takes 2 bytes for time and each of four coordinates; 6 and a quarter a leg; 1 a drive; base64 makes 4
    characters of 3 bytes.
    """
    return min(MOST_FRAMES, int(characters * 3 / 4 / (10.0 + 6.25 * legs + drives)))


def whole_motion(run: Run) -> Motion:
    """The motion of a walker's run at the times of its series."""
    return _motion(run.scene, run.foot_names, run.variables(), drive_period(run.scene))


def motion_of(run: Run, most: int = MOST_FRAMES, whole: Motion | None = None) -> Motion:
    """The motion of a walker's run, or of its last drive periods where it has too many for `most` frames.

    `run.scene.robot.structure` is a `Walker`; `whole` its `whole_motion`, if at hand. A leg without a foot swings at
    the height its springs give it, over ground as far below as under the other feet at rest. A run that was
    simulated is asked for more times where its series are too coarse.
    """
    whole = whole_motion(run) if whole is None else whole
    first, last = _stretch(whole.time, whole.period, most)
    near = 1e-9 * (last - first)
    inside = (whole.time >= first - near) & (whole.time <= last + near)
    if run.stored is not None or int(inside.sum()) >= min(most, len(whole.time)):
        return whole.taken(inside).thinned(most)
    return _motion(run.scene, run.foot_names, run.variables(np.linspace(first, last, most)), whole.period)


def _stretch(time: np.ndarray, period: float | None, most: int) -> tuple[float, float]:
    """First and last time [s] to be shown: the whole, or as many last periods as `most` frames show well."""
    start, end = float(time[0]), float(time[-1])
    shown = max(most // PER_PERIOD, 1)
    if period is None or (end - start) <= shown * period * (1.0 + 1e-9):
        return start, end
    complete = math.floor(end / period * (1.0 + 1e-9))
    return (complete - shown) * period, complete * period


def _motion(scene: Any, feet: Sequence[str], variables: Variables, period: float | None) -> Motion:
    structure = scene.robot.structure
    legs = tuple(structure.legs)
    points = [str(name) for name in variables["point"].values]
    shift = np.asarray(variables["displacement"].values, dtype=float)
    rows = {scene.robot.feet[name].point: row for row, name in enumerate(feet)}
    gaps = {scene.robot.feet[name].point: float(scene.robot.feet[name].gap) for name in feet}
    usual = float(np.mean(list(gaps.values()))) if gaps else 0.0

    def of_feet(name: str) -> np.ndarray:
        """A series of the feet (nl, nt), zero for a leg without one."""
        if name not in variables:
            return np.zeros((len(legs), shift.shape[1]))
        values = np.asarray(variables[name].values, dtype=float)
        return np.stack([values[rows[leg]] if leg in rows else np.zeros(shift.shape[1]) for leg in legs])

    along = np.stack([shift[points.index(f"{leg}_x")] + structure.legs[leg].x for leg in legs])
    height = np.stack([shift[points.index(leg)] + gaps.get(leg, usual) for leg in legs])
    held = of_feet("contact") > 0.5
    slips = held & (of_feet("slipping") > 0.5)
    body = np.asarray(variables["body"].values, dtype=float)
    return Motion(
        time=np.asarray(variables["time"].values, dtype=float),
        body=dict(zip(structure.body_coordinates, body, strict=True)),
        legs=legs,
        hips=np.array([[leg.x, leg.y, leg.z] for leg in structure.legs.values()], dtype=float),
        foot_x=along,
        foot_z=height,
        state=np.where(slips, SLIPPING, np.where(held, STUCK, AIR)).astype(np.uint8),
        normal=of_feet("contact_force"),
        friction=of_feet("friction_force"),
        drives=tuple(str(name) for name in variables["drive"].values),
        volts=np.asarray(variables["volts"].values, dtype=float),
        period=period,
        incline=scene.ground.incline or 0.0,
        moved=_moved(variables),
        **_ground_below(scene, legs, along),
    )


def _moved(variables: Variables) -> np.ndarray | None:
    """Displacements of ground that moves (2, nt), along the way and upward."""
    ways = [variables.get(name) for name in ("ground_along", "ground_normal")]
    if ways == [None, None]:
        return None
    none = np.zeros(len(variables["time"].values))
    return np.stack([none if one is None else np.asarray(one.values, dtype=float) for one in ways])


def _ground_below(scene: Any, legs: Sequence[str], along: np.ndarray) -> dict[str, Any]:
    """The lines of uneven ground below feet at places (nl, nt), and as far beyond them as they are apart; a leg without
    a foot is shown above the first one."""
    if scene.ground.profile is None:
        return {}
    lines, which = scene.ground.profile.lines(scene.across)
    of = dict(zip((foot.point for foot in scene.robot.feet.values()), which, strict=True))
    low, high = float(along.min()), float(along.max())
    return {
        "ground": tuple(
            line_between(one.points, one.repeats, low - (high - low), high + (high - low)) for one in lines
        ),
        "line": tuple(of.get(leg, 0) for leg in legs),
    }
