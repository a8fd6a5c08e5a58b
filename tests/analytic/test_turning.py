"""Motion across the way and yaw in closed form, and where planar robots say the same."""

from __future__ import annotations

import numpy as np
import pytest

import tarsus as ts
from tarsus.base.events import EventKind
from turning_scenes import puck, spinning_down


def test_a_spinning_plate_stops_when_the_box_of_friction_says() -> None:
    """Every foot has |x| mu N across and |y| mu N along, whatever the place on the plate: the spin falls in a straight
    line, and what it had goes to friction."""
    spin = 40.0
    run = ts.simulate(puck(spin))
    stop = spin / spinning_down()
    assert run.ok and run.ledger.closure < 1e-8
    sticks = run.events[run.events["kind"] == EventKind.STICK_BEGINS]
    assert len(sticks) >= 8 and sticks["time"][0] == pytest.approx(stop, rel=1e-3)
    half = run.at(np.array([0.5 * stop])).body
    yaw = run.scene.robot.structure.body_coordinates.index("yaw")
    assert half[yaw, 0] == pytest.approx(
        spin * 0.5 * stop - spinning_down() * (0.5 * stop) ** 2 / 2.0, rel=1e-9
    )
    assert run.at(np.array([run.end_time])).body[yaw, 0] == pytest.approx(0.5 * spin * stop, rel=1e-3)
