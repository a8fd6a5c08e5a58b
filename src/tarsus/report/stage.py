"""Where a walker's parts are drawn: true places of the hips where the model has them, and factors for the motion."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from tarsus.report.motion import Motion

LEG = 0.25
"""Length of a drawn leg, of the drawn robot's length: the model has no legs, only springs below the hips."""

THICK = 0.055
"""Thickness of a drawn body, of its length."""

LIFT, STRIDE = 0.4, 0.4
"""Room the motion takes at the start: of a leg's length upward; of the way from leg to leg along it."""

BACK = (0.05, 0.03)
"""How far the far side is drawn to the front and up, of the robot's length, so that both sides are seen."""

ALONE = 1e-3
"""Length of a robot whose legs are all at one place, drawn apart: any would do."""


@dataclass(frozen=True)
class WalkStage:
    """What is drawn of nl legs [m]: x, y (nl,) of the hips and their height z above the ground, all at rest.

    true: whether x and y are the model's; length, leg, thick: of the drawn robot, its legs and its body.
    up, along: factors that displacements are drawn with at first; force: a large force of the ground [N].
    springs: whether legs are drawn as springs.
    """

    x: np.ndarray
    y: np.ndarray
    z: np.ndarray
    true: bool
    length: float
    leg: float
    thick: float
    up: float
    along: float
    force: float
    springs: bool = False

    @property
    def box(self) -> tuple[float, float, float, float]:
        """Ends of the drawn body at rest: back, front, right, left [m]."""
        over = 0.05 * self.length
        back, front = float(self.x.min()) - over, float(self.x.max()) + over
        short = max(0.3 * self.length - (front - back), 0.0) / 2.0
        return back - short, front + short, float(self.y.min()), float(self.y.max())

    @property
    def piece(self) -> float:
        """Length of ground that is drawn below a foot [m]: as far as the next one on its side."""
        apart = [np.diff(np.unique(self.x[side])) for side in (self.far, ~self.far)]
        return float(np.concatenate(apart).min(initial=self.leg))

    @property
    def far(self) -> np.ndarray:
        """Legs on the far side (nl,), the robot's left; none where all legs are in one plane."""
        return self.y > 0.5 * (self.y.min() + self.y.max()) + 1e-9 * self.length


def stage_of(motion: Motion, *, springs: bool = False) -> WalkStage:
    """The stage for a motion; of feet on springs it is as large as their way upward needs."""
    highest = float(motion.foot_z.max(initial=0.0))
    alone = (highest or ALONE) / (LIFT * LEG) if springs else ALONE
    x, y, true = _apart(motion.hips[:, 0], motion.hips[:, 1], alone)
    length = max(float(np.ptp(x)), float(np.ptp(y)), alone if springs else 0.0) or alone
    leg = LEG * length
    height = motion.hips[:, 2] - motion.hips[:, 2].min()
    thick = THICK * length + float(height.max())
    aside, risen = np.ptp(motion.ground_shift, axis=1)
    lift = max(float(np.ptp(motion.hip_shift_z)), highest, float(risen))
    swing = motion.foot_x - motion.hips[:, :1] - motion.hip_shift_x
    stride = max(float(np.ptp(swing, axis=1).max()), float(aside))
    room = min(_spacing(x, y, length), 2.0 * leg)
    forces = np.abs(np.concatenate([motion.normal, motion.friction]))
    pressed = forces[forces > 0.0]
    return WalkStage(
        x=x,
        y=y,
        z=leg + height,
        true=true and not springs,
        springs=springs,
        length=length,
        leg=leg,
        thick=thick,
        up=_round_factor(LIFT * leg, lift),
        along=_round_factor(STRIDE * room, stride),
        force=float(np.percentile(pressed, 98.0)) if len(pressed) else 0.0,
    )


def _apart(x: np.ndarray, y: np.ndarray, alone: float) -> tuple[np.ndarray, np.ndarray, bool]:
    """Places of the hips, those at one place spread along x, and whether they all stayed where they were."""
    extent = max(float(np.ptp(x)), float(np.ptp(y))) or alone
    places = np.round(np.column_stack([x, y]) / (1e-6 * extent))
    _, group = np.unique(places, axis=0, return_inverse=True)
    group = group.reshape(-1)
    spread = x.astype(float).copy()
    for one in np.unique(group):
        members = np.flatnonzero(group == one)
        others = np.flatnonzero(group != one)
        room = extent
        if len(others):
            room = float(np.hypot(x[others] - x[members[0]], y[others] - y[members[0]]).min())
        spread[members] += (np.arange(len(members)) - 0.5 * (len(members) - 1)) * room / len(members)
    return spread, y.astype(float), bool(np.array_equal(spread, x))


