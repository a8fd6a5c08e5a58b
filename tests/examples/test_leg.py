"""The examples leg_step.py and leg_design.py, and their figures."""

from __future__ import annotations

from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from matplotlib import rc_context
from matplotlib.figure import Figure

from example_files import load
from tarsus_reproduce.legs import millipede_leg


def words(figure: Figure, file: Path) -> str:
    """The words of a figure as it is written."""
    with rc_context({"svg.fonttype": "none"}):
        figure.savefig(file)
    return "".join(ElementTree.parse(file).getroot().itertext())


def test_leg_step_py_the_two_models_agree_in_time_and_differ_in_height(tmp_path):
    example = load("leg_step")
    found = example.compare(millipede_leg().leg, samples=401)
    mode, motion = found.mode, found.motion
    root = np.sqrt(1.0 - mode.damping_ratio**2)
    over = np.exp(-np.pi * mode.damping_ratio / root)
    assert found.single.max() == pytest.approx(mode.gain * 14.0 / mode.stiffness * (1.0 + over), rel=1e-4)
    assert motion.lift.max() == pytest.approx(20.65e-6, rel=1e-3)
    times = motion.time[np.argmax(motion.lift)], motion.time[np.argmax(found.single)]
    assert times[0] == pytest.approx(times[1], rel=0.15)
    text = words(example.figure(found), tmp_path / "step.svg")
    assert "single mode" in text and "time (ms)" in text


# Slow: an optimum and 81 legs around it. unit/design/test_links.py keeps the optimum of this leg.
@pytest.mark.full
def test_leg_design_py_finds_a_longer_hip_for_the_assumed_load(tmp_path):
    example, leg = load("leg_design"), millipede_leg().leg
    found = example.designed(leg)
    assert found.lengths[:2] * 1e6 == pytest.approx([442.0, 100.0], abs=0.5)
    assert found.lift.mean_speed == pytest.approx(6.35e-3, rel=1e-3)
    text = words(example.figure(leg, found, points=9), tmp_path / "land.svg")
    assert "does not carry 12.8 µN" in text
    assert "hip.length (µm)" in text and "mean speed" in text and "design" in text
