"""Scene of a walker -> arrays of the walking engine."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from tarsus.core import _native
from tarsus.core.arrays import Body
from tarsus.model.drive.lower import lower
from tarsus.model.drive.pieces import Pieces
from tarsus.model.scene import Scene
from tarsus.model.structure.walker import Walker
from tarsus.plan.lowering import Plan, lower_scene, without_native

__all__ = ["WalkPlan", "lower_walker"]


@dataclass(frozen=True)
class WalkPlan:
    """A walker's scene as arrays: the plan of any scene, and the body with its legs.

    body: see `tarsus.core.arrays`; blocks (nt, 3): mass, stiffness and damping of the different legs, upward
    and along the way.
    """

    plan: Plan
    body: Body
    blocks: np.ndarray

    def __getstate__(self) -> dict[str, Any]:
        return without_native(self)

    @cached_property
    def native(self) -> _native.LeggedBody:
        """The body as the engine holds it: its weights are those of unit gravity, its gaps those of no run."""
        nb, weight = len(self.body.body_mass), -self.plan.system.weight
        return _native.LeggedBody(
            self.body._replace(body_weight=weight[:nb].copy(), weight=weight[nb + 1 :: 2].copy())
        )


def lower_walker(scene: Scene, drive: Callable[..., tuple[Pieces, Pieces]] = lower) -> WalkPlan:
    """Lower the scene of a walker to arrays; ``drive`` lowers its drives.

    Raises
    ------
    InputError
        Where a law of the user cannot be compiled.
    """
    walker = scene.robot.structure
    assert isinstance(walker, Walker)
    plan = lower_scene(scene, drive)
    names, nb = list(walker.legs), walker.body_size
    nl, nd = len(names), plan.drives
    legs = walker.legs.values()
    values = np.array(
        [
            [(one.mass, one.stiffness_v, one.damping_v), (one.mass, one.stiffness_l, one.damping_l)]
            for one in legs
        ]
    )
    blocks, kind = np.unique(values.reshape(2 * nl, 3), axis=0, return_inverse=True)
    hip = np.array([[walker.hip_row_z(leg), walker.hip_row_x(leg)] for leg in names])
    foot = np.full(nl, -1, dtype=np.int64)
    gap = np.zeros(nl)
    for f, one in enumerate(scene.robot.feet.values()):
        i = names.index(one.point)
        foot[i], gap[i] = f, one.gap
    leg = np.zeros(len(scene.robot.feet), dtype=np.int64)
    leg[foot[foot >= 0]] = np.flatnonzero(foot >= 0)
    loads = plan.system.loads
    onto = loads[nb:].reshape(nl, 2, nd)[:, ::-1]  # upward, then along the way
    touched = np.any(onto != 0.0, axis=1)
    first = np.concatenate([[0], np.cumsum(touched.sum(axis=1))])
    gain = np.array([onto[i, :, d] for i in range(nl) for d in np.flatnonzero(touched[i])]).reshape(-1, 2)
    driven_by = np.array([d for i in range(nl) for d in np.flatnonzero(touched[i])], dtype=np.int64)
    body = Body(
        body_mass=walker.body_mass(), body_weight=-plan.system.constant[:nb].copy(),
        lever=np.maximum(np.abs(hip).max(axis=(0, 1)), 1e-300), mass=values[:, 0, 0].copy(),
        stiffness=values[:, :, 1].copy(), damping=values[:, :, 2].copy(), hip=hip, gap=gap, foot=foot, leg=leg,
        kind=kind.reshape(nl, 2).astype(np.int64), weight=-plan.system.constant[nb + 1 :: 2].copy(),
        first=first.astype(np.int64), drive=driven_by, gain=gain, body_load=np.ascontiguousarray(loads[:nb].T),
    )  # fmt: skip
    return WalkPlan(plan, body, blocks)
