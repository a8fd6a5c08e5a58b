"""One drawing of a robot: points that the channels of its motion move, and shapes between them, worked out once.

Whatever shows the robot, the player of a page or a movie, places the points of a moment and paints the
shapes in their order: at rest + (along (A c), up (U c)), c being the channels then, along and up the factors by which
motion is enlarged.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from tarsus.base.arrays import Floats
from tarsus.report.motion import CHANNELS, Held, Motion
from tarsus.report.style import BLUE, FAR_BODY, FAR_LEG, INK, MUTED, NEAR_BODY, RULE, paint_of

LEG = 0.25
"""Length of a drawn leg, of the drawn robot's length: the model has no legs, only springs below the hips."""

THICK = 0.055
"""Thickness of a drawn body, of its length."""

LIFT, STRIDE = 0.4, 0.4
"""Room the motion takes at the start: of a leg's length upward; of the way from leg to leg along it."""

BENT = 0.3
"""Room the motion of a beam takes at the start, of its length."""

BACK = (0.05, 0.03)
"""How far the far side is drawn to the front and up, of the robot's length, so that both sides are seen."""

ALONE = 1e-3
"""Length of a robot whose legs are all at one place, drawn apart: any would do."""

BODY_ABOVE = 0.62
"""Width of the body seen from above, of that of the feet: they are seen at its sides."""

Weights = Mapping[int, float]
"""What a unit of a channel, by its place among the channels, moves a point."""


@dataclass(frozen=True)
class MovedPoint:
    """A point of a drawing: its place at rest [m], and what moves it forward and upward."""

    x: float
    z: float
    along: Weights
    up: Weights


@dataclass(frozen=True)
class Shape:
    """A path through points, by number, in colours of `style`; with a fill it is closed."""

    points: tuple[int, ...]
    edge: str
    width: float = 1.0
    fill: str = ""


@dataclass(frozen=True)
class FootMark:
    """The mark of a leg's foot at a point, by its state, with the forces on it."""

    leg: int
    point: int


@dataclass(frozen=True)
class RobotView:
    """What is seen from one side: points, and what is painted between them from the back to the front."""

    points: Sequence[MovedPoint]
    parts: Sequence[Shape | FootMark]

    @cached_property
    def _moved(self) -> Floats:
        """Weights (2, n, channels)."""
        count = 1 + max((at for one in self.points for at in (*one.along, *one.up)), default=0)
        out = np.zeros((2, len(self.points), count))
        for n, one in enumerate(self.points):
            for row, weights in enumerate((one.along, one.up)):
                out[row, n, list(weights)] = list(weights.values())
        return out

    def placed(self, channels: Floats, along: float, up: float) -> Floats:
        """Places (2, n, ...) [m] of the points where the channels are (channels, ...), enlarged by two factors."""
        rest = np.array([[one.x for one in self.points], [one.z for one in self.points]])
        factors = np.array([along, up]).reshape(2, *(1,) * channels.ndim)
        moved = self._moved
        return rest.reshape(*rest.shape, *(1,) * (channels.ndim - 1)) + factors * (moved @ channels[: moved.shape[-1]])


@dataclass(frozen=True)
class Piece:
    """Uneven ground below a foot: number of its line, the foot's point, the drawn place (x, z) [m] of the place
    `shift` [m] of the line, and its colour."""

    line: int
    point: int
    x: float
    z: float
    shift: float
    paint: str


@dataclass(frozen=True)
class Drawing:
    """The drawing of a motion, with what it is placed by [m].

    side, above: as seen from the robot's right, and from above, None of a robot without width; box: ends (left, right,
    low, high) of the side, as large as at first and with the body's centre held; true: whether places along are the
    model's; length, leg: of the drawn robot and its legs; up, along: factors that displacements are drawn with at
    first; force: a large force of the ground [N]; back: how far up the far side's ground is drawn; pieces: of uneven
    ground below feet, each so `wide`; level: whether there is level ground at height 0.
    """

    side: RobotView
    above: RobotView | None
    box: tuple[float, float, float, float]
    true: bool
    length: float
    leg: float
    up: float
    along: float
    force: float
    back: float = 0.0
    pieces: tuple[Piece, ...] = ()
    wide: float = 0.0
    level: bool = True

    def seen(self, motion: Motion) -> Floats:
        """Places (2, n, nt) [m] of the points of the side, with the body's centre held."""
        at = self.side.placed(motion.channels, self.along, self.up)
        return at + _camera(motion, self.along, self.up)[:, None, :]

    def ground_below(self, motion: Motion, at: Floats, frame: int) -> list[Floats]:
        """The pieces of uneven ground at a moment whose points are `seen` at (2, n), each (2, m) [m]."""
        camera, out = _camera(motion, self.along, self.up)[:, frame], []
        for one in self.pieces:
            place, height = motion.ground[one.line].T
            x = one.x + self.along * (place - one.shift) + camera[0]
            low, high = at[0, one.point] + 0.5 * self.wide * np.array([-1.0, 1.0])
            ends = np.concatenate([[low], x[(x > low) & (x < high)], [high]])
            out.append(np.stack([ends, np.interp(ends, x, one.z + self.up * height + camera[1])]))
        return out

    def to_dict(self) -> dict[str, Any]:
        """The drawing as plain data for the player."""
        numbers = ("true", "length", "leg", "up", "along", "force", "back", "wide", "level")
        return {
            **{name: getattr(self, name) for name in numbers},
            "side": _plain(self.side),
            "above": self.above and _plain(self.above),
            "box": _numbers(self.box),
            "pieces": [
                [one.line, one.point, *_numbers((one.x, one.z, one.shift)), paint_of(one.paint)] for one in self.pieces
            ],
        }


