"""Scenes at the edges, drawn from seeds: a run ends in numbers, above the ground, and is not done with an open account.

`python tests/survey.py FILE` looks at ten thousand of them, and at how long each takes.
"""

from __future__ import annotations

import pytest

from random_scenes import scene_of
from survey import faults, look_at

FAST = (2, 3, 17, 22, 34, 38, 46, 59, 63, 75, 77, 225)
SLOW = [seed for seed in range(200) if seed not in FAST]


@pytest.mark.parametrize("seed", [*FAST, *(pytest.param(seed, marks=pytest.mark.slow) for seed in SLOW)])
def test_a_scene_nobody_chose_ends_well_or_says_what_failed(seed: int) -> None:
    try:
        found = look_at(scene_of(seed))
    except Exception as error:
        found = {"error": f"{type(error).__name__}: {error}"}
    assert [text for text in faults(found) if text != "slow"] == [], found
