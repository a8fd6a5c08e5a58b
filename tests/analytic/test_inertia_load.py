"""A drive that shakes the frame: tables under balls, and a walker with a gait on a plate."""

from __future__ import annotations

import math

import numpy as np
import pytest

import tarsus as ts
from scene_files import scene

G = 9.81


def on_a_table(volts: ts.drives.Waveform, values: dict[str, object]) -> ts.Scene:
    """The ball of the tests on a table whose upward acceleration [m/s^2] is the voltage."""
    table = ts.Drive(load=ts.InertiaLoad(upward=-1.0), law=ts.LinearForce(gain=1.0))
    return scene("ball", {"robot.drives": {"table": table}, "signals": {"table": volts}, **values})


@pytest.mark.parametrize("mass", [1.0, 3e-6])
@pytest.mark.parametrize("e", [0.2, 0.5, 0.9])
def test_chatter_on_a_sinking_table_ends_when_geometry_says(e: float, mass: float) -> None:
    """Falls of t and flights of 2 t e^n, under the part of gravity that the table leaves."""
    sinking = on_a_table(
        ts.Constant(level=-4.0), {"ground.restitution.coefficient": e, "robot.structure.mass": [mass]}
    )
    over = math.sqrt(2.0 / (G - 4.0)) * (1.0 + e) / (1.0 - e)
    run = ts.simulate(sinking, 1.1 * over)
    assert run.ok
    assert run.events["time"][-1] == pytest.approx(over, rel=1e-12)


def test_a_walker_with_a_gait_on_a_plate() -> None:
    """The plate moves all of its masses: in free fall beside it the walker would be pressed by g + a."""
    plate = ts.Drive(load=ts.InertiaLoad(upward=-1.0), law=ts.LinearForce(gain=1.0))
    walker = ts.with_values(ts.load_scene("millipede"), {"initial.standing": None})
    shaken = ts.with_values(walker, {"robot.drives.plate": plate, "signals.plate": ts.Constant(level=2.0)})
    assert shaken.gait is not None
    g = shaken.ground.gravity.acceleration
    heavier = ts.with_values(walker, {"ground.gravity.acceleration": g + 2.0})
    runs = [ts.simulate(one, "30 ms") for one in (shaken, heavier)]
    early = [run.events[run.events["time"] < 0.01] for run in runs]
    assert len(early[0]) > 10
    np.testing.assert_array_equal(early[0]["kind"], early[1]["kind"])
    np.testing.assert_allclose(early[0]["time"], early[1]["time"], rtol=1e-9)
