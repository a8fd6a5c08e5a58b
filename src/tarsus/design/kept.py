"""Runs that are kept on disk: a design that is killed and called again reads what it had and goes on, and ends the
same."""

from __future__ import annotations

import hashlib
import inspect
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tarsus.design.over import Grounds
from tarsus.design.walks import Walks
from tarsus.files.store import package_version
from tarsus.files.sweepstore import UNIT_FILES, SweepStore
from tarsus.files.toml import scene_text
from tarsus.model.scene import Scene
from tarsus.plan.source_hash import source_hash

__all__ = ["KEPT_FILES", "Kept", "store_of"]

Floats = NDArray[np.float64]

MOST_UNITS = 1_000_000
"""Units of six digits: batches that a search asks for, one after the other."""

KEPT_FILES = (
    *(f"{name}{end}" for name in ("scene.toml", "request.txt", "plan.json") for end in ("", ".*.part")),
    *UNIT_FILES,
)
"""What a design keeps in its folder while it works, as glob patterns."""


def store_of(folder: Path, scene: Scene, request: Sequence[str], *, resume: bool) -> SweepStore:
    """The store of a design in a folder.

    request: everything beside the scene that its runs depend on, line by line. Raises InputError as
    `SweepStore.open`.
    """
    texts = {"scene.toml": scene_text(scene), "request.txt": "\n".join(request) + "\n"}
    digest = hashlib.sha256()
    for text in (*texts.values(), package_version(), source_hash()):
        digest.update(text.encode() + b"\0")
    for law in scene.ground.laws.values():
        digest.update(Path(inspect.getfile(type(law))).read_bytes())
    return SweepStore.open(folder, digest.hexdigest(), MOST_UNITS, texts, resume=resume, what="design")


@dataclass
class Kept:
    """Walks, each batch of which is a unit of a store, in the order asked for; without a store nothing is kept.

    reused: runs that an earlier call had made.
    """

    walks: Walks
    store: SweepStore | None = None
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
