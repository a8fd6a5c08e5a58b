"""How late responses are, and behind which low-pass, from modes in closed form; volts that are later."""

from __future__ import annotations

import numpy as np
import pytest

from tarsus.identify.lateness import LowPass, lateness_of
from tarsus.identify.volts import jumps_of, moved
from tarsus.modes.frf import Frf
from tarsus.modes.modal import ModalFit, identify_modes
from tarsus.records.measurement import Quantity

STEP = 50e-6


def responses(late: float, low: LowPass | None) -> ModalFit:
    """Two real modes behind a delay and a low-pass, at 57 dB."""
    random, frequency = np.random.default_rng(3), np.arange(200.0, 9000.0, 8.0)
    s = 2.0j * np.pi * frequency
    omega, zeta = 2.0 * np.pi * np.array([623.0, 6424.0]), np.array([0.011, 0.072])
    modes = 1.0 / (s**2 + 2.0 * (zeta * omega)[:, None] * s + omega[:, None] ** 2)
    through = np.exp(-s * late) * (1.0 if low is None else low.response(s))
    values = through * (np.array([[1.0, 20.0], [0.4, -12.0]]) @ modes)
    noise = random.standard_normal((6, 2, 2, len(s)))
    size = 1.4e-3 * np.sqrt(np.mean(np.abs(values) ** 2, axis=1))[:, None]
    repeats = (values + size * (noise[:, 0] + 1.0j * noise[:, 1]))[:, :, None]
    frf = Frf(frequency, repeats.mean(axis=0), ("a", "b"), ("volts",), Quantity.DISPLACEMENT, repeats)
    return identify_modes(frf, (200.0, 9000.0), 12, between_fits=False)


@pytest.mark.parametrize("late", [0.0, 6e-6, pytest.param(-4e-6, marks=pytest.mark.slow)])
def test_delay_behind_the_drive(late: float) -> None:
    """From the residues of modes that are real."""
    seen = lateness_of(responses(late, None))
    assert seen is not None and seen.low is None
    assert seen.late.value == pytest.approx(late, abs=0.05e-6)
    assert seen.off(STEP) == (late != 0.0)


def test_low_pass_is_told_from_a_delay() -> None:
    """Its kind, its corner to 0.5 %, and the delay of what is slow."""
    corner = 8000.0
    poles = np.exp(1.0j * np.pi * (2.0 * np.arange(4) + 5.0) / 8.0)
    low = LowPass("butter", poles, corner)
    assert low.delay == pytest.approx(2.6131 / (2.0 * np.pi * corner), rel=1e-4)
    seen = lateness_of(responses(0.0, low))
    assert seen is not None and seen.low is not None
    assert seen.low.name == "butter low-pass of order 4"
    assert seen.low.corner == pytest.approx(corner, rel=5e-3)
    assert seen.late.value == pytest.approx(low.delay, abs=0.2e-6)


def test_delayed_volts() -> None:
    """A triangle keeps its corners, a square the jumps that a sample now lies within."""
    place = np.arange(200.0)
    triangle = 5.0 * np.abs((place / 40.0) % 2.0 - 1.0)
    shifted = 5.0 * np.abs(((place - 0.12) / 40.0) % 2.0 - 1.0)
    assert moved(triangle, 0.12)[5:-5] == pytest.approx(shifted[5:-5], abs=1e-3)
    square = np.where((place // 40) % 2 == 0, 5.0, -5.0)
    assert list(jumps_of(square)) == [39, 79, 119, 159]
    assert list(jumps_of(moved(square, 0.4))) == [39, 40, 79, 80, 119, 120, 159, 160]
