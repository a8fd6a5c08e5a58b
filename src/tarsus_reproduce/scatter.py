"""How firm a device's score is: neighbours of it whose unprinted numbers are a little off."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from tarsus.base.errors import InputError
from tarsus.base.spec import float_paths, with_values
from tarsus_reproduce.millipede import Coarse, DeviceTrends, Score, judge_scene

if TYPE_CHECKING:
    from tarsus.model.scene import Scene

SPREAD = 0.1
"""How far an unprinted number of a named device scatters when its score's firmness is asked for: 10 %, about what two
builds of a thin film differ by."""


def scattered(scene: Scene, spread: float, seed: int, number: int) -> Scene:
    """A device with every unprinted number multiplied by 1 ± ``spread``, evenly drawn.

    Masses, stiffness, damping and gains of all legs of a kind scatter together, as one unknown each.
    """
    rng = np.random.default_rng([seed, number])
    factors: dict[str, float] = {}
    known = float_paths(scene)
    changes: dict[str, Any] = {}
    for path, about in known.items():
        kind = _unprinted(path)
        if kind is None:
            continue
        factor = factors.setdefault(kind, 1.0 + spread * (2.0 * rng.random() - 1.0))
        changes[path] = about.value * factor
    return with_values(scene, changes)


def scatter_scores(
    device: DeviceTrends,
    count: int,
    seed: int,
    *,
    coarse: Coarse | None = None,
    progress: Callable[[int, int, str], None] | None = None,
) -> list[Score]:
    """Scores of ``count`` neighbours of a device, every unprinted number scattered by `SPREAD`, over the whole studies
    unless ``coarse``; neighbours that do not stand are left out."""
    scores = []
    for number in range(count):
        if progress is not None:
            progress(number, count, f"{device.name}, scattered")
        try:
            scene = scattered(device.scene, SPREAD, seed, number)
            scores.append(judge_scene(device.name, scene, coarse=coarse, scored_only=True).score)
        except InputError:
            continue
    return scores


def scatter_table(scores: Sequence[Score]) -> dict[str, Any]:
    """Plain data: how many were judged, and the smallest and largest of each count."""
    table: dict[str, Any] = {"spread": SPREAD, "judged": len(scores)}
    for name in ("agree", "contradict", "directional_agree") if scores else ():
        counts = [getattr(score, name) for score in scores]
        table[name] = {"least": min(counts), "most": max(counts)}
    return table


_SCATTERED = (
    "ground.friction.coefficient",
    "ground.film.thickness",
    "ground.electrostatic.offset",
    "ground.electrostatic.coefficient",
    "ground.landing.speed",
    "gait.frequency",
    "robot.structure.body.mass",
)


def _unprinted(path: str) -> str | None:
    """The unknown that a path belongs to; None for what is printed, or fixed by something else."""
    if path in _SCATTERED:
        return path
    last = path.rpartition(".")[2]
    if path.startswith("robot.structure.legs.") and last not in ("x", "y", "z"):
        return f"legs.{last}"
    if path.startswith("robot.drives.") and path.endswith(".law.gain"):
        return "gain"
    if ".load.weights." in path and last.endswith("_x"):
        return "lateral force"
    return None
