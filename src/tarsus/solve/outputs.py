"""What instruments see of a robot: rows on its state, with what is known beforehand of its volts.

One place for modal and for walking robots. A point's displacement and velocity, a coordinate of a walker's body, a
drive's charge and current are linear in the state; so is an acceleration, once the forces of the ground on the feet are
given, and that of a walker's body without them.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence, Set
from dataclasses import dataclass
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
from tarsus.plan.lowering import lower_system
from tarsus.solve.differences import STEP, Stencil, directions_of

if TYPE_CHECKING:
    from tarsus.core.modes import LinearSystem
    from tarsus.core.states import SampledStates
    from tarsus.model.drive.pieces import Pieces
    from tarsus.model.scene import Scene
    from tarsus.plan.lowering import Plan
    from tarsus.solve.differences import Direction
    from tarsus.solve.slopes import WindowSlopes

Floats = NDArray[np.float64]

_MOTION = {
    Quantity.DISPLACEMENT: 0, Quantity.ANGLE: 0, Quantity.VELOCITY: 1, Quantity.ANGULAR_VELOCITY: 1,
    Quantity.ACCELERATION: 2,
}  # fmt: skip
"""Which derivative by time of a place or an angle a quantity is."""
_SPRINGS = ("stiffness_v", "damping_v", "stiffness_l", "damping_l", "acceleration")
"""Ends of paths on which rows depend through forces alone: of what is no acceleration none does."""
_TURNS = (Quantity.ANGLE, Quantity.ANGULAR_VELOCITY)


class Output(NamedTuple):
    """One thing that an instrument sees.

    quantity: what; at: of which point of the structure, coordinate of a walker's body (surge, heave, roll, pitch) or
    drive. motional: of a charge or a current the part by motion alone, as behind a bridge that takes off that of the
    capacitance.
    """

    quantity: Quantity
    at: str
    motional: bool = False

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
        ground = np.where(states.held, -states.pull, states.resistive + states.smooth)
        out = self.x_gain * (self.x @ states.x) + self.v_gain * (self.v @ states.v)
        return (
            out
            + self.normal @ ground
            + self._along(states.friction if friction is None else friction)
            + self.known
        )

    def slopes(self, states: SampledStates) -> Floats:
        """Their derivatives (nc, nt, P) by what the states have derivatives by, with the rows as they are. Raises
        InputError as `values`."""
        ground = np.where(states.held[..., None], -states.pull, states.resistive + states.smooth)
        self._along(None)
        moved = (
            gain[..., None] * np.tensordot(row, part, 1)
            for gain, row, part in ((self.x_gain, self.x, states.x), (self.v_gain, self.v, states.v))
        )
        out, pressed = sum(moved, np.zeros(1)), self.normal.any(axis=1)
        out[pressed] += np.tensordot(self.normal[pressed], ground, 1)  # forces may have none where motions do
        return out

    def _along(self, friction: Floats | None) -> Floats | float:
        """What friction adds, where there is any."""
        if friction is not None:
            return self.tangent @ friction
        lacking = [one.name for one, row in zip(self.outputs, self.tangent, strict=True) if row.any()]
        if lacking:
            raise InputError(
                [f"{name}: needs the friction on the feet, which is not known here" for name in lacking]
            )
        return 0.0


def output_rows(scene: Scene, outputs: Sequence[Output], times: ArrayLike) -> OutputRows:
    """Rows of outputs of a scene's robot on its states at times (nt,) [s], in any order.

    Charge and current flow into the actuator's terminal: q = C V + G w.x and dq/dt, with the volts behind the
    amplifier, C the drive's capacitance (0 unless given), w its load and G the gain of small signals at these volts
    (`VoltageLaw.small_signal_gain`). A current is without the impulses of volts that jump.

    Raises
    ------
    InputError
        For points, coordinates and drives that there are not, and quantities that they do not have.
    """
    problems = _faults(scene, outputs)
    if problems:
        raise InputError(problems)
    when = np.asarray(times, dtype=float)
    system = lower_system(scene)
    n, m = system.normals.shape
    charged = {one.at for one in outputs if one.quantity in (Quantity.CHARGE, Quantity.CURRENT)}
    count, drives = len(outputs), _Drives(scene, when, charged)
    width = len(when) if drives.vary else 1  # of gains that go with the volts
    rows = OutputRows(
        tuple(outputs), np.zeros((count, n)), np.zeros((count, n)), np.ones((count, width)),
        np.ones((count, width)), np.zeros((count, m)), np.zeros((count, m)), np.zeros((count, len(when))),
    )  # fmt: skip
    accelerated = [k for k, one in enumerate(outputs) if one.quantity is Quantity.ACCELERATION]
    for k, one in enumerate(outputs):
        if one.quantity not in _MOTION:
            drives.enter(rows, k, system)
        elif one.quantity is not Quantity.ACCELERATION:
            (rows.x, rows.v)[_MOTION[one.quantity]][k] = _row(scene, one.at)
    if accelerated:
        onto = np.array([_row(scene, outputs[k].at) for k in accelerated])
        per_force = solve(system.mass, onto.T).T  # the mass matrix is its own transpose
        rows.x[accelerated], rows.v[accelerated] = -per_force @ system.stiffness, -per_force @ system.damping
        rows.normal[accelerated] = per_force @ system.normals
        if scene.slides:
            rows.tangent[accelerated] = per_force @ _tangents(scene, system)
        forces = np.array([evaluate(drives.lowered(name)[0], when) for name in scene.robot.drives])
        rows.known[accelerated] = per_force @ system.loads @ forces.reshape(-1, len(when))
        rows.known[accelerated] += (per_force @ system.constant)[:, None]
    return rows


def output_slopes(
    scene: Scene,
    outputs: Sequence[Output],
    times: ArrayLike,
    states: SampledStates,
    slopes: WindowSlopes,
    gradients: Sequence[str] | Mapping[str, Direction] = (),
    plan: Plan | None = None,
) -> Floats:
    """Derivatives (nc, nt, P) of outputs of windows by what the windows have derivatives by.

    states, slopes: of a window or of several end to end, at times (nt,) [s]; gradients: the numbers of the scene among
    ``slopes.names``, by which rows vary as well. Rows are differentiated by differences: over a step of 1e-5 of
    a number 1e-10 of a curve remains, and 1e-11 of rounding.

    Raises InputError as `output_rows`, and for a number that cannot vary.
    """
    rows = output_rows(scene, outputs, times)
    held = slopes.states
    out = rows.slopes(held)
    own = rows.values(states)
    for name, direction in directions_of(scene, gradients).items():
        moved = {
            path: w
            for path, w in direction.items()
            if path.startswith(("robot.", "ground.gravity.", "ground.incline"))
        }
        late = [path for path in direction if path.startswith(("gait.", "signals.")) or ".amplifier." in path]
        if late and not all(_MOTION.get(one.quantity, 2) < 2 for one in outputs):
            raise InputError([f"{path}: charges, currents, forces and accelerations are not differentiated by what "
                              "moves the jumps of volts" for path in late])  # fmt: skip
        if all(_MOTION.get(one.quantity, 2) < 2 or one.quantity not in _MOTION for one in outputs):
            moved = {path: w for path, w in moved.items() if not path.endswith(_SPRINGS)}
        if not moved or late:
            continue
        stencil = Stencil.of(scene, moved, STEP, plan)
        copies = [
            output_rows(stencil.scene(scene, at), outputs, times).values(states) for at in stencil.places
        ]
        out[..., slopes.names.index(name)] += stencil.slope(own, copies)
    return out


class _Drives:
    """Volts, forces and charges of a scene's drives at times (nt,) [s], each lowered once; charged: those of which
    charge or current is asked, and ``vary`` whether the gain of one of them goes with its volts."""

    def __init__(self, scene: Scene, times: Floats, charged: Set[str]) -> None:
        self.drives = scene.robot.drives
        self.signals = scene.actuator_volts
        self.times = times
        self.gains = {name: self.drives[name].law.small_signal_gain() for name in charged}
        self.vary = any(gain[1:].any() for gain in self.gains.values())
        self._lowered: dict[str, tuple[Pieces, Pieces]] = {}

    def lowered(self, name: str) -> tuple[Pieces, Pieces]:
        """Force and volts of a drive as pieces."""
        if name not in self._lowered:
            drive = self.drives[name]
            self._lowered[name] = lower(self.signals[name], drive.law, drive.history)
        return self._lowered[name]

    def enter(self, rows: OutputRows, k: int, system: LinearSystem) -> None:
        """Fill in the row of an output of a drive."""
        one = rows.outputs[k]
        if one.quantity is Quantity.FORCE:
            rows.known[k] = evaluate(self.lowered(one.at)[0], self.times)
            return
        level = self.signals[one.at].volts(self.times)
        if one.quantity is Quantity.VOLTAGE:
            rows.known[k] = level
            return
        drive = self.drives[one.at]
        load = system.loads[:, list(self.drives).index(one.at)]
        capacitance = 0.0 if one.motional else drive.capacitance or 0.0
        gains = self.gains[one.at]
        gain = polyval(level, gains) if self.vary else gains[0]
        rows.x[k] = load
        if one.quantity is Quantity.CHARGE:
            rows.x_gain[k] = gain
            rows.known[k] = capacitance * level
            return
        rate = evaluate(self.lowered(one.at)[1].rate(), self.times)
        rows.v[k], rows.v_gain[k] = load, gain
        rows.x_gain[k] = polyval(level, polyder(gains)) * rate if self.vary else 0.0
        rows.known[k] = capacitance * rate


def _row(scene: Scene, at: str) -> Floats:
    """Weights (n,) of a point's displacement, or of a coordinate of the body, in the coordinates."""
    structure = scene.robot.structure
    if at in structure.points:
        return structure.row(at)
    row = np.zeros(structure.size)
    row[structure.body_coordinates.index(at)] = 1.0
    return row


def _tangents(scene: Scene, system: LinearSystem) -> Floats:
    """Rows (n, m) of the feet's places along the ground."""
    if system.tangents is not None:
        return system.tangents
    row = scene.robot.structure.row
    return np.stack([row(f"{foot.point}_x") for foot in scene.robot.feet.values()], axis=1)


def _faults(scene: Scene, outputs: Sequence[Output]) -> list[str]:
    """Sentences on outputs that a robot does not have."""
    structure, drives = scene.robot.structure, tuple(scene.robot.drives)
    angles = tuple(name for name in structure.body_coordinates if name in TURNS)
    places = tuple(name for name in (*structure.points, *structure.body_coordinates) if name not in angles)
    problems: list[str] = []
    for one in outputs:
        if one.quantity not in _MOTION:
            known, what = drives, "drive"
        elif one.quantity in _TURNS:
            known, what = angles, "angle of a body"
        else:
            known, what = places, "point"
        if one.at not in known:
            problems.append(f"{one.name}: the robot has no {what} '{one.at}'{nearest(one.at, known)}")
    return problems
