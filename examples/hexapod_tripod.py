"""Six legs in tripods on sticky ground: a hold that is there at once helps, one that grows keeps the feet."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

import tarsus as ts
from tarsus.solve.results import Batch
from tarsus_reproduce.walkers import hexapod_walker


def on_grounds(initial: NDArray[np.float64], rate: NDArray[np.float64]) -> Batch:
    """Runs of the tripod over grounds of adhesion `initial` (nr,) [N] that grows at `rate` (nr,) [N/s]."""
    scene = hexapod_walker()
    return ts.simulate_batch(scene, {"ground.adhesion.initial": initial, "ground.adhesion.rate": rate}, 0.2)


if __name__ == "__main__":
    initial = np.array([0.0, 1e-6, 5e-6, 10e-6, 15e-6, 20e-6, 30e-6, 0.0, 0.0, 0.0])
    rate = np.array([0.0] * 7 + [1e-4, 1e-3, 3e-3])
    batch = on_grounds(initial, rate)
    print("initial [uN]  growth [uN/ms]  stride [um]  slip ratio  contact [ms]  body swings [um]")
    for i in range(len(batch)):
        found = batch.measures(i)
        print(
            f"{initial[i] * 1e6:12.0f}  {rate[i] * 1e3:14.1f}  {found.stride.value * 1e6:11.3f}  "
            f"{found.slip_ratio.value:10.3f}  {found.contact_duration.value * 1e3:12.2f}  "
            f"{found.vertical_amplitude.value * 1e6:16.3f}"
        )
