"""The impact map estimated from synthetic records: close to the truth, with intervals that mean it."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

import tarsus as ts
from example_files import load_file
from hexapod_records import POINTS, RESTITUTION, records, runs, structure, true_column, vibrometer
from printed_robots import hexapod
from tarsus.impacts import FitWindow, ImpactMapEstimate, estimate_impact_map
from tarsus.impacts.shapes import mode_shapes
from tarsus.model.laws import DominantMode
from tarsus.synthesis.vibrometer import Vibrometer

RECOVERY = Path(__file__).parents[2] / "benchmarks" / "recovery.py"


@cache
def estimate() -> ImpactMapEstimate:
    """Of the first pair of records, made once."""
    return estimate_impact_map(*records(), structure(), "foot1")


def test_a_pair_at_40_db():
    found = estimate()
    assert found.restitution.value == pytest.approx(RESTITUTION, rel=0.02)
    assert np.linalg.norm(found.values - true_column()) < 0.05 * np.linalg.norm(true_column())
    assert found.values[0] == 1.0
    inside = [one.low <= b <= one.high for one, b in zip(found.column[1:], true_column()[1:], strict=True)]
    assert sum(inside) >= 4 and abs(found.restitution.value - RESTITUTION) < 4.0 * found.restitution.std
    name, value, ends, *_ = found.table().rows[0]
    assert (name, value, ends) == (
        "restitution",
        found.restitution.value,
        (found.restitution.low, found.restitution.high),
    )
    assert [row[0] for row in found.table().rows[1:]] == list(POINTS) and "foot6" in str(found)
    assert found.matrix_column[0] == pytest.approx(-found.restitution.value)
    assert found.matrix_column[1:] == pytest.approx(-(1.0 + found.restitution.value) * found.values[1:])


def test_each_impact_is_that_of_the_run():
    found = estimate().fitted
    events = runs()[0].events
    late = float(np.random.default_rng(2).uniform(0.0, 5e-6))
    nearest = np.abs(found.time[:, None] + late - events["time"][None, :]).argmin(axis=1)
    deviation = np.sqrt(found.covariance[:, 0, 0])
    score = (found.before + events["speed_before"][nearest]) / deviation
    assert len(found) > 15 and np.median(np.abs(found.time + late - events["time"][nearest])) < 1e-6
    assert np.sqrt(np.mean(score**2)) == pytest.approx(1.0, abs=0.35)
    assert np.abs(score).max() < 4.5


def test_a_bad_repeat_is_left_out_and_only_bad_ones_are_an_error():
    (close, in_air), (other, _) = records(1), records(2)
    louder = replace(other, values=1.3 * other.values)
    mixed = estimate_impact_map([close, louder], in_air, structure(), "foot1")
    alone = estimate()
    assert mixed.repeats[1].refused and mixed.repeats[1].fitted is None
    assert mixed.restitution == alone.restitution
    with pytest.raises(ts.InputError, match="The repeat is rejected: channel 'foot1' has a gain of 1"):
        estimate_impact_map(louder, in_air, structure(), "foot1")


# Slow: its records are filtered at many times their rate. test_free.py leaves smeared samples out of one impact.
@pytest.mark.slow
def test_a_slow_instrument_needs_samples_left_out():
    near, far = runs()
    slow = ts.with_values(vibrometer(), {"bandwidth": 100e3})
    pair = slow.measure(near, POINTS, 2), slow.measure(far, POINTS, 3)
    blurred = estimate_impact_map(*pair, structure(), "foot1")
    found = estimate_impact_map(*pair, structure(), "foot1", window=FitWindow(smeared=2))
    assert abs(blurred.restitution.value - RESTITUTION) > 0.02 * RESTITUTION
    assert found.restitution.value == pytest.approx(RESTITUTION, rel=0.02)
    assert np.linalg.norm(found.values - true_column()) < 0.05 * np.linalg.norm(true_column())


def test_another_map_is_measured_as_it_is():
    near = hexapod(
        signal=ts.Square(amplitude=10.0, frequency=20.0), impact=DominantMode(mode=6, passive=False), restitution=0.4
    )
    far = ts.with_values(near, {"robot.feet.foot1.gap": 0.03})
    close, in_air = ts.simulate(near, 0.04), ts.simulate(far, 0.04)
    instrument = Vibrometer(jitter=5e-6).at_level(close, POINTS, 40.0)
    pair = instrument.measure(close, POINTS, 0), instrument.measure(in_air, POINTS, 1)
    # this map feeds energy in: the noise, 40 dB below the later motion, is a good part of the one before contact
    found = estimate_impact_map(*pair, structure(), "foot1", residual_limit=0.2)
    sixth = mode_shapes(structure(), POINTS)[1][:, 5]
    sixth = sixth / sixth[0]
    assert found.restitution.value == pytest.approx(0.4, rel=0.02)
    assert np.linalg.norm(found.values - sixth) < 0.05 * np.linalg.norm(sixth)


@pytest.mark.slow
def test_intervals_cover_over_many_drives():
    recovery = load_file(RECOVERY, "recovery")
    setting = recovery.Setting("impacts", "printed hexapod", 200e3)
    trials = [recovery.impact_trial(setting, seed) for seed in range(40)]
    restitution = [trial.numbers.pop("restitution") for trial in trials]
    columns = [list(trial.numbers.values()) for trial in trials]
    assert max(abs(one.relative) for one in restitution) < 0.02
    for column in columns:
        # the jump of the foot over its own is 1
        off, size = (np.linalg.norm([one.value - one.true for one in column]), [1.0, *(one.true for one in column)])
        assert off < 0.05 * np.linalg.norm(size)
    # 40 and 200 intervals of 95 %: what less than one in a thousand such series would miss
    assert sum(not one.covered for one in restitution) <= 7
    assert sum(not one.covered for column in columns for one in column) <= 20
