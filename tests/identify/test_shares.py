"""Participations from repeated responses: their intervals hold the poles' part, which each repeat tells anew."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import binom

from tarsus.files.library import load_scene
from tarsus.identify.foot import FootModel
from tarsus.identify.resonance import _shapes, _shares
from tarsus.modes.frf import Frf
from tarsus.modes.modal import ModalFit
from tarsus.modes.mode import mode_of
from tarsus.modes.refine import refine_pole
from tarsus.records.measurement import Quantity

TRIALS, REPEATS = 60, 6


# Slow: 360 fits of poles. That intervals of poles and of shares hold stays in modes/test_modal.py and test_draws.py.
@pytest.mark.slow
def test_the_interval_of_a_participation_covers_it_when_the_poles_are_found_in_the_same_noise():
    """With poles that count as certain 29 of 40 such intervals held the truth."""
    scene = load_scene("cantilever-capture")
    model = FootModel(scene, "tip", "pzt", tuple(scene.robot.structure.points))
    structure, load = scene.robot.structure, scene.robot.drives["pzt"].load
    frequency = np.arange(200.0, 8000.0, 4.0)
    s = 2j * np.pi * frequency
    omega, ratio = 2.0 * np.pi * np.array(structure.frequencies), np.array(structure.damping_ratios)
    curves = s / (s**2 + 2.0 * (ratio * omega)[:, None] * s + omega[:, None] ** 2)
    exact = (_shapes(model) * np.array(load.participation)[:, None]).T @ curves
    upper = omega * (-ratio + 1j * np.sqrt(1.0 - ratio**2))
    random = np.random.default_rng(17)
    covered = 0
    for seed in range(TRIALS):
        noise = random.standard_normal((2, REPEATS, *exact.shape)) * 0.02 * np.std(exact, axis=1)[:, None]
        repeats = (exact + noise[0] + 1j * noise[1])[:, :, None]
        points = tuple(scene.robot.structure.points)
        frf = Frf(frequency, repeats.mean(axis=0), points, ("pzt",), Quantity.VELOCITY, repeats)
        channels = frf.values[:, 0]
        fits = [
            refine_pole(frequency, channels, *pair) for pair in ((upper[0], upper[1:]), (upper[1], upper[:1]))
        ]
        found = ModalFit(frf, tuple(mode_of(frf, one, 1) for one in fits if one is not None), {}, frf.values)
        draws = _shares(model, found, seed).draws
        low, high = np.quantile(draws[:, 0], [0.025, 0.975])
        covered += bool(low <= load.participation[1] <= high)
    assert covered >= binom.ppf(1e-3, TRIALS, 0.95)
