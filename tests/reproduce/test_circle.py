"""The circle fit: exact for one mode, whatever the modes elsewhere add."""

from __future__ import annotations

import numpy as np
import pytest

from tarsus.base.errors import InputError
from tarsus_reproduce.circle import fit_circle, fit_mode_circle

LINES = np.arange(560.0, 690.0, 0.5)


def mobility(frequency: float, ratio: float, offset: complex = 0.0) -> np.ndarray:
    """Velocity per force of one mode of 1 kg, and a constant, in units of the mode's peak."""
    w, own = 2.0 * np.pi * LINES, 2.0 * np.pi * frequency
    return 1.0j * w / (own**2 - w**2 + 2.0j * ratio * own * w) + offset / (2.0 * ratio * own)


@pytest.mark.parametrize("ratio", [0.002, 0.01, 0.03])
@pytest.mark.parametrize("offset", [0.0, 0.05 - 0.08j])
def test_a_mode_with_a_constant_is_exact(ratio, offset):
    fit = fit_mode_circle(LINES, mobility(623.3, ratio, offset), 623.0)
    assert fit.frequency == pytest.approx(623.3, rel=1e-9)
    assert fit.damping_ratio == pytest.approx(ratio, rel=1e-6)
    assert 2.0 * fit.radius == pytest.approx(1.0 / (2.0 * ratio * 2.0 * np.pi * 623.3), rel=1e-6)


def test_noise_of_forty_decibels_moves_it_little():
    random = np.random.default_rng(5)
    clean = mobility(623.3, 0.01)
    noise = 0.01 * np.sqrt(np.mean(np.abs(clean) ** 2)) * random.standard_normal((2, len(LINES)))
    fit = fit_mode_circle(LINES, clean + noise[0] + 1.0j * noise[1], 623.0)
    assert fit.frequency == pytest.approx(623.3, rel=5e-4)
    assert fit.damping_ratio == pytest.approx(0.01, rel=0.03)


def test_what_has_no_circle_is_refused():
    with pytest.raises(InputError, match="turns the wrong way"):
        fit_mode_circle(LINES, mobility(623.3, 0.01).conj(), 623.0)
    with pytest.raises(InputError, match=r"under-resolved: .* line spacing of 0\.5 Hz"):
        fit_mode_circle(LINES, mobility(623.3, 1e-4), 623.0)
    with pytest.raises(InputError, match="no line lies near 900 Hz"):
        fit_mode_circle(LINES, mobility(623.3, 0.01), 900.0)


def test_the_geometric_circle_of_an_arc():
    angle = np.linspace(0.3, 1.5, 9)
    centre, radius = fit_circle(2.0 - 1.0j + 3.0 * np.exp(1.0j * angle))
    assert centre == pytest.approx(2.0 - 1.0j, abs=1e-9) and radius == pytest.approx(3.0, abs=1e-9)
