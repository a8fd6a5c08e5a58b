"""Random scenes of every kind that runs may have, by name, and tests over seeds of each."""

from __future__ import annotations

from collections.abc import Callable, Iterable

import pytest

from invariants.test_uneven_walks import uneven_walk
from random_scenes import branched_scene, creeping_scene, moving_scene, plain_scene, sliding_scene
from tarsus.base.spec import with_values
from tarsus.model.scene import Scene
from turning_scenes import turning_walk

KINDS: dict[str, Callable[[int], Scene]] = {
    "modal": lambda seed: plain_scene(seed, legged=False),
    "legged": lambda seed: plain_scene(seed, legged=True),
    "branched": lambda seed: branched_scene(seed, bool(seed % 2)),
    "creeping": lambda seed: creeping_scene(seed, bool(seed % 2)),
    "moving": moving_scene,
    "sliding": sliding_scene,
    "turning": lambda seed: with_values(turning_walk(seed), {"duration": 0.004}),
    "uneven": lambda seed: with_values(uneven_walk(seed), {"duration": 0.006}),
}


def over(**seeds: Iterable[int]) -> pytest.MarkDecorator:
    """A test for each kind and seed that are named."""
    return pytest.mark.parametrize(("kind", "seed"), [(kind, seed) for kind, own in seeds.items() for seed in own])
