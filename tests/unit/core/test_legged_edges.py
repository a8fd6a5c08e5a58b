"""Walkers at the edges of what can be described."""

from __future__ import annotations

import tarsus as ts
from random_scenes import OWN
from walking_scenes import sticky, trotter


def test_a_leg_without_a_foot_takes_no_share_of_what_laws_do() -> None:
    """It just swings: as if its foot were a metre above the ground."""
    law = ts.Electrostatic(coefficient=1e-19, offset=1e-6)
    magnet = OWN["magnet"](strength=1e-30, depth=1e-6)
    scene = trotter(ground=sticky(electrostatic=law, laws={"magnet": magnet}))
    feet = {name: foot for name, foot in scene.robot.feet.items() if name != "leg1"}
    bare = scene.model_copy(update={"robot": scene.robot.model_copy(update={"feet": feet})})
    far = ts.with_values(scene, {"robot.feet.leg1.gap": 1.0})
    one, other = (ts.simulate(made, 2e-3).ledger.laws for made in (bare, far))
    largest = max(abs(work) for work in other.values())
    assert largest > 0.0
    for name, work in other.items():
        assert abs(one[name] - work) < 1e-5 * largest