def drawing_of(motion: Motion) -> Drawing:
    """The drawing of a motion."""
    if motion.held is Held.BEAM:
        return _beam(motion)
    hangs = motion.held is not Held.LEGS
    highest = float(motion.foot_z.max(initial=0.0))
    room_up = BENT if motion.held is Held.FREE else LIFT * LEG
    alone = (highest or ALONE) / room_up if hangs else ALONE
    x, y, true = _apart(motion.hips[:, 0], motion.hips[:, 1], alone)
    length = max(float(np.ptp(x)), float(np.ptp(y)), alone if hangs else 0.0) or alone
    leg = LEG * length
    aside, risen = np.ptp(motion.ground_shift, axis=1)
    lift = max(float(np.ptp(motion.hip_shift_z)), highest, float(risen))
    stride = max(float(np.ptp(motion.foot_x - motion.hip_shift_x, axis=1).max()), float(aside))
    plan = _Plan(motion, x, y, length, leg)
    room = min(plan.apart, 2.0 * leg)
    up, along = _round_factor(room_up * length, lift), _round_factor(STRIDE * room, stride)
    side = plan.side()
    return Drawing(
        side=side,
        above=plan.above() if plan.width > 0.0 else None,
        box=_box(side, motion, along, up, length if hangs else 0.0),
        true=true and not hangs,
        length=length,
        leg=leg,
        up=up,
        along=along,
        force=_large(motion),
        back=BACK[1] * length if plan.width > 0.0 else 0.0,
        pieces=tuple(plan.pieces(side)),
        wide=plan.apart,
    )


class _Sketch:
    """Points and parts as they are added."""

    def __init__(self) -> None:
        self.points: list[MovedPoint] = []
        self.parts: list[Shape | FootMark] = []

    def point(self, x: float, z: float, along: Mapping[int, float], up: Mapping[int, float]) -> int:
        """The number of a new point."""
        kept = ({at: float(weight) for at, weight in one.items() if weight} for one in (along, up))
        self.points.append(MovedPoint(float(x), float(z), *kept))
        return len(self.points) - 1

    def path(self, points: Sequence[int], edge: str, width: float = 1.0, fill: str = "") -> None:
        """A shape through points."""
        self.parts.append(Shape(tuple(points), edge, width, fill))

    @property
    def view(self) -> RobotView:
        return RobotView(self.points, self.parts)


ONE, SURGE, HEAVE, ROLL, PITCH, YAW = range(len(CHANNELS))


