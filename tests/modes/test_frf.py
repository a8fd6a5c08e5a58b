"""Frequency responses from records: what each estimator is blind to, and what records cannot give."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import chirp, lfilter
from scipy.signal.windows import hann

from tarsus.base.errors import InputError
from tarsus.modes import Estimator, Frf, ModeVerdict, estimate_frf, identify_modes
from tarsus.modes.lsfd import pole_curves
from tarsus.records.measurement import Channel, Measurement, Quantity

RATE = 4096.0
BAND = (50.0, 1500.0)
DIGITS = ((0.02, 0.01), (1.0, -1.6, 0.81)), ((0.0, 0.03), (1.0, -0.4, 0.5))


def record(drives: np.ndarray, noise_in: float = 0.0, noise_out: float = 0.0, seed: int = 0) -> Measurement:
    """Drives (ni, ns) through digital filters to one velocity, with noise relative to each channel."""
    random = np.random.default_rng(seed)
    out = sum(lfilter(*DIGITS[k], row) for k, row in enumerate(drives))
    rows = [*drives, np.asarray(out)]
    rows = [
        row + level * row.std() * random.standard_normal(row.size)
        for row, level in zip(rows, [noise_in] * len(drives) + [noise_out], strict=True)
    ]
    channels = [Channel(f"u{k}", Quantity.VOLTAGE) for k in range(len(drives))]
    return Measurement((*channels, Channel("v", Quantity.VELOCITY, point="tip")), np.array(rows), 1.0 / RATE)


def exact(frequency: np.ndarray, k: int = 0) -> np.ndarray:
    """Response (nf,) of a filter."""
    z = np.exp(-2.0j * np.pi * frequency / RATE)
    above, below = DIGITS[k]
    return np.polyval(above[::-1], z) / np.polyval(below[::-1], z)


def random_drives(count: int, seed: int, seconds: float = 30.0) -> np.ndarray:
    return np.random.default_rng(seed).standard_normal((count, int(RATE * seconds)))


def test_a_sweep_is_transformed_whole():
    time = np.arange(int(4 * RATE)) / RATE
    sweep = np.where(time < 3.0, chirp(time, 20.0, 3.0, 1900.0), 0.0)[None]
    frf = estimate_frf([record(sweep)], ["u0"], ["v"], BAND)
    assert frf.outputs == ("tip",) and frf.inputs == ("u0",) and frf.quantity is Quantity.VELOCITY
    assert frf.line == pytest.approx(0.25)
    assert frf.coherence is None and frf.repeats is None, "one average has no coherence"
    assert np.abs(frf.values[0, 0] / exact(frf.frequency) - 1.0).max() < 0.01


def test_each_estimator_is_right_where_its_noise_is():
    def of(estimator: Estimator, noise_in: float, noise_out: float) -> Frf:
        one = record(random_drives(1, 1), noise_in, noise_out)
        return estimate_frf([one], ["u0"], ["v"], BAND, estimator, segment=0.125)

    for estimator, noise in ((Estimator.H1, (0.0, 0.5)), (Estimator.H2, (0.5, 0.0))):
        frf = of(estimator, *noise)
        assert np.median(np.abs(frf.values[0, 0] / exact(frf.frequency))) == pytest.approx(1.0, abs=0.01)
    h1, h2, hv = (of(one, 0.5, 0.5) for one in (Estimator.H1, Estimator.H2, Estimator.HV))
    between = np.sqrt(np.abs(h1.values * h2.values))
    assert np.abs(hv.values) == pytest.approx(between, rel=1e-9), "the geometric mean, for one drive"
    wide = h1.frequency < 400.0
    assert np.median(np.abs(h1.values[0, 0, wide] / exact(h1.frequency)[wide])) == pytest.approx(0.8, abs=0.02)
    assert h1.coherence is not None
    assert h1.coherence == pytest.approx(np.abs(h1.values[0] / h2.values[0]), rel=1e-9)


@pytest.mark.parametrize("estimator", [Estimator.H1, Estimator.HV])
def test_two_drives_are_told_apart(estimator):
    drives = [random_drives(2, seed) for seed in (2, 3)]
    for pair in drives:
        pair[1] += 0.6 * pair[0]
    frf = estimate_frf([record(pair) for pair in drives], ["u0", "u1"], ["v"], BAND, estimator, segment=0.25)
    assert frf.repeats is not None and frf.repeats.shape == (2, *frf.values.shape)
    for k in range(2):
        assert np.median(np.abs(frf.values[0, k] / exact(frf.frequency, k) - 1.0)) < 0.01
    assert frf.coherence is not None and np.median(frf.coherence) > 0.999


@pytest.mark.parametrize(
    ("segment", "resolved", "hum"), [(0.2, False, 0.0), (0.7, True, 0.0), (0.7, True, 10.0), (2.0, True, 0.0)]
)
def test_the_smearing_of_a_window_is_part_of_the_model(segment, resolved, hum):
    """A tone of no width beside the mode, ten times as strong, is none."""
    pole = np.exp(2.0 * np.pi * 200.0 / RATE * complex(-0.01, np.sqrt(1.0 - 1e-4)))  # half-power band: 4 Hz
    drive = random_drives(1, 4, 120.0)
    response = lfilter([0.0, 0.1], [1.0, -2.0 * pole.real, abs(pole) ** 2], drive[0])
    response += hum * np.std(response) * np.sin(2.0 * np.pi * 260.0 * np.arange(len(response)) / RATE)
    channels = (Channel("u", Quantity.VOLTAGE), Channel("v", Quantity.DISPLACEMENT))
    measured = Measurement(channels, np.array([drive[0], response]), 1.0 / RATE)
    frf = estimate_frf([measured], ["u"], ["v"], (100.0, 300.0), segment=segment)
    modes = identify_modes(frf, (100.0, 300.0)).modes
    if resolved:
        assert [mode.verdict for mode in modes] == [ModeVerdict.DETERMINED]
        assert modes[0].frequency.value == pytest.approx(200.0, rel=2e-4)
        damping = modes[0].damping
        assert damping.value == pytest.approx(0.01, rel=0.06), "12 % wider at four lines without"
        assert damping.low < 0.01 < damping.high
    else:
        assert {mode.verdict for mode in modes} == {ModeVerdict.UNDER_RESOLVED}
        assert any("below the line spacing" in mode.reason for mode in modes)


def test_what_records_cannot_give():
    good = record(random_drives(1, 4, 4.0))
    with pytest.raises(InputError, match="no record"):
        estimate_frf([], ["u0"], ["v"], BAND)
    with pytest.raises(InputError, match="record 2 has 8192 samples"):
        estimate_frf([good, record(random_drives(1, 4, 2.0))], ["u0"], ["v"], BAND)
    with pytest.raises(InputError, match="2 drives need at least 2 averages, got 1"):
        estimate_frf([record(random_drives(2, 4, 4.0))], ["u0", "u1"], ["v"], BAND)
    with pytest.raises(InputError, match="does not fit into a record"):
        estimate_frf([good], ["u0"], ["v"], BAND, segment=10.0)
    with pytest.raises(InputError, match="H2 is for a single drive"):
        pair = record(random_drives(2, 4, 4.0))
        estimate_frf([pair], ["u0", "u1"], ["v"], BAND, Estimator.H2, segment=0.25)
    with pytest.raises(InputError, match="'u0' is no drive: it does not change"):
        estimate_frf([record(np.ones((1, 4096)))], ["u0"], ["v"], BAND)
    time = np.arange(int(4 * RATE)) / RATE
    tone = record((np.sin(2.0 * np.pi * 100.0 * time) * np.hanning(len(time)))[None])
    with pytest.raises(InputError, match=r"does not excite .* lines of the band, .* narrow the band"):
        estimate_frf([tone], ["u0"], ["v"], BAND)
    with pytest.raises(InputError, match="are drive and response channels swapped"):
        estimate_frf([good], ["v"], ["u0"], BAND)


def test_a_pole_through_a_window_is_the_transform_of_its_motion_times_the_windows_autocorrelation():
    count, length, pole = 4096, 0.5, complex(-9.0, 2.0 * np.pi * 203.0)
    window = hann(count, sym=False)
    held = np.correlate(window, window, "full")[count - 1 :] / (window @ window)
    time, f = length / count * np.arange(count), np.arange(180.0, 220.0, 1.0 / length)
    turning = np.exp((pole - 2.0j * np.pi * f[:, None]) * time) * held
    wanted = np.trapezoid(turning, time, axis=1)
    assert pole_curves(f, np.array([pole]), True)[:, 0] == pytest.approx(wanted, rel=1e-4)
