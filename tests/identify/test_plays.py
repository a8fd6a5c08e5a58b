"""Weights of plays from slow loops: their intervals hold the truth as often as they say, and none leans to a side."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import binom

from tarsus.files.library import load_scene
from tarsus.identify.estimates import Estimates
from tarsus.identify.foot import FootModel
from tarsus.identify.hysteresis import Shares, identify_hysteresis
from tarsus.identify.traces import Trace
from tarsus.model.drive.laws import PrandtlIshlinskii
from tarsus.model.scene import ModalLoad

LEVELS = (0.0, -8.0, 8.0, -6.0, 6.0, -4.0, 4.0, 0.0)
SLOPE, STEP, REST, NOISE = 28.0, 2e-3, 0.1, 4e-7


def covered(trials: int, repeats: int = 3) -> tuple[np.ndarray, np.ndarray]:
    """How often (6,) the interval of each weight holds the truth, over trials of noise, and the mean of what its
    estimate is off [standard deviations]."""
    scene = load_scene("cantilever-capture")
    model = FootModel(scene, "tip", "pzt", tuple(scene.robot.structure.points))
    law, load = model.law, scene.robot.drives["pzt"].load
    assert isinstance(law, PrandtlIshlinskii) and isinstance(load, ModalLoad)
    turns = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(LEVELS)) / SLOPE)])
    time = np.arange(-REST, turns[-1], STEP)
    volts = np.interp(time, turns, LEVELS)
    every = np.union1d(time, turns)  # no sample meets a turn of the voltage
    force = np.asarray(law.force(np.interp(every, turns, LEVELS), model.history))[np.isin(every, time)]
    x = model.by_drive[:, None] * (force - force[0])
    shares = np.array(load.participation[1:])
    known = Shares(shares, np.diag((3e-4 * shares) ** 2), np.tile(shares, (400, 1)))
    random, held, off = np.random.default_rng(8), [], []
    own = np.full(2, NOISE)
    for trial in range(trials):
        seen = [
            Trace(
                f"loops-{k}",
                "loops",
                model.points,
                time,
                x + NOISE * random.standard_normal(x.shape),
                0.0 * x,
                volts,
                own,
                own,
                0.1 * own,
            )
            for k in range(repeats)
        ]
        step = identify_hysteresis(Estimates.nothing(model), seen, None, known, trial)
        at = [k for k, path in enumerate(step.paths) if ".weights." in path]
        ends = np.array([step.interval(step.paths[k]) for k in at])
        held.append((ends[:, 0] <= law.weights) & (law.weights <= ends[:, 1]))
        off.append((step.values[at] - law.weights) / step.std[at])
    return np.sum(held, axis=0), np.mean(off, axis=0)


@pytest.mark.parametrize("trials", [4, pytest.param(60, marks=pytest.mark.slow)])
def test_intervals_of_plays_hold_and_lean_to_no_side(trials: int) -> None:
    """Of 18 devices that of the fourth held in 14; of these and 25 others in 39, and here as often as it says."""
    held, off = covered(trials)
    assert held.sum() >= binom.ppf(1e-3, 6 * trials, 0.95)
    assert np.all(held >= binom.ppf(1e-3, trials, 0.95)), held
    assert np.all(np.abs(off) < 3.5 / np.sqrt(trials)), off
