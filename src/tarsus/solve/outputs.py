"""What instruments see of a robot: rows on its state, with what is known beforehand of its volts.

One place for modal and for walking robots. A point's displacement and velocity, a coordinate of a walker's body, a
drive's charge and current are linear in the state; so is an acceleration, once the forces of the ground on the feet are
given, and that of a walker's body without them.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.polynomial.polynomial import polyder, polyval
from numpy.typing import ArrayLike, NDArray

from tarsus.base.errors import InputError
from tarsus.base.linear import solve
from tarsus.base.messages import nearest
from tarsus.base.quantities import Quantity
from tarsus.model.drive.lower import evaluate, lower
from tarsus.model.structure.walker import TURNS
from tarsus.plan.lowering import SPRINGS, lower_system
from tarsus.plan.moving import ground_forces, shifts_of
from tarsus.solve.channels import BODY, DRIVE, POINT, measured_by
from tarsus.solve.differences import STEP, Stencil, directions_of, slope_by

if TYPE_CHECKING:
    from tarsus.core.modes import LinearSystem
    from tarsus.core.states import SampledStates
    from tarsus.model.drive.pieces import Pieces
    from tarsus.model.drive.signal import Signal
    from tarsus.model.scene import Scene
    from tarsus.plan.lowering import Plan
    from tarsus.solve.channels import RunChannel
    from tarsus.solve.differences import Direction
    from tarsus.solve.slopes import WindowSlopes
    from tarsus.solve.window_gradients import Entered

Floats = NDArray[np.float64]
LowerDrive = Callable[..., tuple["Pieces", "Pieces"]]
"""Lowers a drive, as `tarsus.model.drive.lower.lower` does."""

_KINEMATIC = (Quantity.DISPLACEMENT, Quantity.ANGLE, Quantity.VELOCITY, Quantity.ANGULAR_VELOCITY)
"""What depends on the state alone, not on forces or volts."""
_SPRINGS = (*SPRINGS, "acceleration")
"""Ends of paths on which rows depend through forces alone: of what is no acceleration none does."""


class Output(NamedTuple):
    """One thing that an instrument sees: a channel of `tarsus.solve.channels` at one place.

    quantity: what; at: of which point of the structure, coordinate of a walker's body (surge, heave, roll, pitch) or
    drive. motional: of a charge or a current the part by motion alone, as behind a bridge that takes off that of the
    capacitance.
    """

    quantity: Quantity
    at: str
    motional: bool = False

    @property
    def channel(self) -> RunChannel:
        """What the table says of it."""
        return measured_by(self.quantity, self.motional)

    @property
    def name(self) -> str:
        """Such as ``body velocity`` or ``front motional current``."""
        return f"{self.at} {'motional ' * self.motional}{self.quantity.name.lower().replace('_', ' ')}"


@dataclass(frozen=True)
class OutputRows:
    """Outputs of a robot at nt times as functions of its state that are linear,

        x_gain * (x @ states.x) + v_gain * (v @ states.v) + normal @ ground + tangent @ friction + known,

    with the ground's forces on the feet along their normals and along the way [N].

    x, v (nc, n): rows; x_gain, v_gain (nc, nt) or (nc, 1): gains of drives, which go with their volts where a law is
    not linear; normal, tangent (nc, m); known (nc, nt): by the volts and the weight. In SI units of the outputs.
    """

    outputs: tuple[Output, ...]
    x: Floats
    v: Floats
    x_gain: Floats
    v_gain: Floats
    normal: Floats
    tangent: Floats
    known: Floats

    def values(self, states: SampledStates, friction: Floats | None = None) -> Floats:
        """The outputs (nc, nt) in these states; friction (m, nt) [N]: that of the states unless given, which those of a
        walker do not have. Raises InputError for an output that needs friction where there is none."""
        out = self.free(states.x, states.v) + self._along(states.friction if friction is None else friction)
        if self.pressed:
            out += self.normal @ np.where(states.held, -states.pull, states.resistive + states.smooth)
        return out

    def free(self, x: Floats, v: Floats) -> Floats:
        """The same but for the ground's forces, at displacements and velocities (n, nt)."""
        return self.x_gain * (self.x @ x) + self.v_gain * (self.v @ v) + self.known

    def slopes(self, states: SampledStates) -> Floats:
        """Their derivatives (nc, nt, P) by what the states have derivatives by, with the rows as they are. Raises
        InputError as `values`."""
        self._along(None)
        moved = (
            gain[..., None] * np.tensordot(row, part, 1)
            for gain, row, part in ((self.x_gain, self.x, states.x), (self.v_gain, self.v, states.v))
        )
        out = sum(moved, np.zeros(1))
        if self.pressed:
            pressed = self.normal.any(axis=1)  # forces may have none where motions do
            ground = np.where(states.held[..., None], -states.pull, states.resistive + states.smooth)
            out[pressed] += np.tensordot(self.normal[pressed], ground, 1)
        return out

    @property
    def pressed(self) -> bool:
        """Whether any needs the ground's forces along the normals of the feet."""
        return bool(self.normal.any())

    def _along(self, friction: Floats | None) -> Floats | float:
        """What friction adds, where there is any."""
        if friction is not None:
            return self.tangent @ friction
        lacking = [one.name for one, row in zip(self.outputs, self.tangent, strict=True) if row.any()]
        if lacking:
            raise InputError([f"{name}: needs the friction on the feet, which is not known here" for name in lacking])
        return 0.0


