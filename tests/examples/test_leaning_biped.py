"""The example leaning_biped.py: a robot by contact modes walks on friction."""

from __future__ import annotations

import numpy as np
import pytest

import tarsus as ts
from example_files import load
from tarsus.report.figures import forces
from tarsus.report.series import series_of


def test_it_walks_forward_and_its_feet_slip_and_stick() -> None:
    run, way = load("leaning_biped").walk()
    assert run.ok and run.ledger.closure < 1e-9
    assert way == pytest.approx(74.7e-6, rel=0.02)
    assert {2, 3, 7, 8} <= set(run.events["kind"].tolist())  # captures, releases, slips and sticks
    assert 0.0 < run.ledger.friction < run.ledger.work_in
    page = series_of(run)
    plate = forces(page, page.whole)
    assert "friction (" in str(plate.picture) and "positive forward" in plate.caption


def test_without_friction_it_stays_where_it_is() -> None:
    """No force along the ground is there to move its centre of mass."""
    scene = load("leaning_biped").scene(friction=None)
    run = ts.simulate(ts.with_values(scene, {"robot.feet.a.along": None, "robot.feet.b.along": None}), 0.02)
    mass = run.plan.system.mass
    along = np.zeros(len(mass))
    along[[0, 3, 5]] = 1.0
    moved = along @ mass @ run.at(np.array([0.02])).state.x[:, 0]
    assert abs(moved) < 1e-9 * mass.sum()
