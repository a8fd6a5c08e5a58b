"""Pictures of walks show uneven ground below each foot, as large as the foot's motion is drawn."""

from __future__ import annotations

import numpy as np
import pytest

import tarsus as ts
from tarsus.base.spec import with_values
from tarsus.report.motion import motion_of
from tarsus.report.player import payload
from tarsus.report.stage import drawn, facets, stage_of
from walking_scenes import sticky, trotter


def test_feet_stand_on_the_ground_that_is_drawn() -> None:
    stairs = {"kind": "staircase", "tread": 1e-3, "rise": 1e-7, "start": 1e-5}
    scene = with_values(trotter(4, ground=sticky(), turning=False), {"ground.profile": stairs, "signals": {}})
    motion = motion_of(ts.simulate(with_values(scene, {"initial": {"standing": {}}}), "1 ms"))
    stage = stage_of(motion)
    frame = len(motion.time) - 1
    assert (motion.state[:, frame] > 0).all()
    for piece, foot in zip(facets(motion, stage, frame), drawn(motion, stage, frame).feet, strict=True):
        level = piece[:, 1][np.argsort(np.abs(piece[:, 0] - foot[0]))[:2]]
        assert foot[1] == pytest.approx(level[0], abs=1e-9 * stage.leg)
        assert piece[0, 0] < foot[0] < piece[-1, 0]
    told = payload(motion, stage)
    assert np.array(told["ground"][0]) == pytest.approx(motion.ground[0], rel=1e-8)
    assert told["line"] == [0, 0, 0, 0]
