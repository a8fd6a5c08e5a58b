"""Measured responses against the figures of other tools, and those that must be refused."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.io import loadmat

from tarsus.base.errors import InputError
from tarsus.modes import Frf, ModeVerdict, identify_modes
from tarsus.modes.intervals import Basis
from tarsus.records.measurement import Quantity

DATA = Path(__file__).parents[1] / "data" / "real"


def cued() -> Frf:
    """One accelerance, 0 to 1500 Hz."""
    file = loadmat(DATA / "cued_transfer_function_clean.mat")
    step = file["freq"].item() / file["npts"].item()
    values = file["yspec"].T[None]
    return Frf(step * np.arange(values.shape[-1]), values, ("plate",), ("hammer",), Quantity.ACCELERATION)


def vtb(case: int) -> Frf:
    """A response of the vibration toolbox."""
    file = loadmat(DATA / f"vtb_case{case}.mat")
    frequency = file["Freq_domain"][:, 0].astype(float)
    return Frf(frequency, file["Hf_chan_2"].T[None], ("beam",), ("hammer",), Quantity.ACCELERATION)


def beam() -> Frf:
    """Three accelerances of a free beam, a line every hertz."""
    rows = [np.loadtxt(DATA / f"pyuff_meas_point_{k}.txt", dtype=complex, converters=complex)[None] for k in (1, 2, 3)]
    values = np.array(rows)
    return Frf(np.arange(values.shape[-1], dtype=float), values, ("p1", "p2", "p3"), ("h",), Quantity.ACCELERATION)


CUED = np.array(
    [(251.692, 0.2695), (608.920, 0.264), (843.742, 0.277), (1028.341, 0.367), (1119.900, 0.245), (1427.288, 0.319)]
)
BEAM = np.array([51.517, 142.176, 278.663, 460.395, 687.166, 958.533])


# Slow: another order and band of the same set.
@pytest.mark.parametrize(
    ("band", "order"), [((100.0, 1490.0), 40), pytest.param((20.0, 1500.0), 20, marks=pytest.mark.slow)]
)
def test_six_modes_of_an_accelerance(band, order):
    fit = identify_modes(cued(), band, order)
    six = fit.only(CUED[:, 0])
    assert six.frequencies == pytest.approx(CUED[:, 0], rel=1e-3)
    assert 100.0 * six.damping_ratios == pytest.approx(CUED[:, 1], rel=0.1)
    assert all(mode.basis is Basis.LINES for mode in six.modes)
    inside = [
        one.low <= wanted <= one.high
        for mode, (f, ratio) in zip(six.modes, CUED, strict=True)
        for one, wanted in ((mode.frequency, f), (mode.damping, ratio / 100.0))
    ]
    assert sum(inside) >= (11 if order == 40 else 9), "of 12; 4 by the scatter of the lines alone"
    assert 0.09e-3 < -fit.delay < 0.16e-3 and any("delay" in remark for remark in fit.remarks)
    extra = [mode for mode in fit.modes if mode.verdict is ModeVerdict.DETERMINED and mode not in six.modes]
    assert len(extra) <= (1 if order == 40 else 2), "7 to 10 by the scatter of the lines alone"
    if order == 40:
        assert sum(mode.verdict is ModeVerdict.DETERMINED for mode in six.modes) >= 5


def test_one_mode_of_hardly_more_than_a_line_and_one_that_turns_the_wrong_way():
    (mode,) = identify_modes(vtb(1), (156.0, 312.5), 20).modes
    assert mode.verdict is ModeVerdict.DETERMINED
    assert mode.frequency.value == pytest.approx(212.092530551, rel=1e-3)
    assert mode.damping.value == pytest.approx(0.000810, rel=0.15)
    assert mode.damping.value == pytest.approx(0.000863, rel=0.02), "pydvma's figure, also by maximum likelihood"
    fit = identify_modes(vtb(2), (156.0, 312.5), 20)
    assert fit.modes[0].frequency.value == pytest.approx(192.594, rel=2e-3)
    with pytest.raises(InputError, match=r"192\.\d+ Hz turns the wrong way"):
        fit.structure()


# Slow: a wider band of the same sets.
@pytest.mark.slow
def test_a_whole_band_shows_the_sharp_mode_and_the_wrong_way():
    fit = identify_modes(vtb(1), (10.0, 490.0))
    assert fit.frequencies[:2] == pytest.approx([34.05, 212.093], rel=1e-3)
    assert fit.modes[0].verdict is ModeVerdict.UNDER_RESOLVED, "34 Hz is one line wide"
    assert fit.only([212.0]).structure().frequencies[0] == pytest.approx(212.093, rel=1e-3)
    assert [mode.verdict for mode in identify_modes(vtb(2), (10.0, 490.0)).modes] == [ModeVerdict.WRONG_WAY]


def test_modes_between_the_lines_keep_their_frequency_and_lose_their_damping():
    fit = identify_modes(beam(), (20.0, 999.0))
    assert fit.frequencies == pytest.approx(BEAM, rel=2e-4)
    assert [mode.verdict for mode in fit.modes] == [ModeVerdict.UNDER_RESOLVED] * 6
    with pytest.raises(InputError, match=r"half-power band of 0\.\d+ Hz is below the line spacing of 1 Hz") as caught:
        fit.structure()
    assert len(caught.value.problems) == 6