class Weights(NamedTuple):
    """How one output is read from states: weights (n,) of displacements and velocities with their gains, one or (nt,),
    weights (m,) of the ground's forces on the feet along their normals and along the way, and what is known (nt,) by
    the volts and the weight; None is zero."""

    x: Floats | None = None
    v: Floats | None = None
    x_gain: Floats | float = 1.0
    v_gain: Floats | float = 1.0
    normal: Floats | None = None
    tangent: Floats | None = None
    known: Floats | None = None


class Readings:
    """How outputs of a scene's robot are read from its states at times (nt,) [s]; or from those of nt robots that are
    under some volts (nt,) by drive, which do not change."""

    def __init__(
        self,
        scene: Scene,
        times: Floats,
        volts: Mapping[str, Floats] | None = None,
        system: LinearSystem | None = None,
        drive: LowerDrive = lower,
    ) -> None:
        self.scene, self.times, self._volts = scene, times, volts
        self.system = lower_system(scene) if system is None else system
        self._lower, self._lowered = drive, dict[str, "tuple[Pieces, Pieces]"]()

    def rows(self, outputs: Sequence[Output]) -> OutputRows:
        """All of them side by side. Raises InputError as `output_rows`."""
        problems = _faults(self.scene, outputs)
        if problems:
            raise InputError(problems)
        each = [one.channel.linear(self, one.at) for one in outputs if one.channel.linear is not None]
        n, m = self.system.normals.shape
        gains = [gain for one in each for gain in (one.x_gain, one.v_gain)]
        wide = len(self.times) if any(map(np.ndim, gains)) else 1

        def whole(name: str, width: int) -> Floats:
            out = np.zeros((len(each), width))
            for row, one in zip(out, each, strict=True):
                if (value := getattr(one, name)) is not None:
                    row[:] = value
            return out

        return OutputRows(
            tuple(outputs),
            whole("x", n),
            whole("v", n),
            whole("x_gain", wide),
            whole("v_gain", wide),
            whole("normal", m),
            whole("tangent", m),
            whole("known", len(self.times)),
        )

    def place(self, at: str) -> Weights:
        """Displacement of a point, or a coordinate of the body."""
        return Weights(x=self.row(at))

    def speed(self, at: str) -> Weights:
        """Its rate."""
        return Weights(v=self.row(at))

    def acceleration(self, at: str) -> Weights:
        """The rate of that."""
        system = self.system
        per_force = solve(system.mass, self.row(at))  # the mass matrix is its own transpose
        known = per_force @ system.loads @ self._driven + per_force @ system.constant
        for direction, shift in shifts_of(self.scene).items():  # an accelerometer senses the ground's as well
            way = self.scene.robot.structure.translation(direction)
            assert way is not None  # checked by Scene
            known = known + float(self.row(at) @ way) * shift.at(self.times, 2)
        return Weights(
            -per_force @ system.stiffness,
            -per_force @ system.damping,
            normal=per_force @ system.normals,
            tangent=per_force @ self._tangents if self.scene.slides else None,
            known=known,
        )

    def force(self, drive: str) -> Weights:
        """Force of a drive."""
        return Weights(known=evaluate(self._pieces(drive)[0], self.times))

    def volts(self, drive: str) -> Weights:
        """Volts at its actuator."""
        return Weights(known=self._level(drive))

    def charge(self, drive: str, *, motional: bool = False) -> Weights:
        """Charge that has flown into its terminal."""
        capacitance = 0.0 if motional else self.scene.robot.drives[drive].capacitance or 0.0
        level, gains = self._level(drive), self._gains(drive)
        gain = np.asarray(polyval(level, gains), dtype=np.float64) if gains[1:].any() else gains[0]
        return Weights(x=self._load(drive), x_gain=gain, known=capacitance * level)

    def current(self, drive: str, *, motional: bool = False) -> Weights:
        """The rate of that."""
        rate = np.zeros(len(self.times))
        if self._volts is None:
            rate = evaluate(self._pieces(drive)[1].rate(), self.times)
        own, gains, load = self.charge(drive, motional=motional), self._gains(drive), self._load(drive)
        bent = polyval(self._level(drive), polyder(gains)) * rate if gains[1:].any() else 0.0
        capacitance = 0.0 if motional else self.scene.robot.drives[drive].capacitance or 0.0
        return Weights(load, load, bent, own.x_gain, known=capacitance * rate)

    @cached_property
    def _driven(self) -> Floats:
        """Forces (nd, nt) of the drives and of ground that moves."""
        pieces = [self._pieces(name)[0] for name in self.scene.robot.drives]
        pieces += [one.pieces for one in ground_forces(self.scene, self.system)]
        return np.array([evaluate(one, self.times) for one in pieces]).reshape(-1, len(self.times))

    def _level(self, drive: str) -> Floats:
        if self._volts is not None:
            return self._volts[drive]
        return np.asarray(self._signals[drive].volts(self.times), dtype=float)

    @cached_property
    def _signals(self) -> Mapping[str, Signal]:
        return self.scene.actuator_volts

    def _gains(self, drive: str) -> Floats:
        """Coefficients of the gain of small signals by the volts."""
        return self.scene.robot.drives[drive].law.small_signal_gain()

    def _load(self, drive: str) -> Floats:
        return self.system.loads[:, list(self.scene.robot.drives).index(drive)]

    def _pieces(self, drive: str) -> tuple[Pieces, Pieces]:
        """Force and volts of a drive as pieces, lowered once."""
        if drive not in self._lowered:
            own = self.scene.robot.drives[drive]
            self._lowered[drive] = self._lower(self._signals[drive], own.law, own.history)
        return self._lowered[drive]

    def row(self, at: str) -> Floats:
        """Weights (n,) of a point's displacement, or of a coordinate of the body, in the coordinates."""
        structure = self.scene.robot.structure
        if at in structure.points:
            return structure.row(at)
        row = np.zeros(structure.size)
        row[structure.body_coordinates.index(at)] = 1.0
        return row

    @property
    def _tangents(self) -> Floats:
        """Rows (n, m) of the feet's places along the ground."""
        if self.system.tangents is not None:
            return self.system.tangents
        row = self.scene.robot.structure.row
        return np.stack([row(f"{foot.point}_x") for foot in self.scene.robot.feet.values()], axis=1)


