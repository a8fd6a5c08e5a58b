"""Derivatives by differences of fourth order, which tests hold exact ones to."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

import tarsus as ts
from tarsus.base.spec import get_value, with_values

AROUND = (-2.0, -1.0, 1.0, 2.0)
"""Where the four values of a difference are, in steps."""


def slope(values: Sequence[Any], step: float) -> Any:
    """Derivative by the values, numbers or arrays alike, at `AROUND` times a step."""
    far, near, ahead, beyond = map(np.asarray, values)
    return (far - 8.0 * near + 8.0 * ahead - beyond) / (12.0 * step)


def runs_around(
    scene: ts.Scene,
    path: str,
    step: float,
    duration: float | None = None,
    accuracy: ts.Accuracy | None = None,
) -> list[ts.Run]:
    """Runs of the scene with one of its numbers moved by `AROUND` times a step."""
    at = float(get_value(scene, path))
    return [ts.simulate(with_values(scene, {path: at + k * step}), duration, accuracy) for k in AROUND]
