"""Impacts found in a record, and the plain figures of them against their definitions."""

from __future__ import annotations

import numpy as np
import pytest

import tarsus as ts
from hexapod_records import measurement
from tarsus.impacts.detection import detect_impacts
from tarsus_reproduce.plain_figures import plain_figures

NOISE = 1e-3


def saw(*after: int, count: int = 400, noise: float = NOISE) -> np.ndarray:
    """A velocity that falls by 0.002 a sample and jumps up by one at the samples named."""
    random = np.random.default_rng(5)
    jumps = np.zeros(count)
    jumps[list(after)] = 1.0
    return np.cumsum(jumps) - 0.002 * np.arange(count) + noise * random.standard_normal(count)


def test_jumps_are_found_where_they_are():
    """Of those that are too close the strongest counts."""
    record = measurement(saw(50, 61, 300), noise=NOISE)
    found = detect_impacts(record, "a")
    assert found.after.tolist() == [50, 61, 300]
    assert found.jump == pytest.approx(np.ones(3), abs=6.0 * found.deviation)
    assert found.score == pytest.approx(np.abs(found.jump) / found.deviation)
    assert found.deviation == pytest.approx(1.83 * NOISE, rel=0.15)
    assert [len(detect_impacts(record, "a", separation=apart)) for apart in (20e-5, 1e-2)] == [2, 1]


def test_plain_figures_by_hand():
    # foot a: 1 m/s down to 0.5 up, then 2 m/s down to 1.2 up; b changes by -0.3 and -0.96
    foot = np.array([-1.0, -1.0, 0.5, 0.5, -2.0, -2.0, 1.2, 1.2])
    other = np.array([0.0, 0.0, -0.3, -0.3, 0.0, 0.0, -0.96, -0.96])
    record = measurement(foot, other)
    impacts = detect_impacts(measurement(saw(50, 100)), "a")
    by_hand = type(impacts)(np.array([2, 6]), np.array([1.5, 3.2]), np.array([9.0, 9.0]), 0.1)
    found = plain_figures(record, record, "a", by_hand)
    assert found.restitution == pytest.approx([0.5, 0.6])
    assert found.ratio == pytest.approx(np.array([[-1.5, 0.3], [-1.6, 0.48]]))
    assert found.column == pytest.approx(np.array([[1.0, -0.2], [1.0, -0.3]]))
    assert found.restitution_spread.value == pytest.approx(0.55)
    assert found.restitution_spread.scatter == pytest.approx(np.std([0.5, 0.6], ddof=1))
    assert found.column_spread[1].value == pytest.approx(-0.25)
    upside_down = measurement(-foot, other)
    still = plain_figures(upside_down, upside_down, "a", by_hand)
    assert still.restitution == pytest.approx([0.5, 0.6]), "the sign of the normal does not matter"
    with pytest.raises(ts.InputError, match="no impact of channel 'a' turns an approach"):
        plain_figures(measurement(np.abs(foot), other), record, "a", by_hand)
