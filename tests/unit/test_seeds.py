"""Statistics over seeds are the measures of the runs that start from them."""

from __future__ import annotations

import numpy as np
import pytest

import tarsus as ts
from tarsus.measure import period_statistics, window_statistics
from tarsus.solve.seeds import ACCURACY, foot_statistics, random_velocities

PARTS = {"bounces": "bounces_per_second", "peak": "peak", "mean": "mean_height", "apex": "mean_apex"}


def started(scene: ts.Scene, seed: int) -> ts.Run:
    """One run from a seed."""
    velocity = random_velocities(scene, "tip", seed)
    start = ts.Initial(displacement=(0.0,) * len(velocity), velocity=velocity)
    return ts.simulate(scene.model_copy(update={"initial": start}), 0.1, ACCURACY)


@pytest.mark.parametrize("threads", [1, 2])
def test_each_number_is_the_measure_of_its_run(threads):
    scene = ts.load_scene("cantilever")
    told: list[None] = []
    count = 18  # more than a thread runs at a time
    found = foot_statistics(
        scene, count, duration=0.06, settle=0.04, threads=threads, on_done=lambda: told.append(None)
    )
    cut = foot_statistics(scene, count, duration=0.06, settle=0.04, window=0.03, threads=threads)
    assert found.ok and len(told) == count
    for seed in (0, 5, 17):
        run = started(scene, seed)
        periods = period_statistics(run, skip=2)
        windows = [window_statistics(run, 0.04 + 0.03 * k, 0.03) for k in range(2)]
        for part, name in PARTS.items():
            assert getattr(found, part)[seed] == pytest.approx(periods[name].value, rel=1e-12, nan_ok=True)
            several = [one[name].value for one in windows]
            np.testing.assert_allclose(getattr(cut, part)[2 * seed : 2 * seed + 2], several, rtol=1e-12)
