"""Faults that no single channel shows: channels, repeats and purposes against each other, and what nothing tells."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from identify.campaigns import copied, folder, modes_as_found, truth
from laboratory import LABORATORY
from tarsus.base.spec import float_paths
from tarsus.files.library import load_scene
from tarsus.identify.adhesion import _line
from tarsus.identify.campaign import read_campaign
from tarsus.identify.chain import StepRunner, identify
from tarsus.identify.estimates import Estimates
from tarsus.identify.foot import FootModel
from tarsus.identify.steps import STEPS
from tarsus.records.purpose import Purpose


def test_a_calibration_moves_all_motion_by_its_standard_error(tmp_path):
    folder = copied(tmp_path / "campaign", "ramps")
    file = folder / "campaign.toml"
    file.write_text(file.read_text().replace("calibration = 0.0", "calibration = 0.01"))
    chain = StepRunner.of(read_campaign(folder))
    chain.read()
    chain.find_ground()
    *_, there = chain.evidence.perturbed()
    for own, other in zip(chain.evidence.traces[Purpose.RAMPS], there.traces[Purpose.RAMPS], strict=True):
        np.testing.assert_allclose(other.v, 1.01 * own.v, rtol=1e-12)
        np.testing.assert_array_equal(other.volts, own.volts)
    assert there.level[0] == pytest.approx(1.01 * chain.evidence.level[0], rel=1e-3)


def test_a_law_without_a_ground_takes_its_constant_as_stated(monkeypatch):
    modes_as_found(monkeypatch)
    chain = StepRunner.of(read_campaign(folder()))
    chain.read()
    chain.take(STEPS[:2])  # before the ground is looked for
    path = "robot.drives.pzt.law.constant"
    found = chain.steps["hysteresis"]
    assert chain.evidence.level is None and found.taken == (path,) and np.isnan(found.interval(path)).all()


def test_loops_on_the_ground_show_it(tmp_path, monkeypatch):
    modes_as_found(monkeypatch)
    folder = copied(tmp_path / "campaign", "modal", "loops")
    found = identify(read_campaign(folder))
    true = truth()
    path = "robot.drives.pzt.law.constant"
    low, high = found.steps["hysteresis"].interval(path)
    assert found.level is not None and found.steps["hysteresis"].taken == ()
    assert found.known.values[found.known.paths.index(path)] == pytest.approx(float_paths(true)[path].value, rel=0.05)
    assert low < high


def test_grounds_at_different_places_are_said(tmp_path):
    """The zero of the tip moves by 4 um soon after the loops begin."""
    chain = StepRunner.of(read_campaign(copied(tmp_path / "campaign", "loops", "ramps")))
    chain.read()
    up = np.array([[4e-6], [0.0]])
    loops = chain.evidence.traces[Purpose.LOOPS]
    chain.evidence.traces[Purpose.LOOPS] = [replace(one, x=one.x + up * (one.time > 0.02)) for one in loops]
    chain.find_ground()
    assert len(chain.evidence.remarks) == 1
    assert "the ground lies at different places" in chain.evidence.remarks[0]
    assert chain.evidence.level is not None and chain.evidence.level[1] > 3e-6


def test_adhesion_does_not_push():
    duration = np.array([1e-3, 2e-3, 5e-3, 1e-2])
    error = np.full(4, 1e-9)
    line = _line(duration, 3e-6 * duration - 2e-9, error, 0.0 * duration)
    assert line.values[0] == 0.0 and line.values[1] == pytest.approx(2.723e-6, rel=1e-3)
    falling = _line(duration, 2e-8 - 1e-6 * duration, error, 0.0 * duration)
    assert falling.values[1] == 0.0 and falling.values[0] == pytest.approx(1.55e-8, rel=0.01)


def test_what_is_moved_by_its_uncertainty_stays_a_device():
    scene = load_scene(LABORATORY)
    model = FootModel(scene, "tip", "pzt", ("tip", "center"))
    paths = ("ground.film.coefficient", "ground.restitution.coefficient", "robot.drives.pzt.law.linear")
    known = Estimates(model, paths, np.array([1e-21, 0.9, 1e-7]), np.zeros((1, 3)))
    moved = known.model(np.array([-2e-21, 1.2, -1e-7])).scene
    assert moved.ground.film.coefficient == pytest.approx(1e-24)
    assert moved.ground.restitution.coefficient == 1.0 and moved.robot.drives["pzt"].law.linear == -1e-7
