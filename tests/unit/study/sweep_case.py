"""A small sweep of the cantilever for tests."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import tarsus as ts
from tarsus.study.sweep import Sweep

RESTITUTION, RATE = "ground.restitution.coefficient", "ground.adhesion.rate"


def small(**changes: Any) -> Sweep:
    """Two axes, six runs of 20 ms in units of four, unless changed."""
    table: dict[str, Any] = {
        "name": "small",
        "scene": ts.load_scene("cantilever", wave="sine", hz=200),
        "duration": 0.02,
        "vary": {RESTITUTION: [0.2, 0.5], RATE: ["1 uN/s", "5 uN/s", "25 uN/s"]},
        "measures": ("contact_duration", "peak"),
        "chunk": 4,
    }
    return Sweep(**(table | changes))


def files(folder: Path) -> dict[str, bytes]:
    """Content of every file below a folder, by its path there."""
    return {str(path.relative_to(folder)): path.read_bytes() for path in folder.rglob("*") if path.is_file()}
