"""The examples leg_step.py and leg_design.py, and their figures."""

from __future__ import annotations

from xml.etree import ElementTree

import numpy as np
import pytest

from example_files import load
from tarsus.report.leg_figures import landscape_figure, step_figure
from tarsus_reproduce.legs import millipede_leg


def inline(svg: str) -> str:
    """An inline figure, drawn wide and narrow, as one element with the name space that its page declares."""
    return f'<div xmlns:xlink="http://www.w3.org/1999/xlink">{svg}</div>'


def test_leg_step_py_the_two_models_agree_in_time_and_differ_in_height():
    found = load("leg_step").compare(millipede_leg().leg, samples=401)
    mode, motion = found.mode, found.motion
    root = np.sqrt(1.0 - mode.damping_ratio**2)
    over = np.exp(-np.pi * mode.damping_ratio / root)
    assert found.single.max() == pytest.approx(mode.gain * 14.0 / mode.stiffness * (1.0 + over), rel=1e-4)
    assert motion.lift.max() == pytest.approx(20.65e-6, rel=1e-3)
    times = motion.time[np.argmax(motion.lift)], motion.time[np.argmax(found.single)]
    assert times[0] == pytest.approx(times[1], rel=0.15)
    plate = step_figure(motion, found.single, 14.0)
    assert "14 V" in plate.caption
    assert "single mode" in "".join(ElementTree.fromstring(inline(plate.picture)).itertext())


# Slow: an optimum and 81 legs around it. unit/design/test_links.py keeps the optimum of this leg.
@pytest.mark.full
def test_leg_design_py_finds_a_longer_hip_for_the_assumed_load():
    example, leg = load("leg_design"), millipede_leg().leg
    found = example.designed(leg)
    assert found.lengths[:2] * 1e6 == pytest.approx([442.0, 100.0], abs=0.5)
    assert found.lift.mean_speed == pytest.approx(6.35e-3, rel=1e-3)
    land = example.around(found, points=9)
    plate = landscape_figure(land, leg, found.load, found)
    assert "does not carry 12.8 µN" in plate.caption
    text = "".join(ElementTree.fromstring(inline(plate.picture)).itertext())
    assert "hip.length (µm)" in text and "mean speed" in text and "design" in text
