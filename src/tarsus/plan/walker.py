"""What the engine is told of a walker beside the plan of any scene: its body, and the legs that it stands on."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from tarsus.core import _native
from tarsus.core.arrays import Body
from tarsus.core.modes import LinearSystem
from tarsus.model.robot import Robot
from tarsus.model.structure.walker import Walker

__all__ = ["Legs", "lower_legs", "without_native"]


def without_native(of: Any) -> dict[str, Any]:
    """What is pickled: the fields; what the native engine holds of them is made again where it is needed."""
    return {name: of.__dict__[name] for name in of.__dataclass_fields__}


@dataclass(frozen=True)
class Legs:
    """A walker's body and legs as arrays.

    body: see `tarsus.core.arrays`; blocks (nt, 3): mass, stiffness and damping of the different legs, upward
    and along the way.
    """

    body: Body
    blocks: np.ndarray

    def __getstate__(self) -> dict[str, Any]:
        return without_native(self)

    @cached_property
    def native(self) -> _native.LeggedBody:
        """The body as the engine holds it: its weights are those of unit gravity, its gaps those of no run."""
        return _native.LeggedBody(self.body)


def lower_legs(robot: Robot, system: LinearSystem) -> Legs | None:
    """Body and legs of a robot with the linear structure ``system``; None where that does not walk."""
    walker = robot.structure
    if not isinstance(walker, Walker):
        return None
    names, nb = list(walker.legs), walker.body_size
    nl, nd = len(names), system.loads.shape[1]
    values = np.array(
        [
            [(one.mass, one.stiffness_v, one.damping_v), (one.mass, one.stiffness_l, one.damping_l)]
            for one in walker.legs.values()
        ]
    )
    blocks, kind = np.unique(values.reshape(2 * nl, 3), axis=0, return_inverse=True)
    hip = np.array([[walker.hip_row_z(leg), walker.hip_row_x(leg)] for leg in names])
    leg = np.array([names.index(one.point) for one in robot.feet.values()], dtype=np.int64)
    foot, gap = np.full(nl, -1, dtype=np.int64), np.zeros(nl)
    foot[leg], gap[leg] = np.arange(len(leg)), system.rest_gap
    onto = system.loads[nb:].reshape(nl, 2, nd)[:, ::-1]  # upward, then along the way
    touched = np.any(onto != 0.0, axis=1)
    of_leg, driven_by = np.nonzero(touched)
    body = Body(
        body_mass=walker.body_mass(), body_weight=-system.weight[:nb],
        lever=np.maximum(np.abs(hip).max(axis=(0, 1)), 1e-300), mass=values[:, 0, 0].copy(),
        stiffness=values[:, :, 1].copy(), damping=values[:, :, 2].copy(), hip=hip, gap=gap, foot=foot, leg=leg,
        kind=kind.reshape(nl, 2).astype(np.int64), weight=-system.weight[nb + 1 :: 2],
        first=np.concatenate([[0], np.cumsum(touched.sum(axis=1))]).astype(np.int64), drive=driven_by,
        gain=onto[of_leg, :, driven_by].reshape(-1, 2), body_load=np.ascontiguousarray(system.loads[:nb].T),
    )  # fmt: skip
    return Legs(body, blocks)
