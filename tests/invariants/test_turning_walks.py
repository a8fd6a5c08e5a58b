"""Walks that nobody chose on legs that move every way: they end, no foot is below the ground, and energy is kept."""

from __future__ import annotations

import numpy as np
import pytest

import tarsus as ts
from tarsus.solve.engine import Accuracy
from turning_scenes import turning_walk

STEPS = 100_000
"""A hundred times as many as these walks need: a walk that does not come to an end is found soon."""


def check(seed: int, friction: float | None = None) -> None:
    scene = turning_walk(seed)
    if friction is not None:
        scene = ts.with_values(scene, {"ground.friction": {"coefficient": friction}})
    run = ts.simulate(scene, accuracy=Accuracy(gap=1e-10, steps=STEPS))
    assert run.ok, f"{seed}: {run.code}"
    assert run.ledger.closure < 1e-8, f"{seed}: {run.ledger.closure}"
    state = run.states(np.linspace(0.0, run.duration, 200))
    assert state.gap.min() > -1e-12, f"{seed}: {state.gap.min()}"


@pytest.mark.parametrize("seed", range(3))
def test_walks_that_turn(seed: int) -> None:
    check(seed)


def test_a_velocity_that_passes_by_zero_is_not_stopped() -> None:
    """Where friction is next to nothing, feet turn back all the time without standing still."""
    for seed in (7, 58):
        check(seed, 1e-6)


def test_stops_are_known_as_well_as_other_events() -> None:
    """Close to a stop a slip turns faster than the nodes of a step tell: by these alone it was known to 1e-10 s. Here
    it is to 5e-16 s, and to 1.2e-15 s on processors that round each product."""
    volts = {"signals.leg1.offset": 7.0 * (1.0 + 1e-6 * np.arange(-20, 21))}
    scene = turning_walk(13)
    runs = [
        ts.simulate_batch(scene, volts, 2e-4, accuracy=Accuracy(gap=gap, drive=1e-13), track=False)
        for gap in (1e-10, 1e-13)
    ]
    times = [np.array([one.events(i)["time"] for i in range(len(one))]) for one in runs]
    assert times[0].shape == (41, 6) and np.abs(times[0] - times[1]).max() < 2e-15


@pytest.mark.slow
def test_a_hundred_walks_that_turn() -> None:
    for seed in range(100):
        check(seed)
