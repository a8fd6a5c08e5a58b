"""Campaigns of a laboratory whose world differs from the model: nothing is determined and wrong, the cause is named."""

from __future__ import annotations

from pathlib import Path

import pytest

from independent.foreign.campaign import write_campaign
from independent.foreign.world import WORLDS, Device, World
from tarsus.identify.assessment import assessed
from tarsus.identify.chain import Identification, identify

DEVICE = Device()
DRIVE = "robot.drives.pzt"
NAMED = {
    "displacement 20 us late": "us after their velocities",
    "displacement 6 us late": "us after their velocities",
    "anti-alias filter": "low-pass of order 4",
    "creep of the drive": "the cause is unknown",
    "cubic stiffness": "the cause is unknown",
    "other thresholds": "the cause is unknown",
    "third mode": "the cause is unknown",
    "film exponent 2": "the film is taken for an even one",
    "restitution falls with speed": "restitution may change with speed",
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


def truth_of(device: Device, world: World) -> dict[str, float]:
    """What is true of a device, but for the weights of its plays with other thresholds and the coefficient of a film
    with another exponent, which mean nothing."""
    plays = () if world.thresholds else enumerate(device.weights)
    film = {"ground.film.coefficient": device.film[0]} if world.exponent == 3 else {}
    law = (f"{DRIVE}.law.{key}" for key in ("constant", "linear", "quadratic", "cubic"))
    return {
        **{f"robot.structure.frequencies.{k}": one for k, one in enumerate(device.frequencies)},
        **{f"robot.structure.damping_ratios.{k}": one for k, one in enumerate(device.damping)},
        f"{DRIVE}.load.participation.1": device.participation[1],
        **dict(zip(law, device.law, strict=True)),
        **{f"{DRIVE}.law.weights.{k}": one for k, one in plays},
        **film,
        "ground.restitution.coefficient": device.restitution,
        "ground.film.thickness": device.film[1],
        "ground.adhesion.initial": device.adhesion[0],
        "ground.adhesion.rate": device.adhesion[1],
    }


def identified(device: Device, world: str, folder: Path) -> tuple[Identification, list[str]]:
    """An identification of which no number is determined and wrong, and the words of its numbers."""
    found = identify(write_campaign(folder, device, WORLDS[world]))
    judged, truth, words = assessed(found), truth_of(device, WORLDS[world]), []
    assert judged is not None
    for step in found.steps.values():
        for path, value, std in zip(step.paths, step.values, step.std, strict=True):
            if path in truth and path in judged.names:
                words.append(judged[path].word)
                off = abs(value - truth[path]) / std
                assert words[-1] != "determined" or off < 3.0, f"{path} is {off:.1f} sd off"
    return found, words


def said_of(found: Identification) -> list[str]:
    return [*found.remarks, *(note for step in found.steps.values() for note in step.notes)]


@pytest.mark.slow
@pytest.mark.parametrize("world", [*ALSO, *NAMED])
def test_nothing_is_determined_and_wrong(world: str, tmp_path: Path) -> None:
    found, words = identified(DEVICE, world, tmp_path)
    failed = [one for step in found.steps.values() for one in step.checks if not one.passed]
    said, cause = said_of(found), NAMED.get(world, "")
    if world == "sound":  # but for the constant of the drive's law: it counts from the gap, which states no interval
        names = [one.name.partition(" (")[0] for one in failed]
        assert names == ["gap uncertainty not stated", "even film stated"]
        assert words.count("determined") >= len(words) - 3
    assert any(cause.lower() in one.lower() for one in said), said
    if world.startswith("clock"):
        (told,) = (one.partition(cause)[2].split()[0] for one in said if cause in one)
        assert float(told) == pytest.approx(1e6 * WORLDS[world].pace, abs=0.05)
    if world.startswith("displacement"):
        (told,) = (one.partition(" come ")[2].split()[0] for one in said if cause in one)
        assert float(told) == pytest.approx(1e6 * WORLDS[world].late, abs=0.15)


@pytest.mark.slow
@pytest.mark.parametrize("world", [world for world in WORLDS if world not in {*ALSO, *NAMED}])
def test_other_differences_leave_nothing_wrong(world: str, tmp_path: Path) -> None:
    device, cause = DEVICE.drawn(0.1, 3), DRAWN.get(world, "")
    found, _ = identified(device, world, tmp_path)
    assert any(cause in one for one in said_of(found)), said_of(found)
    if world == "contacts scatter":
        (told,) = (one.rpartition(" ")[2] for one in said_of(found) if cause in one)
        assert float(told.rstrip(".")) == pytest.approx(WORLDS[world].scatter * device.restitution, rel=0.25)


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1, 2])
def test_drawn_devices_are_identified(seed: int, tmp_path: Path) -> None:
    """The first rebounds three times in all and is else caught; the second meets the ground a sample or two after its
    drive jumps, every time."""
    device = DEVICE.drawn(0.1, seed)
    found = identify(write_campaign(tmp_path, device, WORLDS["sound"]))
    judged, step = assessed(found), found.steps["restitution"]
    assert judged is not None and judged["ground.restitution.coefficient"].word == "determined"
    off = abs(step.values[0] - device.restitution)
    assert off < 3.0 * step.std[0] and off < 0.05 * device.restitution