class _Plan:
    """Where the parts of a robot on legs are drawn [m]: x, y (nl,) of its hips at rest."""

    def __init__(self, motion: Motion, x: Floats, y: Floats, length: float, leg: float) -> None:
        self.motion, self.x, self.y, self.length, self.leg = motion, x, y, length, leg
        self.width = float(np.ptp(y))
        height = motion.hips[:, 2] - motion.hips[:, 2].min()
        self.hip = leg + height
        self.thick = THICK * length + float(height.max())
        self.far = y > 0.5 * (y.min() + y.max()) + 1e-9 * length
        over = 0.05 * length
        back, front = float(x.min()) - over, float(x.max()) + over
        short = max(0.3 * length - (front - back), 0.0) / 2.0
        self.ends = (back - short, front + short)

    @property
    def apart(self) -> float:
        """Way from a leg to the next one on its side; a leg's length of one alone."""
        apart = np.concatenate([np.diff(np.unique(self.x[side])) for side in (self.far, ~self.far)])
        return float(apart[apart > 1e-9 * self.length].min(initial=self.leg))

    def depth(self, y: float) -> tuple[float, float]:
        """How far points at y are drawn forward and up."""
        share = (y - float(self.y.min())) / self.width if self.width > 0.0 else 0.0
        return share * BACK[0] * self.length, share * BACK[1] * self.length

    def foot(self, leg: int) -> tuple[int, int]:
        """Channels of a foot: forward and up."""
        return len(CHANNELS) + leg, len(CHANNELS) + len(self.x) + leg

    def side(self) -> RobotView:
        """The far legs, the body, the near legs."""
        sketch = _Sketch()
        far, near = (np.flatnonzero(one)[::-1].tolist() for one in (self.far, ~self.far))
        self._legs(sketch, far, FAR_LEG)
        if self.motion.held is not Held.FREE:
            self._body(sketch)
        self._legs(sketch, near, BLUE)
        return sketch.view

    def _body(self, sketch: _Sketch) -> None:
        """The faces of the body's box that are seen."""

        def face(y: float) -> list[int]:
            forward, upward = self.depth(y)
            corners = [(x, top) for top in (0.0, self.thick) for x in self.ends[:: -1 if top else 1]]
            return [
                sketch.point(x + forward, self.leg + top + upward, {SURGE: 1.0}, {HEAVE: 1.0, ROLL: y, PITCH: -x})
                for x, top in corners
            ]

        near, far = face(float(self.y.min())), face(float(self.y.max()))
        if self.width > 0.0:
            sketch.path(far, MUTED, 1.0, FAR_BODY)
            for a, b in ((3, 2), (1, 2)):
                sketch.path((near[a], near[b], far[b], far[a]), MUTED, 1.0, FAR_BODY)
        sketch.path(near, INK, 1.0, NEAR_BODY)

    def _legs(self, sketch: _Sketch, legs: Sequence[int], paint: str) -> None:
        feet: list[FootMark] = []
        for leg in legs:
            x, y, z = self.motion.hips[leg]
            forward, upward = self.depth(float(self.y[leg]))
            at, moves, lifts = float(self.x[leg]) + forward, *self.foot(leg)
            hip = {SURGE: 1.0, PITCH: z, YAW: -y}, {HEAVE: 1.0, ROLL: y, PITCH: -x}
            foot = sketch.point(at, upward, {moves: 1.0}, {lifts: 1.0})
            if self.motion.held is Held.SPRINGS:
                sketch.path(self._spring(sketch, at, lifts), paint)
            elif self.motion.held is Held.LEGS:
                sketch.path((sketch.point(at, float(self.hip[leg]) + upward, *hip), foot), paint, 2.0)
            feet.append(FootMark(leg, foot))
        sketch.parts += feet

    def _spring(self, sketch: _Sketch, x: float, lifts: int) -> list[int]:
        """Points of a spring from the body to a foot that goes upward alone."""
        turns, wide = 6, 0.008 * self.length
        inner = [(0.15 + 0.7 * (k + 0.5) / (2 * turns), wide * (-1) ** k) for k in range(2 * turns)]
        path = [(0.0, 0.0), (0.15, 0.0), *inner, (0.85, 0.0), (1.0, 0.0)]
        return [sketch.point(x + aside, (1.0 - s) * self.leg, {}, {lifts: s}) for s, aside in path]

    def above(self) -> RobotView:
        """The body and the feet from above, forward to the right, the left side up."""
        sketch = _Sketch()
        middle = 0.5 * float(self.y.min() + self.y.max())
        half = 0.5 * BODY_ABOVE * self.width
        corners = [(x, middle + side * half) for side in (-1.0, 1.0) for x in self.ends[:: -int(side)]]
        sketch.path([sketch.point(x, y, {}, {}) for x, y in corners], MUTED, 1.0, FAR_BODY)
        for leg, (x, y) in enumerate(zip(self.x.tolist(), self.y.tolist(), strict=True)):
            hip = sketch.point(x, middle + BODY_ABOVE * (y - middle), {}, {})
            foot = sketch.point(x, y, {self.foot(leg)[0]: 1.0, SURGE: -1.0}, {})
            sketch.path((hip, foot), FAR_LEG)
            sketch.parts.append(FootMark(leg, foot))
        return sketch.view

    def pieces(self, side: RobotView) -> list[Piece]:
        """The uneven ground below feet: in the colour of its leg where they go along several lines."""
        if not self.motion.ground:
            return []
        points = {one.leg: one.point for one in side.parts if isinstance(one, FootMark)}
        out = []
        for leg, far in enumerate(self.far.tolist()):
            forward, upward = self.depth(float(self.y[leg]))
            paint = MUTED if len(self.motion.ground) == 1 else FAR_LEG if far else BLUE
            place = float(self.x[leg]) + forward, upward, float(self.motion.hips[leg, 0])
            out.append(Piece(self.motion.line[leg], points[leg], *place, paint))
        return out


