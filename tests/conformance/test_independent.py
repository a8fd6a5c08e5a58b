"""The library against a second simulator that shares no formula with it, on scenes drawn from seeds."""

from __future__ import annotations

import pytest

from independent.compare import compare
from random_scenes import plain_scene

FAST = {"modal": (2, 5, 9, 13), "legged": (3, 22)}
ALL = [(kind, seed) for kind in FAST for seed in range(50)]


@pytest.mark.parametrize(
    ("kind", "seed"),
    [one if one[1] in FAST[one[0]] else pytest.param(*one, marks=pytest.mark.slow) for one in ALL],
)
def test_whole_sequences_of_events_agree(kind: str, seed: int) -> None:
    """Feet, kinds and times of all events, and the state at the end, up to where an error of a step grows 1e5 times."""
    found = compare(plain_scene(seed, kind == "legged"))
    assert found.wrong is None, found
