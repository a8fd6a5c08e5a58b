"""Statistics over seeds are the measures of the runs that start from them."""

from __future__ import annotations

import numpy as np
import pytest

import tarsus as ts
from tarsus.calibrate.forward import random_velocities
from tarsus.measure import window_statistics
from tarsus_reproduce.seeds import ACCURACY, SPEED, foot_statistics

PARTS = ("bounces_per_second", "peak", "mean_height", "mean_apex")


def started(scene: ts.Scene, seed: int) -> ts.Run:
    """One run from a seed."""
    velocity = random_velocities(scene, "tip", seed, SPEED)
    start = ts.Initial(displacement=(0.0,) * len(velocity), velocity=velocity)
    return ts.simulate(scene.model_copy(update={"initial": start}), 0.1, ACCURACY)


@pytest.mark.parametrize("threads", [1, 2])
def test_each_number_is_the_measure_of_its_run(threads):
    scene = ts.load_scene("cantilever")
    found = foot_statistics(scene, 18, duration=0.06, settle=0.04, window=0.03, threads=threads)
    assert not found.problems
    for seed in (0, 5, 17):
        run = started(scene, seed)
        windows = [window_statistics(run, 0.04 + 0.03 * k, 0.03) for k in range(2)]
        for name in PARTS:
            several = [one[name].value for one in windows]
            np.testing.assert_allclose(found.values[name][2 * seed : 2 * seed + 2], several, rtol=1e-12)


def test_seeds_share_energy_between_modes():
    scene = ts.load_scene("hexapod")
    mass = scene.robot.structure.matrices().mass
    row = scene.robot.structure.row("foot1")
    velocities = np.array([random_velocities(scene, "foot1", seed, SPEED) for seed in range(4000)])
    assert (velocities @ row).std() == pytest.approx(SPEED, rel=0.05)
    energies = velocities**2 @ np.diag(np.diag(mass))  # Modal: mass is diagonal
    means = energies.mean(axis=0)
    assert np.ptp(means) < 0.2 * means.mean()
    assert random_velocities(scene, "foot1", 3, SPEED) == random_velocities(scene, "foot1", 3, SPEED)


def test_statistics_agree_with_a_single_run():
    scene = ts.load_scene("hexapod")
    found = foot_statistics(scene, 2, duration=0.2, settle=0.1, window=0.05)
    assert not found.problems and found.values["peak"].shape == (8,)
    start = ts.with_values(
        scene, {"initial": ts.Initial(velocity=random_velocities(scene, "foot1", 1, SPEED))}
    )
    run = ts.simulate(start, duration=0.3, accuracy=ACCURACY)
    gaps = run.at(0.1 + (np.arange(40_000) + 0.5) / 200_000).state.gap[0].reshape(4, 10_000)
    # the integral of the gap is known at events and marks, and a window's edges lie between them
    assert found.values["mean_height"][4:] == pytest.approx(gaps.mean(axis=1), rel=0.04)
    assert found.values["mean_height"][4:].mean() == pytest.approx(gaps.mean(), rel=0.01)
    assert (found.values["peak"][4:] <= gaps.max(axis=1) * (1.0 + 1e-3)).all()
    assert (found.values["peak"][4:] > 0.5 * gaps.max(axis=1)).all()
