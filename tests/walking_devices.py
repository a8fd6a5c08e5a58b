"""A millipede for tests of the engine and of reports that does not change when the packaged devices do."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path

import tarsus as ts
from tarsus.report.motion import Motion, motion_of
from tarsus_reproduce.walkers import many_legs

CREEPING = Path(__file__).parent / "data" / "creeping_millipede.toml"


def creeping_millipede() -> ts.Scene:
    """Two overdamped legs, lifted from relaxed springs: one slip before each leaves, and no bounce."""
    return ts.load_scene(str(CREEPING))


@lru_cache
def walk(legs: int, seconds: float = 0.2) -> Motion:
    """The motion of so many legs in two rows, by the engine: six legs in 0.2 s take a tenth of a second."""
    return motion_of(ts.simulate(creeping_millipede() if legs == 2 else many_legs(legs), seconds))
