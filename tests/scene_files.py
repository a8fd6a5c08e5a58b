"""Scenes of the tests, by file name."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

import tarsus as ts

SCENES = Path(__file__).parent / "scenes"


def scene(name: str, values: dict[str, Any] | None = None) -> ts.Scene:
    """The scene in ``tests/scenes/<name>.toml`` with some values changed."""
    read = ts.read_scene(SCENES / f"{name}.toml")
    return ts.with_values(read, values) if values else read


def impacts(events: np.ndarray) -> np.ndarray:
    """Bounces and captures: what the reference sequences count."""
    return events[np.isin(events["kind"], (1, 2))]