def _beam(motion: Motion) -> Drawing:
    """A beam through its points, level at its clamp at x = 0, over the ground of its feet."""
    sketch, first = _Sketch(), len(CHANNELS) + len(motion.legs)
    places, heights = motion.hips[:, 0], motion.hips[:, 2]
    length, usual = float(places.max()), float(heights.mean())
    powers = np.stack([places**2, places**3])[: len(places)]
    bent = np.linalg.inv(powers.T)  # coefficients of x^2 and x^3 by the points' displacements
    line = []
    for x in np.linspace(0.0, length, 41).tolist():
        share = np.array([x**2, x**3])[: len(places)] @ bent
        rest = {ONE: usual - float(share @ heights)}
        line.append(sketch.point(x, 0.0, {}, rest | {first + k: one for k, one in enumerate(share.tolist())}))
    half = 0.03 * length
    for leg in sorted({*range(len(places))} - {*motion.footless}):
        x, level = float(places[leg]), {ONE: usual - float(heights[leg])}
        sketch.path([sketch.point(x + aside, 0.0, {}, level) for aside in (-half, half)], MUTED, 2.0)
    rest = [sketch.point(x, 0.0, {}, {ONE: usual}) for x in (0.0, length)]
    sketch.path(rest, RULE)
    sketch.path(line, BLUE, 2.5)
    for leg, (x, height) in enumerate(zip(places.tolist(), heights.tolist(), strict=True)):
        sketch.parts.append(FootMark(leg, sketch.point(x, 0.0, {}, {ONE: usual - height, first + leg: 1.0})))
    reach = motion.foot_z + (usual - heights)[:, None]
    up = _round_factor(BENT * length, float(max(reach.max(), usual) - min(reach.min(), 0.0)))
    view = sketch.view
    box = _box(view, motion, 1.0, up, length)
    return Drawing(view, None, box, True, length, BENT * length, up, 1.0, _large(motion), level=False)


def _camera(motion: Motion, along: float, up: float) -> Floats:
    """What is added to all places (2, nt) [m] so that the body's centre stays, and moving ground lifts all."""
    return np.stack([-along * motion.coordinate("surge"), up * motion.ground_shift[1]])


def _box(view: RobotView, motion: Motion, along: float, up: float, wide: float) -> tuple[float, float, float, float]:
    """Ends of all that is drawn over all times, at least so wide."""
    at = view.placed(motion.channels, along, up) + _camera(motion, along, up)[:, None, :]
    (left, low), (right, high) = at.min(axis=(1, 2)).tolist(), at.max(axis=(1, 2)).tolist()
    short = 0.5 * max(wide - (right - left), 0.0)
    return left - short, right + short, min(low, 0.0), high


def _large(motion: Motion) -> float:
    """A large force of the ground [N]: all but a few are smaller."""
    forces = np.abs(np.concatenate([motion.normal, motion.friction]))
    pressed = forces[forces > 0.0]
    return float(np.percentile(pressed, 98.0)) if len(pressed) else 0.0


def _apart(x: Floats, y: Floats, alone: float) -> tuple[Floats, Floats, bool]:
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


def _round_factor(room: float, motion: float) -> float:
    """The largest of 1, 2, 5, 10, 20 ... that keeps a motion within its room; 1 at least."""
    if motion <= 0.0 or room <= motion:
        return 1.0
    return round_below(room / motion)


def round_below(value: float) -> float:
    """The largest of ... 0.5, 1, 2, 5, 10 ... not above a positive value."""
    power = 10.0 ** math.floor(math.log10(value))
    return next(step for step in (5.0, 2.0, 1.0) if step * power <= value * (1.0 + 1e-9)) * power


def _plain(view: RobotView) -> dict[str, Any]:
    """A view as lists: points [x, z, channel, weight, ... along, ... up], parts [points, edge, width, fill] or
    [leg, point]."""
    return {
        "points": [
            [
                *_numbers((one.x, one.z)),
                *([[at, *_numbers((weight,))] for at, weight in moved.items()] for moved in (one.along, one.up)),
            ]
            for one in view.points
        ],
        "parts": [
            [one.leg, one.point]
            if isinstance(one, FootMark)
            else [list(one.points), paint_of(one.edge), one.width, one.fill and paint_of(one.fill)]
            for one in view.parts
        ],
    }


def _numbers(values: Sequence[float]) -> list[float]:
    return [float(f"{value:.6g}") for value in values]