def output_rows(
    scene: Scene,
    outputs: Sequence[Output],
    times: ArrayLike,
    *,
    system: LinearSystem | None = None,
    drive: LowerDrive = lower,
) -> OutputRows:
    """Rows of outputs of a scene's robot on its states at times (nt,) [s], in any order.

    system: the linear structure, where it is known; drive: lowers drives.

    Charge and current flow into the actuator's terminal: q = C V + G w.x and dq/dt, with the volts behind the
    amplifier, C the drive's capacitance (0 unless given), w its load and G the gain of small signals at these volts
    (`VoltageLaw.small_signal_gain`). A current is without the impulses of volts that jump. Above ground that moves
    displacements and velocities are those against it, accelerations those in the laboratory.

    Raises
    ------
    InputError
        For points, coordinates and drives that there are not, and quantities that they do not have.
    """
    return Readings(scene, np.asarray(times, dtype=float), system=system, drive=drive).rows(outputs)


def output_slopes(
    scene: Scene,
    outputs: Sequence[Output],
    times: ArrayLike,
    states: SampledStates,
    slopes: WindowSlopes,
    gradients: Sequence[str] | Mapping[str, Direction] = (),
    plan: Plan | None = None,
    perturbed: Entered | None = None,
    drive: LowerDrive = lower,
) -> Floats:
    """Derivatives (nc, nt, P) of outputs of windows by what the windows have derivatives by.

    states, slopes: of a window or of several end to end, at times (nt,) [s]; gradients: the numbers of the scene among
    ``slopes.names``, by which rows vary as well; perturbed: scenes next to it, where made; drive: lowers drives. Rows
    are differentiated by differences: over a step of 1e-5 of a number 1e-10 of a curve remains, and 1e-11 of rounding.

    Raises InputError as `output_rows`, and for a number that cannot vary.
    """
    rows = output_rows(scene, outputs, times, system=None if plan is None else plan.system, drive=drive)
    held, every = slopes.states, list(range(len(outputs)))
    accelerated = [k for k in every if outputs[k].quantity is Quantity.ACCELERATION]
    out = rows.slopes(held)
    own, kinematic = rows.values(states), all(one.quantity in _KINEMATIC for one in outputs)
    for name, direction in directions_of(scene, gradients).items():
        moved = {
            path: w
            for path, w in direction.items()
            if path.startswith(("robot.", "ground.gravity.", "ground.incline", "ground.motion."))
        }
        late = [path for path in direction if path.startswith(("gait.", "signals.")) or ".amplifier." in path]
        if late and not kinematic:
            raise InputError(
                [
                    f"{path}: charges, currents, forces and accelerations are not differentiated by what "
                    "moves the jumps of volts"
                    for path in late
                ]
            )
        which = accelerated if all(path.endswith(_SPRINGS) for path in moved) else every
        if not (moved and which) or late:
            continue
        some, number = [outputs[k] for k in which], slopes.names.index(name)
        if perturbed is not None and plan is not None and all(path.endswith(SPRINGS) for path in direction):
            # these act on an acceleration by the forces of springs and dampers alone
            places, pair = perturbed.pairs([name], STEP)[name]
            read = Readings(scene, np.zeros(0), system=plan.system)
            per_force = np.array([solve(plan.system.mass, read.row(one.at)) for one in some])
            one, two = ((plan if copy is None else copy).system for copy, _ in pair)
            own_stiffness, own_damping = plan.system.stiffness, plan.system.damping
            stiffness = slope_by(one.stiffness - own_stiffness, two.stiffness - own_stiffness, places)
            damping = slope_by(one.damping - own_damping, two.damping - own_damping, places)
            out[which, :, number] -= per_force @ (stiffness @ states.x + damping @ states.v)
            continue
        stencil = Stencil.of(scene, moved, STEP, plan)
        one, two = (
            output_rows(stencil.scene(scene, at), some, times, drive=drive).values(states) - own[which]
            for at in stencil.places.tolist()
        )
        out[which, :, number] += slope_by(one, two, stencil.places)
    return out


def _faults(scene: Scene, outputs: Sequence[Output]) -> list[str]:
    """Sentences on outputs that a robot does not have."""
    structure = scene.robot.structure
    angles = tuple(name for name in structure.body_coordinates if name in TURNS)
    places = tuple(name for name in (*structure.points, *structure.body_coordinates) if name not in angles)
    known = {DRIVE: (tuple(scene.robot.drives), "drive"), BODY: (angles, "angle of a body"), POINT: (places, "point")}
    each = [(one, *known[one.channel.over]) for one in outputs]
    return [
        f"{one.name}: the robot has no {what} '{one.at}'{nearest(one.at, names)}"
        for one, names, what in each
        if one.at not in names
    ]