def _spacing(x: np.ndarray, y: np.ndarray, length: float) -> float:
    """Least way between neighbours on one side [m]."""
    least = length
    for side in np.unique(np.round(y / (1e-6 * length))):
        steps = np.diff(np.sort(x[np.round(y / (1e-6 * length)) == side]))
        least = min(least, float(steps[steps > 1e-9 * length].min(initial=length)))
    return least


def _round_factor(room: float, motion: float) -> float:
    """The largest of 1, 2, 5, 10, 20 ... that keeps a motion within its room; 1 at least."""
    if motion <= 0.0 or room <= motion:
        return 1.0
    return round_below(room / motion)


def round_below(value: float) -> float:
    """The largest of ... 0.5, 1, 2, 5, 10 ... not above a positive value."""
    power = 10.0 ** math.floor(math.log10(value))
    return next(step for step in (5.0, 2.0, 1.0) if step * power <= value * (1.0 + 1e-9)) * power


@dataclass(frozen=True)
class Drawing:
    """One moment on paper [m]: hips and feet (nl, 2), and the faces of the body's box (4, 2), ground at height 0 or
    where it has moved to."""

    hips: np.ndarray
    feet: np.ndarray
    near_face: np.ndarray
    far_face: np.ndarray


def drawn(motion: Motion, stage: WalkStage, frame: int) -> Drawing:
    """A moment of a motion as seen from the robot's right, with the body's centre where it is at rest."""
    surge = motion.coordinate("surge")[frame]
    roll, pitch = motion.coordinate("roll")[frame], motion.coordinate("pitch")[frame]
    heave = motion.coordinate("heave")[frame]
    depth = _depth(stage, stage.y)
    hips = np.column_stack([stage.x, stage.z]) + depth
    feet = np.column_stack([stage.x, np.zeros(len(stage.x))]) + depth
    hips[:, 0] += stage.along * (motion.hip_shift_x[:, frame] - surge)
    risen = stage.up * motion.ground_shift[1, frame]
    hips[:, 1] += stage.up * motion.hip_shift_z[:, frame] + risen
    feet[:, 0] += stage.along * (motion.foot_x[:, frame] - motion.hips[:, 0] - surge)
    feet[:, 1] += stage.up * motion.foot_z[:, frame] + risen
    back, front, right, left = stage.box

    def face(y: float) -> np.ndarray:
        x = np.array([back, front, front, back])
        z = stage.leg + np.array([0.0, 0.0, stage.thick, stage.thick])
        return np.column_stack([x, z + risen + stage.up * (heave + y * roll - x * pitch)]) + _depth(
            stage, np.array([y])
        )

    return Drawing(hips, feet, face(right), face(left))


def facets(motion: Motion, stage: WalkStage, frame: int) -> list[np.ndarray]:
    """The pieces of uneven ground below the feet at a moment, each (n, 2) [m], as large as the motion is drawn."""
    half = 0.5 * stage.piece / stage.along
    depth = _depth(stage, stage.y)
    out = []
    for leg, x in enumerate(motion.foot_x[:, frame]):
        place, height = motion.ground[motion.line[leg]].T
        ends, inside = np.array([x - half, x + half]), np.abs(place - x) < half
        edge = np.interp(ends, place, height)
        at = np.concatenate([ends[:1], place[inside], ends[1:]])
        z = np.concatenate([edge[:1], height[inside], edge[1:]])
        along = stage.along * (at - motion.hips[leg, 0] - motion.coordinate("surge")[frame])
        risen = motion.ground_shift[1, frame]
        out.append(np.column_stack([stage.x[leg] + along, stage.up * (z + risen)]) + depth[leg])
    return out


def _depth(stage: WalkStage, y: np.ndarray) -> np.ndarray:
    """How far points at y are drawn forward and up (n, 2)."""
    width = float(np.ptp(stage.y))
    share = (y - stage.y.min()) / width if width > 0.0 else np.zeros(len(y))
    return np.outer(share, BACK) * stage.length
