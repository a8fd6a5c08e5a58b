"""A device as an ensemble: its predictions are the measures of the runs that start from each seed."""

from __future__ import annotations

import numpy as np
import pytest

import tarsus as ts
from tarsus.calibrate.forward import random_velocities
from tarsus.measure import window_statistics
from tarsus.model.drive.waveforms import Sine
from tarsus_reproduce.cantilever import PERIODS
from tarsus_reproduce.ensembles import device_ensemble
from tarsus_reproduce.robots import WINDOWS, row_scene

SPEED = 1e-3


def test_each_number_is_the_median_over_windows_of_the_runs_of_its_seeds():
    scene, row = ts.load_scene("hexapod"), {"wave": "square", "volt_v": 10.0, "gap_um": 10.0}
    sampling = WINDOWS.sampling.model_copy(update={"draws": 3, "windows": 5})
    whole = device_ensemble("hexapod", scene, row_scene)
    (found,) = whole.predict([row], sampling=sampling)
    peaks, bounces = [], []
    for seed in range(3):
        velocity = random_velocities(scene, "foot1", seed, SPEED)
        start = ts.with_values(row_scene(scene, row), {"initial": ts.Initial(velocity=velocity)})
        run = ts.simulate(start, 0.55, ts.Accuracy(gap=1e-8))
        each = [window_statistics(run, 0.3 + 0.05 * k, 0.05) for k in range(5)]
        peaks += [one["peak"].value for one in each]
        bounces += [one["bounces_per_second"].value for one in each]
    assert found["peak"].median == pytest.approx(np.quantile(peaks, 0.5, method="inverted_cdf"), rel=1e-3)
    assert found["bounces"].p_bounce == pytest.approx(np.mean(np.array(bounces) > 0.0))
    assert min(peaks) <= found["peak"].low * (1 + 1e-6) <= found["peak"].high <= max(peaks) * (1 + 1e-6)


def test_seeds_share_energy_between_modes():
    scene = ts.load_scene("hexapod")
    mass = scene.robot.structure.matrices().mass
    row = scene.robot.structure.row("foot1")
    velocities = np.array([random_velocities(scene, "foot1", seed, SPEED) for seed in range(4000)])
    assert (velocities @ row).std() == pytest.approx(SPEED, rel=0.05)
    energies = velocities**2 @ np.diag(np.diag(mass))  # Modal: mass is diagonal
    means = energies.mean(axis=0)
    assert np.ptp(means) < 0.2 * means.mean()
    assert random_velocities(scene, "foot1", 3, SPEED) == random_velocities(scene, "foot1", 3, SPEED)


def test_a_device_is_driven_as_its_row_says_and_else_stays_as_it_is():
    scene = ts.load_scene("cantilever-1")
    row = {"freq_hz": 30.0, "volt_v": 7.0, "wave": "sine"}
    (driven,) = device_ensemble("cantilever", scene, PERIODS.driven).scenes([row])
    assert driven.signals["pzt"] == Sine(amplitude=7.0, frequency=30.0)
    assert driven.robot == scene.robot and driven.ground == scene.ground
