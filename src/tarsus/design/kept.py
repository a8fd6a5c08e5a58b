"""Runs that are kept on disk: a design that is killed and called again reads what it had and goes on, and ends the
same."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tarsus.design.over import Grounds
from tarsus.design.walks import Walks
from tarsus.files.runstore import UNIT_FILES, RunStore
from tarsus.files.toml import scene_texts
from tarsus.model.scene import Scene

__all__ = ["KEPT_FILES", "Kept", "store_of"]

Floats = NDArray[np.float64]

MOST_UNITS = 1_000_000
"""Units of six digits: batches that a search asks for, one after the other."""

KEPT_FILES = (
    *(
        f"{name}{end}"
        for name in ("scene.toml", "request.txt", "plan.json", "laws/*.py")
        for end in ("", ".*.part")
    ),
    *UNIT_FILES,
)
"""What a design keeps in its folder while it works, as glob patterns."""


def store_of(folder: Path, scene: Scene, request: Sequence[str], *, resume: bool) -> RunStore:
    """The store of a design in a folder.

    request: everything beside the scene that its runs depend on, line by line. Raises InputError as
    `RunStore.open`.
    """
    texts = {**scene_texts(scene), "request.txt": "\n".join(request) + "\n"}
    return RunStore.open(folder, texts, resume=resume, what="design", units=MOST_UNITS)


@dataclass
class Kept:
    """Walks, each batch of which is a unit of a store, in the order asked for; without a store nothing is kept.

    reused: runs that an earlier call had made.
    """

    walks: Walks
    store: RunStore | None = None
    reused: int = 0
    _asked: int = field(default=0)

    def __call__(self, points: Floats, grounds: Grounds) -> Floats:
        """As `Walks`."""
        n, ng = len(points), len(grounds)
        who, where = np.repeat(np.arange(n), ng), np.tile(np.arange(ng), n)
        found = self.each(points[who], {path: own[where] for path, own in grounds.values.items()})
        return found.reshape(n, ng, -1)

    def each(self, points: Floats, grounds: Mapping[str, Floats]) -> Floats:
        """As `Walks.each`."""
        unit, self._asked = self._asked, self._asked + 1
        given = np.column_stack([points, *grounds.values()])
        stored = None if self.store is None else self.store.read(unit)
        if stored is not None and np.array_equal(stored["given"], given):
            self.reused += len(given)
            return stored["costs"]
        costs = self.walks.each(points, grounds)
        if self.store is not None:
            self.store.write(unit, {"given": given, "costs": costs})
        return costs
