"""What engines have made that others can use: tables of structures, drives, plans of scenes that are run again."""

from __future__ import annotations

import threading
from collections import OrderedDict
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from tarsus.base.spec import with_values
from tarsus.model.drive.lower import lower

if TYPE_CHECKING:
    from tarsus.model.drive.law import VoltageLaw
    from tarsus.model.drive.pieces import Pieces
    from tarsus.model.drive.signal import Signal
    from tarsus.model.scene import Scene

MOST_KEPT = 512
"""So many scenes, plans, tables of structures and drives are kept for later runs: those of a cantilever with other
frequencies are 0.14 MB, and a search under uncertain ones comes back to a hundred."""


class Shared:
    """What engines have made that others can use, by what it depends on: tables of structures, drives; those last used.

    resident: a scene that is run again and again, whose variants and plans are kept as well. Safe between threads.
    """

    def __init__(self, resident: Scene | None = None, most: int = MOST_KEPT) -> None:
        self.resident = resident
        self._most = most
        self._made: OrderedDict[Any, Any] = OrderedDict()
        self._lock = threading.Lock()

    def __reduce__(self) -> tuple[Any, ...]:
        """In another process everything is made again."""
        return Shared, (self.resident, self._most)

    @property
    def keys(self) -> list[Any]:
        """What is kept, by what it depends on; the last one used comes last."""
        with self._lock:
            return list(self._made)

    def drive(self, signal: Signal, law: VoltageLaw, history: tuple[float, ...]) -> tuple[Pieces, Pieces]:
        """Pieces of a drive, lowered once."""
        return self.get((signal, law, history), lambda: lower(signal, law, history))

    def variant(self, scene: Scene, changes: tuple[tuple[str, float], ...]) -> Scene:
        """A scene with other values by path, made once."""
        return self.get(("scene", changes), lambda: with_values(scene, dict(changes))) if changes else scene

    def get(self, key: Any, make: Callable[[], Any]) -> Any:
        """What belongs to a key; made if it is not there, outside of the lock: of two the first made stays."""
        with self._lock:
            found = self._made.get(key)
            if found is not None:
                self._made.move_to_end(key)
                return found
        made = make()
        with self._lock:
            made = self._made.setdefault(key, made)
            self._made.move_to_end(key)
            while len(self._made) > self._most:
                self._made.popitem(last=False)
        return made
