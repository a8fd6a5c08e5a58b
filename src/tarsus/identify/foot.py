"""What the steps of the chain need of a device: one foot, one drive, and the linear structure between them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from tarsus.base.arrays import Complexes, Floats
from tarsus.base.errors import InputError
from tarsus.base.spec import with_values
from tarsus.model.drive.laws import VoltageLaw
from tarsus.model.drive.waveforms import Waveform
from tarsus.model.scene import Scene
from tarsus.model.standing import rest_state
from tarsus.solve import ResultCode, Shared

if TYPE_CHECKING:
    from tarsus.core.states import SampledStates


@dataclass(frozen=True)
class FootModel:
    """A scene seen from one foot and one drive.

    Displacements are along +z; a force on the foot counts along its normal n, so that ``gap = gap(0) + n . x``.
    shared: what runs of it have made that others take, such as the force of a drive.
    """

    scene: Scene
    foot: str
    drive: str
    points: tuple[str, ...]
    shared: Shared = field(default_factory=Shared, repr=False, compare=False)

    @property
    def law(self) -> VoltageLaw:
        """From volts to force [N]."""
        return self.scene.robot.drives[self.drive].law

    @property
    def history(self) -> tuple[float, ...]:
        """Volts visited before a record begins."""
        return self.scene.robot.drives[self.drive].history

    @property
    def gap(self) -> float:
        """Distance of the foot from the ground at the neutral position, where no force bends the structure [m]."""
        return self.scene.robot.feet[self.foot].gap

    @property
    def normal(self) -> int:
        """1 above a ground facing up, -1 below one facing down."""
        return self.scene.robot.feet[self.foot].normal

    @property
    def foot_point(self) -> str:
        """Point of the structure that is the foot."""
        return self.scene.robot.feet[self.foot].point

    @cached_property
    def mass(self) -> Floats:
        """Mass matrix (n, n) [kg]."""
        return self.scene.robot.structure.matrices().mass

    @cached_property
    def damping(self) -> Floats:
        """Damping matrix (n, n) [N s/m]."""
        return self.scene.robot.structure.matrices().damping

    @cached_property
    def stiffness(self) -> Floats:
        """Stiffness matrix (n, n) [N/m]."""
        return self.scene.robot.structure.matrices().stiffness

    @cached_property
    def load(self) -> Floats:
        """Generalised force (n,) per newton of the drive."""
        return self.scene.robot.drives[self.drive].load.vector(self.scene.robot.structure)

    @cached_property
    def rows(self) -> Floats:
        """Rows (np, n): displacements of the measured points from the coordinates."""
        return np.array([self.scene.robot.structure.row(name) for name in self.points])

    @cached_property
    def row(self) -> Floats:
        """Row (n,): the foot's displacement along its normal."""
        return self.normal * self.scene.robot.structure.row(self.foot_point)

    @cached_property
    def by_coordinates(self) -> Floats:
        """Static displacements (n, np) of the points per newton on each coordinate [m/N]: ``rows K^-1``."""
        return np.asarray(np.linalg.solve(self.stiffness.T, self.rows.T), dtype=np.float64)

    @cached_property
    def by_drive(self) -> Floats:
        """Static displacements (np,) of the points per newton of the drive [m/N]: ``rows K^-1 load``."""
        return self.rows @ np.linalg.solve(self.stiffness, self.load)

    @cached_property
    def by_contact(self) -> Floats:
        """Static displacements (np,) of the points per newton on the foot along its normal [m/N]."""
        return self.rows @ np.linalg.solve(self.stiffness, self.row)

    @cached_property
    def static_load(self) -> float:
        """Static displacement of the foot along its normal per newton of the drive [m/N]."""
        return float(self.row @ np.linalg.solve(self.stiffness, self.load))

    @cached_property
    def _squares(self) -> Floats:
        """Squares of the angular frequencies of the modes [rad^2/s^2], undamped."""
        return np.asarray(np.linalg.eigvals(np.linalg.solve(self.mass, self.stiffness)).real, dtype=np.float64)

    @property
    def slowest(self) -> float:
        """Angular frequency of the first mode [rad/s]."""
        return float(np.sqrt(self._squares.min()))

    @property
    def fastest(self) -> float:
        """Angular frequency of the last mode [rad/s]."""
        return float(np.sqrt(self._squares.max()))

    @cached_property
    def like_damping(self) -> float:
        """Damper on the foot [N s/m] that damps the first mode by a hundredth: a first guess of a film."""
        compliance = float(self.row @ np.linalg.solve(self.stiffness, self.row))
        return 0.02 / (self.slowest * compliance)

    @cached_property
    def mobility(self) -> float:
        """Acceleration of the free foot per force on it [1/kg]: ``n M^-1 n``."""
        return float(self.row @ np.linalg.solve(self.mass, self.row))

    @cached_property
    def jump(self) -> Floats:
        """Change (n,) of the coordinates' velocities per unit change of the foot's along its normal, by the
        mass-weighted impact law: ``M^-1 n / (n M^-1 n)``."""
        return np.asarray(np.linalg.solve(self.mass, self.row) / self.mobility, dtype=np.float64)

    @cached_property
    def flow(self) -> Floats:
        """Matrix (2n, 2n) of the free motion: ``d(x, v)/dt = flow @ (x, v)``."""
        n = len(self.mass)
        out = np.zeros((2 * n, 2 * n))
        out[:n, n:] = np.eye(n)
        out[n:, :n] = -np.linalg.solve(self.mass, self.stiffness)
        out[n:, n:] = -np.linalg.solve(self.mass, self.damping)
        return out

    @cached_property
    def inputs(self) -> Floats:
        """Accelerations (2n, 2) of the state per newton of the drive, and per newton on the foot along its normal."""
        n = len(self.mass)
        out = np.zeros((2 * n, 2))
        out[n:, 0] = np.linalg.solve(self.mass, self.load)
        out[n:, 1] = np.linalg.solve(self.mass, self.row)
        return out

    def pull(self, state: Floats, force: Floats) -> Floats:
        """Net force [N] with which the structure pulls the foot off the ground, (N,) for states (2n, N).

        Positive along the normal. It is the force that holds the foot without acceleration, turned round:
        ``n M^-1 (load F - K x - D v) / (n M^-1 n)``, which is (2.13) for any linear structure.
        """
        n = len(self.mass)
        free = self.flow[n:] @ state + self.inputs[n:, :1] * force
        return (self.row @ free) / self.mobility

    def rest(self, level: float) -> Floats:
        """Displacements (np,) [m] of the points from the neutral position at rest, where the foot in contact is
        ``level`` [m] from the rest along +z: the drive holds the foot at ``-gap - level``."""
        return self.by_drive * ((-self.gap - self.normal * level) / self.static_load)

    def driven(self, signal: Waveform, gap: float | None = None) -> Scene:
        """The scene under another drive, at another gap [m] if given, begun at rest in the air, from which records
        count: gravity is balanced there, and left out."""
        begun = {"initial.displacement": rest_state(self.scene), "ground.gravity": None}
        if gap is not None:
            begun[f"robot.feet.{self.foot}.gap"] = gap
        return with_values(self.scene, {"signals": {self.drive: signal}, **begun})

    def run(self, scene: Scene, seconds: float, times: Floats) -> tuple[ResultCode, NDArray[np.void], SampledStates]:
        """How a simulation of a `driven` scene ends, its events and its states at times (nt,) [s], in order."""
        from tarsus.solve import sampled_run

        return sampled_run(scene, seconds, times, self.shared)

    def states(self, scene: Scene, seconds: float, times: Floats) -> SampledStates:
        """States at times (nt,) [s] of a simulation; InputError of one that does not reach its end."""
        ended, _, states = self.run(scene, seconds, times)
        if ended is not ResultCode.DONE:
            raise InputError(f"the identified device cannot be simulated with this drive: {ended}")
        return states

    def changed(self, values: Mapping[str, Any]) -> FootModel:
        """The same with other values in the scene, by path."""
        return replace(self, scene=with_values(self.scene, values)) if values else self


def response(flow: Floats | Complexes, push: Floats | Complexes, step: float, more: Floats | float = 0.0) -> Floats:
    """States (m, nf) from rest of ``z' = flow z + push``, with a push (m, nf) that runs straight between the ends of
    steps [s], and, on top, one that is held over each of them (m, nf - 1): the mean of a push that jumps in a step."""
    poles, right = np.linalg.eig(flow)
    back = np.linalg.inv(right)
    own, held = back @ push, back @ np.broadcast_to(more, push[:, 1:].shape)
    out = []
    for pole, one, extra in zip(poles, own, held, strict=True):
        turn = pole * step
        first, second = np.expm1(turn) / turn, (np.expm1(turn) - turn) / turn**2
        added = step * ((first - second) * one[:-1] + second * one[1:] + first * extra)
        out.append(lfilter([1.0], [1.0, -np.exp(turn)], np.concatenate([[0.0], added])))
    return np.asarray(np.real(right @ np.array(out)), dtype=np.float64)
