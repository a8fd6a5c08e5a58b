"""With a passive map motion stays bounded: random drives, gaps and restitutions, closed ledgers."""

from __future__ import annotations

import numpy as np
import pytest

import tarsus as ts
from printed_robots import hexapod, printed_map


def random_scene(number: int) -> ts.Scene:
    rng = np.random.default_rng(number)
    kind = (ts.Square, ts.Sine)[rng.integers(2)]
    hz = float(np.exp(rng.uniform(np.log(15.0), np.log(900.0))))
    drive = kind(amplitude=float(rng.uniform(1.0, 30.0)), frequency=hz)
    chosen = (printed_map(), ts.laws.DominantMode(), ts.laws.DominantMode(mode=int(rng.integers(1, 7))))[
        rng.integers(3)
    ]
    return hexapod(
        signal=drive, gap=float(rng.uniform(1e-6, 3e-5)), restitution=float(rng.uniform(0.0, 1.0)), impact=chosen
    )


def assert_bounded(number: int, duration: float) -> None:
    scene = random_scene(number)
    run = ts.simulate(scene, duration=duration)
    assert run.ok, (number, run.code.value)
    ledger = run.ledger
    assert ledger.closure < 1e-8, number
    assert ledger.impacts >= 0.0
    assert np.all(run.events["energy"] >= -1e-12 * run.events["energy"].max(initial=0.0))
    # what the drives put in bounds what is in the structure at the end
    stored = ledger.kinetic + ledger.elastic
    assert stored <= ledger.work_in * (1.0 + 1e-9) + 1e-20
    # resonance of the lightest damped mode: 1 / (2 zeta) of the static swing, doubled for steps
    static = scene.signals["pzt"].amplitude * 12e-6 / 10.0
    assert np.abs(run.states(np.linspace(0.0, duration, 20001)).x).max() < 4000.0 * static


# Slow: more of the same kind. Three stay.
@pytest.mark.parametrize("number", [0, 4, 5, *(pytest.param(one, marks=pytest.mark.slow) for one in (1, 2, 3, 6, 7))])
def test_a_second_of_random_scenes(number):
    assert_bounded(number, 1.0)


@pytest.mark.slow
@pytest.mark.parametrize("number", range(100))
def test_ten_seconds_of_a_hundred_random_scenes(number):
    assert_bounded(number, 10.0)


def test_the_printed_map_diverges():
    # The documented example: 10 V square, the printed R as it is. The foot is a kilometre up before the first second.
    scene = hexapod(
        signal=ts.Square(amplitude=10.0, frequency=30.0), impact=printed_map(passive=False), restitution=0.5
    )
    run = ts.simulate(scene, duration=0.5)
    heights = [np.abs(run.states(np.linspace(0.0, end, 2001)).x).max() for end in (0.1, 0.3, 0.5)]
    # how fast is chaos, which the last bit of its modes changes: 5e5 to 3e9 times within those 0.4 s
    assert heights[1] > 10.0 * heights[0] and heights[2] > 1e4 * heights[0]
    assert run.ledger.impacts < 0.0, "impacts have made energy"
    longer = ts.simulate(scene, duration=2.0)
    assert longer.code.name == "DIVERGED" and "creates energy" in longer.code.value
