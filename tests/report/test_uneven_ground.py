"""Pictures of walks show uneven ground below each foot, as large as the foot's motion is drawn."""

from __future__ import annotations

import numpy as np
import pytest

import tarsus as ts
from tarsus.base.spec import with_values
from tarsus.report.drawing import drawing_of
from tarsus.report.motion import motion_of
from tarsus.report.player import payload
from walking_scenes import sticky, trotter


def test_feet_stand_on_the_ground_that_is_drawn() -> None:
    stairs = {"kind": "staircase", "tread": 1e-3, "rise": 1e-7, "start": 1e-5}
    scene = with_values(trotter(4, ground=sticky(), turning=False), {"ground.profile": stairs, "signals": {}})
    motion = motion_of(ts.simulate(with_values(scene, {"initial": {"standing": {}}}), "1 ms"))
    drawing = drawing_of(motion)
    frame = len(motion.time) - 1
    assert (motion.state[:, frame] > 0).all()
    at = drawing.seen(motion)[..., frame]
    pieces = drawing.ground_below(motion, at, frame)
    for piece, one in zip(pieces, drawing.pieces, strict=True):
        x, z = at[:, one.point]
        assert z == pytest.approx(float(np.interp(x, *piece)), abs=1e-9 * drawing.leg)
        assert piece[0, 0] < x < piece[0, -1]
    told = payload(motion, drawing)
    assert np.array(told["ground"][0]) == pytest.approx(motion.ground[0], rel=1e-8)
    assert [one[0] for one in told["drawing"]["pieces"]] == [0, 0, 0, 0]
