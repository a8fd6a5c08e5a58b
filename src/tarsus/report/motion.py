"""What a robot's animation and figures need of a run: plain arrays over time, by leg and by drive."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from enum import Enum, auto
from typing import TYPE_CHECKING, Any

import numpy as np

from tarsus.files.series import Variables
from tarsus.files.settled import drive_period
from tarsus.model.profile import line_between
from tarsus.model.structure import Beam, Walker

if TYPE_CHECKING:
    from tarsus.solve import Run

AIR, STUCK, SLIPPING = 0, 1, 2
"""States of a foot."""

PER_PERIOD = 64
"""Frames that show one drive period well."""

MOST_FRAMES = 2000
"""Frames of an animation at most."""

CHANNELS = ("one", "surge", "heave", "roll", "pitch", "yaw")
"""What moves the points of a drawing besides feet, in order: 1 at all times, and coordinates of the body."""

MOST_POINTS = 12
"""Points shown of a robot without legs: more do not fit side by side on a narrow screen."""

_NOTHING = np.zeros((0, 0))


class Held(Enum):
    """What holds a robot's feet: legs of a body, a beam from its clamp at x = 0, springs of their own, or nothing."""

    LEGS = auto()
    BEAM = auto()
    SPRINGS = auto()
    FREE = auto()


