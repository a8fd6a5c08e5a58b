"""The library against a second simulator that shares no formula with it, on scenes drawn from seeds."""

from __future__ import annotations

import pytest

import tarsus as ts
from independent.compare import compare
from random_scenes import branched_scene, plain_scene

FAST = {"modal": (2, 13), "legged": (22,)}
BRANCHED = {"modal": (6,), "legged": (3,)}
TIGHT = ts.Accuracy(gap=1e-10, drive=1e-11)
"""A walker's steps err by 1e-8 of a length unless it is asked for less, which would hide a drive's error."""


def some(fast: dict[str, tuple[int, ...]], count: int) -> list:
    """So many seeds of each kind, all but a few in the slow lane."""
    every = [(kind, seed) for kind in fast for seed in range(count)]
    return [one if one[1] in fast[one[0]] else pytest.param(*one, marks=pytest.mark.slow) for one in every]


@pytest.mark.parametrize(("kind", "seed"), some(FAST, 50))
def test_whole_sequences_of_events_agree(kind: str, seed: int) -> None:
    """Feet, kinds and times of all events, and the state at the end, up to where an error of a step grows 1e5 times."""
    found = compare(plain_scene(seed, kind == "legged"))
    assert found.wrong is None, found


@pytest.mark.parametrize(("kind", "seed"), some(BRANCHED, 25))
def test_they_agree_under_laws_of_two_branches_and_repeating_plateaus(kind: str, seed: int) -> None:
    """To 2e-9 rad but in legged 15: where its first foot is captured the states are 2e-11 of the length apart, whatever
    the accuracy (why is open), and so its slip, whose force hardly passes the bound, begins and ends 5e-8 rad apart."""
    found = compare(branched_scene(seed, kind == "legged"), TIGHT, 1e-7)
    assert found.wrong is None, found
