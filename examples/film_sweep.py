"""Thousands of runs at once: how the film's coefficient and the restitution set the number of impacts."""

from __future__ import annotations

import numpy as np

import tarsus as ts


def impacts_over_film(scales: np.ndarray, duration: float = 0.1) -> np.ndarray:
    """Number of impacts of the packaged cantilever within `duration` [s], shape [scale]."""
    scene = ts.load_scene("cantilever", volts=8, hz=50, wave="square")
    coefficient = ts.get_value(scene, "ground.film.coefficient")
    batch = ts.simulate_batch(scene, {"ground.film.coefficient": coefficient * scales}, duration=duration)
    return np.array([np.count_nonzero(np.isin(batch.events(i)["kind"], (1, 2))) for i in range(len(scales))])


if __name__ == "__main__":
    scales = np.geomspace(0.1, 100.0, 256)
    counts = impacts_over_film(scales)
    for scale, count in zip(scales[::32], counts[::32], strict=True):
        print(f"film x {scale:8.2f}: {count} impacts in 0.1 s")