@dataclass(frozen=True)
class Motion:
    """A robot at nt times [s]: nl legs with their feet, nd drives. x is forward, y to the left, z up.

    body: coordinates by name, each (nt,) [m, rad]; hips (nl, 3) [m]: at rest, from the body's centre of mass;
    foot_x, foot_z (nl, nt) [m]: place of a foot along the way, from where the body's centre started, and its height
    above the ground; state (nl, nt): 0 in the air, 1 stuck, 2 slipping; normal, friction (nl, nt) [N]: force of the
    ground on a foot, upward and forward; volts (nd, nt) [V]; period [s]: the drives', None if none repeats; incline
    [rad]: by which the ground rises forward; ground: of uneven ground the different lines below feet, each (n, 2) [m],
    places and heights, none of level ground; line: the number of each leg's, (nl,); moved (2, nt) [m]: of ground that
    moves its displacements along the way and upward, else zeros; held: what holds the feet; footless: numbers of the
    legs without a foot. Of a robot that is no walker, points that move upward are its legs, hips their places along it
    and heights above the ground at rest.
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
    held: Held = Held.LEGS
    footless: tuple[int, ...] = ()

    def coordinate(self, name: str) -> np.ndarray:
        """A coordinate of the body (nt,), zero where it has none."""
        return self.body.get(name, np.zeros(len(self.time)))

    @property
    def channels(self) -> np.ndarray:
        """What moves the points of a drawing (nc, nt): CHANNELS, then for every foot its way along from below its hip
        at rest [m], then for every foot its height [m]."""
        body = [np.ones(len(self.time)), *map(self.coordinate, CHANNELS[1:])]
        return np.concatenate([body, self.foot_x - self.hips[:, :1], self.foot_z])

    @property
    def ground_shift(self) -> np.ndarray:
        """Displacements of the ground (2, nt) [m], along the way and upward."""
        return np.zeros((2, len(self.time))) if self.moved is None else self.moved

    @property
    def hip_shift_x(self) -> np.ndarray:
        """Displacement of the hips along the way (nl, nt) [m]."""
        turned = np.outer(self.hips[:, 2], self.coordinate("pitch")) - np.outer(self.hips[:, 1], self.coordinate("yaw"))
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


def frame_limit(legs: int, characters: int) -> int:
    """Frames of so many legs that fit in so many characters of payload, MOST_FRAMES at most.

    A frame takes 2 bytes for time and each of four coordinates, and 7 a leg; base64 makes 4 characters
    of 3 bytes.
    """
    return min(MOST_FRAMES, int(characters * 3 / 4 / (10.0 + 7.0 * legs)))


def whole_motion(run: Run, variables: Variables | None = None) -> Motion:
    """The motion of a run at the times of its series; variables: those of the run, if at hand."""
    return _motion(run, run.variables() if variables is None else variables)


def motion_of(run: Run, most: int = MOST_FRAMES, whole: Motion | None = None) -> Motion:
    """The motion of a run, or of its last drive periods where it has too many for `most` frames.

    `whole`: its `whole_motion`, if at hand. A leg without a foot swings at the height its springs give it, over ground
    as far below as under the other feet at rest. A run that was simulated is asked for more times where its series are
    too coarse.
    """
    whole = whole_motion(run) if whole is None else whole
    first, last = _stretch(whole.time, whole.period, most)
    near = 1e-9 * (last - first)
    inside = (whole.time >= first - near) & (whole.time <= last + near)
    if run.stored is not None or int(inside.sum()) >= min(most, len(whole.time)):
        return whole.taken(inside).thinned(most)
    return _motion(run, run.variables(np.linspace(first, last, most)))


def _stretch(time: np.ndarray, period: float | None, most: int) -> tuple[float, float]:
    """First and last time [s] to be shown: the whole, or as many last periods as `most` frames show well."""
    start, end = float(time[0]), float(time[-1])
    shown = max(most // PER_PERIOD, 1)
    if period is None or (end - start) <= shown * period * (1.0 + 1e-9):
        return start, end
    complete = math.floor(end / period * (1.0 + 1e-9))
    return (complete - shown) * period, complete * period


def _motion(run: Run, variables: Variables) -> Motion:
    """The motion that variables of a run hold."""
    scene: Any = run.scene
    structure = scene.robot.structure
    walks = isinstance(structure, Walker)
    points = [str(name) for name in variables["point"].values]
    legs = tuple(structure.legs) if walks else tuple(points[:MOST_POINTS])
    shift = np.asarray(variables["displacement"].values, dtype=float)
    rows = {scene.robot.feet[name].point: row for row, name in enumerate(run.foot_names)}
    gaps = {
        scene.robot.feet[name].point: float(scene.robot.feet[name].gap) / float(scene.robot.feet[name].normal)
        for name in run.foot_names
    }
    usual = float(np.mean(list(gaps.values()))) if gaps else 0.0

    def of_feet(name: str) -> np.ndarray:
        """A series of the feet (nl, nt), zero for a leg without one."""
        if name not in variables:
            return np.zeros((len(legs), shift.shape[1]))
        values = np.asarray(variables[name].values, dtype=float)
        return np.stack([values[rows[leg]] if leg in rows else np.zeros(shift.shape[1]) for leg in legs])

    along = np.zeros((len(legs), shift.shape[1]))
    if walks:
        along = np.stack([shift[points.index(f"{leg}_x")] + structure.legs[leg].x for leg in legs])
    height = np.stack([shift[points.index(leg)] + gaps.get(leg, usual) for leg in legs])
    held = of_feet("contact") > 0.5
    slips = held & (of_feet("slipping") > 0.5)
    body = np.asarray(variables["body"].values, dtype=float) if walks else ()
    places, by = _places(structure, legs, np.array([gaps.get(leg, usual) for leg in legs]))
    return Motion(
        time=np.asarray(variables["time"].values, dtype=float),
        body=dict(zip(structure.body_coordinates if walks else (), body, strict=True)),
        legs=legs,
        hips=places,
        foot_x=along + (0.0 if walks else places[:, :1]),
        foot_z=height,
        state=np.where(slips, SLIPPING, np.where(held, STUCK, AIR)).astype(np.uint8),
        normal=of_feet("contact_force"),
        friction=of_feet("friction_force"),
        drives=tuple(str(name) for name in variables["drive"].values),
        volts=np.asarray(variables["volts"].values, dtype=float),
        period=drive_period(scene),
        incline=(scene.ground.incline or 0.0) if walks else 0.0,
        moved=_moved(variables),
        held=by,
        footless=tuple(number for number, leg in enumerate(legs) if leg not in rows),
        **(_ground_below(scene, legs, along) if walks else {}),
    )


def _places(structure: Any, legs: Sequence[str], heights: np.ndarray) -> tuple[np.ndarray, Held]:
    """Where the feet are held (nl, 3) [m], and by what; heights (nl,) [m]: of points above the ground at rest."""
    if isinstance(structure, Walker):
        return np.array([[leg.x, leg.y, leg.z] for leg in structure.legs.values()], dtype=float), Held.LEGS
    places = np.zeros((len(legs), 3))
    if isinstance(structure, Beam):
        at = {"center": 0.5 * structure.length, "tip": structure.length + 0.5 * structure.tip_length}
        places[:, 0], places[:, 2] = [at[leg] for leg in legs], heights
        return places, Held.BEAM
    stiffness = getattr(structure, "stiffness", None)
    free = stiffness is not None and not np.any(np.asarray(stiffness, dtype=float))
    return places, Held.FREE if free else Held.SPRINGS


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
