"""Static loops of a soft robot: a hexapod rings from corner to corner of the voltage, and its gain is told
beside that."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from laboratory import HEXAPOD
from tarsus.files.library import load_scene
from tarsus.identify.foot import FootModel
from tarsus.identify.hysteresis import Shares, fit_loops
from tarsus.identify.loops import calmed
from tarsus.identify.traces import trace_of
from tarsus.model.drive.waveforms import Sampled
from tarsus.records.purpose import IN_AIR, Purpose
from tarsus.synthesis.recordings import Instrument, Recording, recorded, rest_of

DRIVE, FOOT = "pzt", "foot1"


@pytest.fixture(scope="module")
def hexapod():
    scene = load_scene(HEXAPOD)
    return FootModel(scene, FOOT, DRIVE, tuple(scene.robot.structure.points))


@pytest.fixture(scope="module")
def loops(hexapod):
    """0, 10, 0, 10, 0 V at 28 V/s, at 1 kHz, with noise 60 dB below each point's motion."""
    levels = (0.0, 10.0, 0.0, 10.0, 0.0)
    wave = Sampled(times=tuple(10.0 / 28.0 * k for k in range(len(levels))), levels=levels)
    take = Recording("loops", Purpose.LOOPS, wave, 1.5, gap=IN_AIR, share=20)
    record = next(recorded(hexapod.scene, take, Instrument(snr_db=60.0, wander=0.0), DRIVE, [4]))
    return trace_of(record, hexapod.points, "loops", record.drive, rest_of(take), take.gap)


def test_the_gain_of_a_drive_is_told_beside_the_ringing_of_its_loops(hexapod, loops):
    unlike = hexapod.changed({"robot.drives.pzt.law.gain": 1e-6})
    found = fit_loops(unlike, [loops], None, Shares.none(), seed=1)
    gain = dict(zip(found.paths, found.values, strict=True))["robot.drives.pzt.law.gain"]
    assert gain == pytest.approx(hexapod.law.gain, rel=5e-5)  # as static motion alone: 6e-4 off


def test_what_is_left_is_the_static_motion_and_noise(hexapod, loops):
    static = np.outer(hexapod.by_drive, hexapod.law.force(loops.volts, ()))
    rung, calm = (one.x - static for one in (loops, calmed(hexapod, loops)))
    assert np.std(calm, axis=1)[:-1] == pytest.approx(loops.noise_x[:-1], rel=0.2)
    # statically foot 6 hardly moves: it rings a hundred times its noise, and the rounding of the volts is left of that
    assert np.std(rung[-1]) > 50.0 * loops.noise_x[-1]
    assert np.std(calm[-1]) < 0.05 * np.std(rung[-1])


def test_near_the_ground_a_record_is_left_as_it_is(hexapod, loops):
    for gap in (None, 1.5 * hexapod.gap):
        near = replace(loops, gap=gap)
        assert calmed(hexapod, near) is near
