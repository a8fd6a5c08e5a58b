"""A scene that is run again and again with other numbers: what the engine made for it stays."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from numpy.typing import ArrayLike

from tarsus.base.spec import with_values
from tarsus.model.scene import Scene
from tarsus.plan.slots import Place, slots
from tarsus.solve.batch import Batch, simulate_batch
from tarsus.solve.engine import Accuracy
from tarsus.solve.engines import Shared
from tarsus.solve.run import Run
from tarsus.solve.simulate import simulate

__all__ = ["Session"]


class Session:
    """Runs of one scene with some of its numbers changed, which share contact modes and step tables.

    Numbers that are data of a plan (`slots`) share all tables; others share them with earlier runs of the same
    structure, of which the last 32 are kept. Every run is the one that `simulate` makes of the changed scene. Safe
    between threads.
    """

    def __init__(self, scene: Scene) -> None:
        self.scene = scene
        self._shared = Shared()

    def __repr__(self) -> str:
        return f"Session({self.scene.name!r})"

    @property
    def slots(self) -> Mapping[str, Place]:
        """The numbers that need no tables of their own, by path."""
        return slots(self.scene)

    def run(
        self,
        values: Mapping[str, Any] | None = None,
        duration: float | None = None,
        accuracy: Accuracy | None = None,
    ) -> Run:
        """One run with values in place of the scene's own, by path, as `tarsus.with_values` takes them.

        duration [s], accuracy: as for `simulate`. Raises InputError as these two do.
        """
        return simulate(with_values(self.scene, values or {}), duration, accuracy, shared=self._shared)

    def batch(self, vary: Mapping[str, ArrayLike], duration: float | None = None, **options: Any) -> Batch:
        """Many runs, as `simulate_batch` makes them; options as there. Raises InputError as it does."""
        return simulate_batch(self.scene, vary, duration, shared=self._shared, **options)
