"""Learning along a line of designs: by a bit and by a scalar."""

from __future__ import annotations

import numpy as np

from tarsus.design.learning import ArrivalLine, by_bits, by_scalars
from tarsus.design.trials import Landings


def test_halving_a_line_finds_the_place_of_every_ground():
    line = ArrivalLine(np.linspace(1.0, 2.0, 9)[:, None], np.linspace(1e-3, 2e-3, 9))
    grounds = np.random.default_rng(0).uniform(0.05, 0.95, 50)
    played = []

    def step(durations):
        place = durations[:, 0] - 1.0
        played.append(place)
        # a foot that aims too near arrives half a millisecond too late, else in time
        first = 1e-3 * (1.0 + place) + np.where(place < grounds, 5e-4, 0.0)
        speed = np.where(place < grounds, 1.0, place - grounds)
        return Landings(*(speed,) * 3, first, *(speed,) * 3)

    speeds = by_bits(line, step, 50, 12, step(np.full((50, 1), 1.5)))
    assert len(speeds) == 13
    assert (np.abs(played[-1] - grounds) <= 1.0 / 32.0).all() and (speeds[-1] <= 1.0 / 32.0).all()


def test_a_scalar_finds_the_place_of_every_ground_from_both_sides():
    """The softest place of a line, a third as steep on its one side as on the other."""
    line = ArrivalLine(np.linspace(1.0, 2.0, 9)[:, None], np.linspace(1e-3, 2e-3, 9))
    grounds = np.random.default_rng(0).uniform(0.0, 1.0, 50)

    def step(durations):
        far = durations[:, 0] - 1.0 - grounds
        return Landings(*(np.where(far < 0.0, -3.0 * far, far),) * 7)

    speeds, best, softest = by_scalars(line, step, 50, 40)
    assert len(speeds) < 20 and (np.abs(best[:, 0] - 1.0 - grounds) < 1.0 / 32.0).all()
    assert np.array_equal(softest, np.min(speeds, axis=0)) and np.array_equal(step(best).speed, softest)
