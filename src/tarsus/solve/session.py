"""A scene that is run again and again with other numbers: what the engine made for it stays."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from numpy.typing import ArrayLike

from tarsus.files.library import SceneLike, as_scene
from tarsus.plan.slots import Place, slots
from tarsus.solve.batch import Batch, columns, simulate_batch
from tarsus.solve.simulate import Shared, changed_run, seconds_of

if TYPE_CHECKING:
    from tarsus.model.scene import Scene
    from tarsus.solve.engine import Accuracy
    from tarsus.solve.run import Run
    from tarsus.solve.trajectories import Trajectories


class Session:
    """Runs of one scene with some of its numbers changed, which share contact modes and step tables.

    Runs that differ in numbers that are data of a plan (`slots`) share the plan and all tables: nothing is lowered for
    them. Others share tables with earlier runs of the same structure, of which the last 32 are kept. Every run is the
    one that `simulate` makes of the changed scene, to rounding of its drives. Safe between threads.
    """

    def __init__(self, scene: SceneLike) -> None:
        """scene: a scene, or a device's name or a scene file's path."""
        self.scene: Scene = as_scene(scene)
        self._shared = Shared(self.scene)

    def __repr__(self) -> str:
        return f"Session({self.scene.name!r})"

    @property
    def slots(self) -> Mapping[str, Place]:
        """The numbers that need no tables of their own, by path."""
        return slots(self.scene)

    def run(
        self,
        values: Mapping[str, Any] | None = None,
        duration: float | str | None = None,
        accuracy: Accuracy | None = None,
    ) -> Run:
        """One run with values in place of the scene's own, by path, as `tarsus.with_values` takes them.

        duration [s], accuracy: as for `simulate`. Raises InputError as these two do.
        """
        return changed_run(self.scene, values or {}, seconds_of(self.scene, duration), accuracy, self._shared)

    def batch(
        self, vary: Mapping[str, ArrayLike], duration: float | str | None = None, **options: Any
    ) -> Batch:
        """Many runs, as `simulate_batch` makes them; options as there. Raises InputError as it does."""
        return simulate_batch(self.scene, vary, duration, shared=self._shared, **options)

    def trajectories(
        self, vary: Mapping[str, ArrayLike], longest: float | str, accuracy: Accuracy | None = None
    ) -> Trajectories:
        """Runs that go on as long as each is asked to, up to ``longest`` [s] or a text with a unit; vary: values (nr,)
        of slots by path, as `simulate_batch` takes them. Raises InputError as it and `Trajectories.of` do."""
        from tarsus.solve.trajectories import Trajectories

        values = columns(self.scene, vary, grid=False)
        return Trajectories.of(
            self.scene, values, seconds_of(self.scene, longest), accuracy=accuracy, shared=self._shared
        )
