"""A film much thinner than a foot's way in a step, whose work no node of the step sees."""

from __future__ import annotations

import pytest

import tarsus as ts
from walking_scenes import block, moving

MASS, SPEED = 1e-6, 0.1


@pytest.mark.parametrize("thickness", [1e-6, 1e-8, 1e-9])
def test_a_thin_film_takes_the_momentum_and_the_energy_it_should(thickness: float) -> None:
    """C/2 g0^2 = m v/2: it takes half of the speed, whatever its thickness."""
    film = ts.Film(coefficient=thickness**2 * MASS * SPEED, thickness=thickness)
    scene = moving(block(friction=None), block=-SPEED)
    scene = ts.with_values(
        scene, {"robot.feet.block.gap": 1e-4, "ground.film": film, "ground.gravity.acceleration": 1e-9}
    )
    run = ts.simulate(scene, duration=1.5e-3)
    assert run.events["speed_before"][0] == pytest.approx(0.5 * SPEED, rel=3e-4)  # the film above 0.1 mm is left out
    assert run.ok and run.ledger.closure < 1e-11
