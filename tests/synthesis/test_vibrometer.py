"""The synthetic vibrometer against the run it records."""

from __future__ import annotations

import numpy as np
import pytest

import tarsus as ts
from hexapod_records import POINTS, runs, vibrometer
from tarsus.records.measurement import Quantity
from tarsus.synthesis.vibrometer import Vibrometer, point_velocities

FEET = POINTS[:2]


def test_without_faults_it_gives_the_velocities_of_the_run():
    run = runs(0.03)[0]
    record = Vibrometer(rate=50e3).measure(run, FEET, seed=0)
    assert record.names == (*FEET, "pzt volts")
    assert record.of(Quantity.VELOCITY) == FEET
    assert record.rate == pytest.approx(50e3)
    exact = run.at(record.time).state.v[:2]
    assert np.array([record[name] for name in FEET]) == pytest.approx(exact, abs=1e-12)
    assert record["pzt volts"][:2].tolist() == [10.0, 10.0]


def test_noise_has_its_level_and_its_seed():
    run = runs(0.03)[0]
    quiet = Vibrometer().measure(run, FEET, 0)["foot1"]
    instrument = Vibrometer().at_level(run, FEET, 40.0)
    both = np.array([quiet, Vibrometer().measure(run, FEET, 0)["foot2"]])
    assert instrument.noise == pytest.approx(0.01 * np.sqrt(np.mean(both**2)), rel=1e-3)
    once, again, other = (instrument.measure(run, FEET, seed) for seed in (3, 3, 4))
    assert np.array_equal(once.values, again.values)
    assert not np.array_equal(once.values, other.values)
    left = once["foot1"] - quiet
    assert left.std() == pytest.approx(instrument.noise, rel=0.05)
    assert np.abs(np.corrcoef(left[1:], left[:-1])[0, 1]) < 0.05
    assert once.channel("foot1").noise == pytest.approx(instrument.noise)


def test_the_trigger_is_late_by_part_of_a_sample():
    run = runs(0.03)[0]
    instrument = Vibrometer(rate=200e3, jitter=5e-6)
    delays = []
    for seed in range(5):
        late = float(np.random.default_rng(seed).uniform(0.0, 5e-6))
        record = instrument.measure(run, FEET, seed)
        exact = point_velocities(run, FEET, np.minimum(late + record.time, run.end_time))
        assert np.array([record[name] for name in FEET]) == pytest.approx(exact, abs=1e-12)
        delays.append(late)
    assert np.ptp(delays) > 1e-6


def test_the_converter_rounds_and_clips():
    run = runs(0.03)[0]
    exact = Vibrometer().measure(run, FEET, 0)
    peak = np.abs(exact["foot1"]).max()
    rounded = Vibrometer(full_scale=2.0 * peak, bits=8).measure(run, FEET, 0)
    step = 4.0 * peak / 256
    assert np.abs(rounded["foot1"] - exact["foot1"]).max() <= 0.5 * step * (1 + 1e-9)
    assert rounded["foot1"] / step == pytest.approx(np.round(rounded["foot1"] / step), abs=1e-6)
    assert rounded.channel("foot1").noise == pytest.approx(step / np.sqrt(12.0))
    assert not rounded.clipped()
    clipped = Vibrometer(full_scale=0.5 * peak).measure(run, FEET, 0)
    assert np.abs(clipped["foot1"]).max() == 0.5 * peak
    assert "channel 'foot1' is clipped" in clipped.clipped()[0]


def test_offset_and_drift_move_the_zero():
    run = runs(0.03)[0]
    exact = Vibrometer(rate=20e3).measure(run, FEET, 0)
    offset, drift = (
        [one.measure(run, FEET, seed)["foot1"] - exact["foot1"] for seed in range(30)]
        for one in (Vibrometer(rate=20e3, offset=1e-3), Vibrometer(rate=20e3, drift=1e-3))
    )
    assert max(np.ptp(one) for one in offset) < 1e-12
    assert np.std([one[0] for one in offset]) == pytest.approx(1e-3, rel=0.4)
    assert np.std([one[-1] for one in drift]) == pytest.approx(1e-3 * np.sqrt(run.end_time), rel=0.4)


def test_a_slow_instrument_follows_a_jump_late():
    run = runs(0.03)[0]
    exact = Vibrometer().measure(run, FEET, 0)["foot1"]
    slow = Vibrometer(bandwidth=20e3).measure(run, FEET, 0)["foot1"]
    jump = int(np.argmax(np.diff(exact)))
    change = exact[jump + 1] - exact[jump]
    assert slow[jump + 1] - slow[jump] < 0.6 * change
    assert slow[jump + 8] == pytest.approx(exact[jump + 8], abs=0.2 * change)
    late = float(np.random.default_rng(0).uniform(0.0, 1e-3))  # the first sample is what was before it
    begun = Vibrometer(bandwidth=20e3, jitter=1e-3).measure(run, FEET, 0)["foot1"][0]
    assert begun == pytest.approx(point_velocities(run, FEET, np.array([late]))[0, 0], rel=1e-9)
    quick = Vibrometer(bandwidth=1e6).measure(run, FEET, 0)["foot1"]
    assert np.std(quick - exact) < 0.3 * np.std(slow - exact)


def test_bad_requests_are_sentences():
    with pytest.raises(ts.InputError, match="no point 'foot9'; did you mean 'foot"):
        vibrometer().measure(runs(0.03)[0], ["foot9"], 0)
    with pytest.raises(ts.InputError, match="shorter than two samples"):
        Vibrometer(rate=1.0).measure(runs(0.03)[0], FEET, 0)
    with pytest.raises(ts.InputError, match="rate: expected a frequency"):
        Vibrometer(rate=0.0)
    assert Vibrometer(rate="256 kHz", jitter="2 us").jitter == 2e-6  # pyright: ignore[reportArgumentType]
