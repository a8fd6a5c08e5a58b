"""Walks that nobody chose on uneven ground: they end, no foot is below the ground, and energy is kept."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import tarsus as ts
from random_scenes import PLAIN, Dice
from tarsus.base.spec import with_values
from tarsus.model.profile import heights_of
from tarsus.model.scene import Scene
from tarsus.model.structure import Walker
from tarsus.solve.engine import Accuracy
from walking_scenes import sticky, trotter

DURATION = 0.02
STEPS = 100_000
"""A hundred times as many as these walks need: a walk that does not come to an end is found soon."""


def shape_of(dice: Dice, kind: str) -> dict[str, Any]:
    long, high = dice.log(3e-5, 1e-3), dice.log(1e-7, 1e-5)
    if kind == "random":
        numbers = {"seed": int(dice.rng.integers(10**6)), "rms": 0.5 * high, "correlation_length": long}
        numbers |= {"hurst": dice.between(0.3, 1.0), "spacing": dice.log(5e-6, 1e-4), "facets": 256}
    elif kind == "staircase":
        numbers = {"tread": long, "rise": high * dice.one_of([-1.0, 1.0])}
    elif kind == "sawtooth":
        numbers = {"length": long, "height": high, "rising": dice.one_of([0.0, 1.0, dice.between(0.1, 0.9)])}
    else:
        numbers = {"spacing": long, "width": long * dice.between(0.1, 0.9), "depth": high}
    patches = {name: [1.0, dice.between(0.0, 1.0)] for name in ("friction", "adhesion") if dice.chance(0.2)}
    return {"kind": kind} | numbers | patches


def uneven_walk(seed: int) -> Scene:
    """A walker that is dropped a little above the highest ground and driven harder than it needs."""
    dice = Dice([seed, 77], PLAIN)
    laws: dict[str, Any] = {
        name: None
        for name, chance in (("adhesion", 0.5), ("restitution", 0.3), ("friction", 0.2))
        if dice.chance(chance)
    }
    if dice.chance(0.4):
        laws["film"] = ts.Film(coefficient=dice.log(1e-28, 1e-24), thickness=1e-7)
    scene = trotter(dice.one_of([1, 2, 3, 4]), ground=sticky(**laws), seed=seed, turning=dice.chance(0.5))
    shape = shape_of(dice, ("random", "staircase", "sawtooth", "pits")[seed % 4])
    scene = with_values(scene, {"ground.profile": shape})
    walker, profile = scene.robot.structure, scene.ground.profile
    assert isinstance(walker, Walker) and profile is not None
    below = np.array([leg.x for leg in walker.legs.values()])
    top = float(np.max(heights_of(profile.points(), profile.repeats, np.concatenate([below - 1e-5, below + 1e-5]))))
    start = (max(top, 0.0) + 2e-6) * walker.vertical()
    drives = {f"robot.drives.{name}.law.gain": 2e-6 * dice.log(0.3, 6.0) for name in scene.robot.drives}
    return with_values(scene, {"initial": {"displacement": tuple(start.tolist())}} | drives)


def check(seed: int) -> None:
    scene = uneven_walk(seed)
    run = ts.simulate(scene, DURATION, accuracy=Accuracy(gap=1e-10, steps=STEPS))
    assert run.ok, f"{seed}: {run.code}"
    assert run.ledger.closure < 1e-8, f"{seed}: {run.ledger.closure}"
    state = run.states(np.linspace(0.0, DURATION, 200))
    profile, walker = scene.ground.profile, scene.robot.structure
    assert profile is not None and isinstance(walker, Walker)
    for row, foot in enumerate(scene.robot.feet.values()):
        at = walker.leg_coordinate(foot.point)
        place, height = walker.legs[foot.point].x + state.x[at], foot.gap + state.x[at + 1]
        size = 1e-12 + 1e-14 * np.abs(height).max()
        sides = (place - size, place, place + size)  # a foot at the side of a step is beside it
        depth = np.min([heights_of(profile.points(), profile.repeats, x) for x in sides], axis=0) - height
        assert depth.max() < size and state.gap[row].min() > -size, f"{seed}: {depth.max()}"


@pytest.mark.parametrize("seed", range(8))
def test_walks_on_uneven_ground(seed: int) -> None:
    check(seed)


@pytest.mark.slow
@pytest.mark.parametrize("block", range(20))
def test_two_thousand_walks_on_uneven_ground(block: int) -> None:
    for seed in range(100 * block, 100 * (block + 1)):
        check(seed)
