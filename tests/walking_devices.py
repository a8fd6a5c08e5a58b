"""A millipede for tests of the engine and of reports that does not change when the packaged devices do."""

from __future__ import annotations

from pathlib import Path

import tarsus as ts

CREEPING = Path(__file__).parent / "data" / "creeping_millipede.toml"


def creeping_millipede() -> ts.Scene:
    """Two overdamped legs, lifted from relaxed springs: one slip before each leaves, and no bounce."""
    return ts.load_scene(str(CREEPING))
