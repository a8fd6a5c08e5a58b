"""Oracle 5: the squeeze film's first integral, m (v - v0) = C/2 (1/g^2 - 1/g0^2)."""

from __future__ import annotations

import math

import numpy as np
import pytest

import tarsus as ts
from random_scenes import OWN
from scene_files import scene
from walking_scenes import block, moving

MASS, C, START, SPEED = 1e-9, 1e-20, 1e-5, -0.05


def test_closest_approach():
    run = ts.simulate(scene("film_only"))
    assert run.ok and len(run.events) == 0
    series = run.at(np.linspace(0.0, run.duration, 2001))
    film = series.state.gap[0] + 1e-6
    assert film.min() == pytest.approx(7.0710678119e-6, rel=1e-10)
    assert math.sqrt(0.5) * 1e-5 == pytest.approx(7.0710678119e-6, rel=1e-11)
    lost = MASS * (series.state.v[0] - SPEED) - 0.5 * C * (1.0 / film**2 - 1.0 / START**2)
    assert np.abs(lost).max() < 1e-9 * MASS * abs(SPEED)


@pytest.mark.parametrize("own", [False, True], ids=["built in", "of one's own"])
def test_a_thick_film_stops_a_foot_within_little_of_itself(own):
    """Within 1e-7 of a film of 0.1 mm: its momentum is 5e6 times the foot's, whose way is known to 1e-6."""
    thickness, coefficient, gap = 1e-4, 5e-12, 1e-7
    law = OWN["own_film"] if own else ts.Film
    film = law(coefficient=coefficient, thickness=thickness)
    changes = {"ground.film": None, "ground.laws.own_film": film} if own else {"ground.film": film}
    run = ts.simulate(scene("film_only", changes | {"robot.feet.plate.gap": gap, "initial.velocity": [SPEED]}))
    assert run.ok and len(run.events) == 0
    start = gap + thickness
    way = MASS * -SPEED * start**3 / coefficient  # to 1.5e-7 of itself: the first term of the integral's series
    assert gap - run.at([run.duration]).state.gap[0, 0] == pytest.approx(way, rel=1e-6)
    assert run.ledger.closure < 1e-9


@pytest.mark.parametrize("thickness", [1e-6, 1e-8, 1e-9])
def test_a_thin_film_takes_the_momentum_and_the_energy_it_should(thickness: float) -> None:
    """C/2 g0^2 = m v/2: it takes half of the speed, also where no node of a step sees its work."""
    mass, speed = 1e-6, 0.1
    film = ts.Film(coefficient=thickness**2 * mass * speed, thickness=thickness)
    falling = moving(block(friction=None), block=-speed)
    changes = {"robot.feet.block.gap": 1e-4, "ground.film": film, "ground.gravity.acceleration": 1e-9}
    run = ts.simulate(ts.with_values(falling, changes), duration=1.5e-3)
    assert run.events["speed_before"][0] == pytest.approx(0.5 * speed, rel=3e-4)  # the film above 0.1 mm is left out
    assert run.ok and run.ledger.closure < 1e-11
