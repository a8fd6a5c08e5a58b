"""Campaigns of a laboratory whose world differs from the model: nothing is determined and wrong, the cause is named."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from example_files import load_file
from independent.foreign.world import WORLDS

foreign = load_file(Path(__file__).parents[2] / "benchmarks" / "foreign.py")
PATH = "ground.restitution.coefficient"
NAMED = {
    "displacement 20 us late": "us after their velocities",
    "displacement 6 us late": "us after their velocities",
    "anti-alias filter": "low-pass of order 4",
    "creep of the drive": "the cause is unknown",
    "cubic stiffness": "the cause is unknown",
    "other thresholds": "the cause is unknown",
    "third mode": "the cause is unknown",
    "film exponent 2": "flights leave the exponent open",
    "restitution falls with speed": "restitution changes with speed",
    "compliant ground": "the level of the ground falls with the volts in a record",
    "clock 100 ppm off": "the clock of the motion runs ",
    "adhesion that ages": "ground.adhesion.rate falls with contact time",
    "gain of a channel": "taken for the gain of its channel, and divided out",
}
"""What is said of differences on the device of the paper."""
ALSO = "sound", "mains hum", "rebounds until slow", "ground drifts"
DRAWN = {
    "gains warm up": "the cause is unknown",
    "coupled displacement": "the ground lies at different places from the rest",
    "tip misstated": "the cause is unknown",
    "attraction by the volts": "the cause is unknown",
    "weak attraction": "the cause is unknown",
    "trigger jitter": "as by a trigger with a varying delay",
    "contacts scatter": "The scatter of e from impact to impact, beyond noise, is ",
    "third mode, and restitution falls": "the cause is unknown",
    "creep, and late": "us after their velocities",
    "foot that rocks": "the step restitution leaves more than noise",
}
"""The same on a device that is not the paper's, with differences that no threshold was set by; of all others of the
laboratory nothing is asked for but that no number is determined and wrong."""


def outcome_of(world: str, folder: Path, seed: int = 1, spread: float = 0.0) -> Any:
    """What an identification makes of a campaign, of which no number is determined and wrong."""
    out = foreign.scored(foreign.made(folder, world, seed, 40.0, spread))
    assert not [one.path for one in out.numbers if one.wrong]
    return out


def number(said: list[str], before: str) -> float:
    """The number after some words of a sentence."""
    (told,) = (one.partition(before)[2].split()[0] for one in said if before in one)
    return float(told.rstrip("."))


@pytest.mark.slow
@pytest.mark.parametrize("world", [*ALSO, *NAMED])
def test_nothing_is_determined_and_wrong(world: str, tmp_path: Path) -> None:
    found = outcome_of(world, tmp_path)
    said, cause = found.sentences, NAMED.get(world, "")
    assert any(cause.lower() in one.lower() for one in said), said
    if world == "sound":  # but for the constant of the drive's law, which counts from a gap without an interval
        assert sum(one.endswith(" at least)") or one.endswith(" at most)") for one in said) == 2
        assert sum(one.verdict == "determined" for one in found.numbers) >= len(found.numbers) - 3
    if world.startswith("clock"):
        assert number(said, cause) == pytest.approx(1e6 * WORLDS[world].pace, abs=0.05)
    if world.startswith("displacement"):
        assert number(said, "displacements come ") == pytest.approx(1e6 * WORLDS[world].late, abs=0.15)


@pytest.mark.slow
@pytest.mark.parametrize("world", [world for world in WORLDS if world not in {*ALSO, *NAMED}])
def test_other_differences_leave_nothing_wrong(world: str, tmp_path: Path) -> None:
    said, cause = outcome_of(world, tmp_path, 3, 0.1).sentences, DRAWN.get(world, "")
    assert any(cause in one for one in said), said
    if world == "contacts scatter":
        true = foreign.Device().drawn(0.1, 3).restitution
        assert number(said, cause) == pytest.approx(WORLDS[world].scatter * true, rel=0.25)


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1, 2])
def test_drawn_devices_are_identified(seed: int, tmp_path: Path) -> None:
    """The first rebounds three times in all and is else caught; the second meets the ground a sample or two after its
    drive jumps, every time."""
    (one,) = (one for one in outcome_of("sound", tmp_path, seed, 0.1).numbers if one.path == PATH)
    assert one.verdict == "determined" and abs(one.value - one.true) < 0.05 * one.true
