"""By what windows are differentiated: scenes beside theirs, start states and moments."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import numpy.typing as npt

from tarsus.base.errors import InputError
from tarsus.base.spec import with_values
from tarsus.plan.lowering import Plan, lower_scene
from tarsus.plan.rows import Rows, rows_of
from tarsus.plan.slots import rows_for, slot
from tarsus.solve.differences import Direction, Stencil, directions_of

if TYPE_CHECKING:
    from tarsus.model.scene import Scene

Floats = npt.NDArray[np.float64]


class ScenePair(NamedTuple):
    """Two scenes beside one along a direction: how far each is (2,), its plan, None for that of the scene itself, and
    its row of data."""

    places: Floats
    copies: tuple[tuple[Plan | None, Rows], ...]


@dataclass(frozen=True)
class Entered:
    """What windows run on, and by which numbers of it they have derivatives.

    row: one row of data; names: of the numbers; beside: pairs by name at a part of their numbers' size, for some names.
    """

    row: Rows
    names: tuple[str, ...]
    beside: Callable[[Sequence[str], float], Mapping[str, ScenePair]]

    @classmethod
    def of(cls, scene: Scene, plan: Plan, paths: Sequence[str] | Mapping[str, Direction]) -> Entered:
        """By numbers of the scene of a plan at paths, or along directions by name; where it begins is a window's own.

        Raises InputError for what is no number of the scene, or one that cannot vary.
        """
        directions = directions_of(scene, paths)
        moving = with_values(scene, {"initial.standing": None})
        free = replace(plan, stance=None)
        return cls(rows_of(plan), tuple(directions), partial(_pairs, moving, free, directions))


def _pairs(
    scene: Scene, plan: Plan, directions: Mapping[str, Direction], names: Sequence[str], part: float
) -> dict[str, ScenePair]:
    """Scenes beside one: rows of its plan where all that moves are data, else plans of their own."""
    steps = {name: Stencil.of(scene, directions[name], part, plan) for name in names}
    rows = {name: one for name, one in steps.items() if all(slot(scene, path) for path in one.direction)}
    base = {path: value for one in rows.values() for path, value in one.base.items()}
    each = [base | one.values(place) for one in rows.values() for place in one.places]
    columns = {path: np.array([row[path] for row in each]) for path in base}
    made = rows_for(scene, plan, columns, 0.0, scaled=False, count=len(each)) if each else None
    out, first = dict[str, ScenePair](), 0
    for name, one in steps.items():
        copies: list[tuple[Plan | None, Rows]]
        if name in rows:
            assert made is not None
            copies = [(None, made.taken(slice(k, k + 1))) for k in (first, first + 1)]
            first += 2
        else:
            copies = [_lowered(one.scene(scene, place), plan, name) for place in one.places.tolist()]
        out[name] = ScenePair(one.places, tuple(copies))
    return out


def _lowered(scene: Scene, plan: Plan, name: str) -> tuple[Plan, Rows]:
    """A scene beside that of a plan, whose scales it has; its row. Raises InputError where its structure is larger."""
    own = replace(lower_scene(scene), length=plan.length, force=plan.force, rate=plan.rate)
    if own.initial.shape != plan.initial.shape:
        raise InputError(f"{name}: there is no derivative by it, for the structure changes its size")
    return own, rows_of(own)


@dataclass(frozen=True)
class WindowGradients:
    """By what windows are differentiated.

    entered: what enters them, with derivatives by numbers of a scene, all by the same numbers; of windows that differ
    in their data several, of which each window names its own. state: by the start state, whose displacements and
    velocities are then ``state.0`` to ``state.{2n - 1}``, or by window along directions (2n, q) of it, ``state.0`` to
    ``state.{q - 1}``; t0: by the moment of the start, with the start state and the times of outputs as they are.
    Contacts and flights that begin with the window begin later with it. enough: part of slopes that they may be off by
    before a second pair of windows is made, in better steps.
    """

    entered: Sequence[Entered] = ()
    state: bool | Sequence[Floats] = True
    t0: bool = True
    enough: float = 1e-6

    @classmethod
    def of(
        cls,
        scene: Scene,
        plan: Plan,
        paths: Sequence[str] | Mapping[str, Direction],
        *,
        state: bool = True,
        t0: bool = True,
    ) -> WindowGradients:
        """By numbers of the scene of a plan at paths, or along directions by name. Raises InputError as `Entered.of`
        does."""
        return cls((Entered.of(scene, plan, paths),), state, t0)

    @property
    def paths(self) -> tuple[str, ...]:
        """Names of the numbers of a scene."""
        return self.entered[0].names if self.entered else ()

    def along(self, windows: int, coordinates: int) -> Floats:
        """Directions (nw, 2n, q) of the start states, of a structure of so many coordinates."""
        if isinstance(self.state, bool):
            own = np.eye(2 * coordinates)[:, : 2 * coordinates if self.state else 0]
            return np.broadcast_to(own, (windows, *own.shape))
        return np.array(self.state, dtype=float).reshape(windows, 2 * coordinates, -1)

    def names(self, along: Floats) -> tuple[str, ...]:
        """Names of all numbers, in the order of derivatives."""
        states = tuple(f"state.{i}" for i in range(along.shape[2]))
        return (*self.paths, *states, *(("t0",) if self.t0 else ()))
