"""The clock of the motion beside that of the drive, from sweeps up and down."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tarsus.identify.clock import PACE, clocks_of, stretched
from tarsus.identify.instruments import Instruments
from tarsus.model.drive.waveforms import SweptSine
from tarsus.records.measurement import Channel, Measurement, Quantity

STEP, COUNT = 5e-5, 24000
UP = SweptSine(amplitude=0.2, start_frequency=200.0, stop_frequency=9000.0, duration=1.0)
DOWN = SweptSine(amplitude=0.2, start_frequency=9000.0, stop_frequency=200.0, duration=1.0)


def sweep(signal: SweptSine, slow: float, seed: int, late: float = 0.0) -> Measurement:
    """A displacement that follows the volts, late [s], recorded in steps that are longer by a share, 40 dB."""
    time = STEP * np.arange(COUNT, dtype=np.float64)
    moved = 1e-6 * signal.volts(np.maximum(time * (1.0 + slow) - late, 0.0))
    moved += 1e-2 * moved.std() * np.random.default_rng(seed).standard_normal(COUNT)
    channels = Channel("x", Quantity.DISPLACEMENT, "tip"), Channel("u", Quantity.VOLTAGE)
    return Measurement(channels, np.array([moved, signal.volts(time)]), STEP, 0.0, f"sweep {seed}", "u")


@pytest.mark.parametrize("slow", [1e-4, -3e-5, 4e-6])
def test_the_clock_is_found_and_corrected(slow):
    sweeps = [(sweep(one, slow, k), one) for k, one in enumerate((UP, DOWN, UP))]
    found = clocks_of(sweeps).pace
    assert found is not None and found.value == pytest.approx(slow, abs=max(4.0 * found.error, 2.0 * slow**2))
    assert found.error < 0.05 * PACE
    instruments = Instruments(STEP, pace=found)
    assert "clock" in instruments.sentences()[0] and ("slow" if slow > 0.0 else "fast") in instruments.sentences()[0]
    taken = instruments.corrected(sweeps[0][0], True)
    assert taken.step == pytest.approx(STEP * (1.0 + slow), rel=1e-9)
    off = 1e-6 * taken["u"] - taken["x"]
    assert np.std(off[100:19000]) < 1.02e-2 * np.std(taken["x"][:20000]), "nothing is left but the noise"


def test_one_clock_is_left_alone():
    found = clocks_of([(sweep(one, 0.0, k), one) for k, one in enumerate((UP, DOWN))]).pace
    assert not Instruments(STEP, pace=found).differ
    assert clocks_of([(sweep(UP, 1e-4, k), UP) for k in (1, 2)]).pace.error == np.inf, (
        "all pass all frequencies at one time"
    )


@pytest.mark.parametrize("slow", [0.0, 5e-5])
def test_starts_that_are_late_by_more_or_less_are_found_beside_the_clock(slow):
    lates = [10e-6, -14e-6, 31e-6, 3e-6]
    sweeps = [(sweep(one, slow, k, lates[k]), one) for k, one in enumerate((UP, DOWN, UP, DOWN))]
    found = clocks_of(sweeps)
    assert found.pace.value == pytest.approx(slow, abs=1e-7)
    assert list(found.starts) == [f"sweep {k}" for k in range(4)]
    assert list(found.starts.values()) == pytest.approx(np.array(lates) - np.mean(lates), abs=0.1e-6)
    assert not clocks_of([(sweep(one, slow, k), one) for k, one in enumerate((UP, DOWN, UP))]).starts


def test_samples_that_were_lost_are_no_clock():
    """One of three sweeps lost a sample in its middle, the later ones having moved up."""
    sweeps = [(sweep(one, 0.0, k), one) for k, one in enumerate((UP, DOWN, UP))]
    record, signal = sweeps[1]
    moved = np.append(np.delete(record["x"], COUNT // 2), record["x"][-1])
    sweeps[1] = replace(record, values=np.array([moved, record["u"]])), signal
    found = clocks_of(sweeps)
    (said,) = Instruments(STEP, pace=found.pace, starts=found.starts, lost=found.lost).sentences()
    assert said.startswith("samples of the motion were lost in the sweeps")


def test_a_sweep_is_known_between_its_samples():
    time = STEP * np.arange(COUNT, dtype=np.float64)
    off = stretched(UP.volts(time), 1e-4) - UP.volts(time * (1.0 + 1e-4))
    assert np.abs(off[100:19000]).max() < 5e-3 * UP.amplitude
