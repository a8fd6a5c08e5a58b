"""What one percent of each number costs a soft landing: slopes of its hardest touchdown, and the worst nearby."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from tarsus.base.arrays import Floats
from tarsus.design.grounds import Grounds
from tarsus.design.percents import PERCENT, Ground, Percent, Percents, all_at_once, costly, numbers_of, varied
from tarsus.solve import Run, simulate

if TYPE_CHECKING:
    from tarsus.design.trials import Trials
    from tarsus.model.scene import Scene

STEPS = PERCENT * np.linspace(-1.0, 1.0, 9)
"""Where one number is varied: a speed that is the root of an energy has its kink within the percent, and quarters of it
on either side see what lies beside."""
BOX = 512
"""Places where all are off at once: what none of so many is, is less than 0.6 % of the box (95 %)."""


def landing_percents(trials: Trials, row: Floats, scene: Scene) -> Percents:
    """Of the signal (2S,) of trials, which the scene has."""
    numbers = numbers_of(trials.scene, lambda path: path.startswith(("signals.", "initial.")))

    def speeds(ground: Ground) -> Floats:
        return trials.on(row[None], Grounds(ground)).speed[0]

    own = float(trials.on(row[None], Grounds({})).speed[0, 0])
    worst = {name: float(found.max()) for name, found in varied(numbers, speeds, STEPS).items()}
    names = costly(worst, own, most=False)
    slopes = simulate(
        scene,
        trials.periods * trials.period,
        gradients={name: {path: PERCENT * value for path, value in numbers[name].items()} for name in names},
    ).gradient_of_runs(lambda run: _hardest(trials, run), "m/s")
    each = tuple(Percent(name, slopes[name], slopes.error[name], worst[name]) for name in names)
    box = float(all_at_once(numbers, names, speeds, BOX).max()) if names else own
    return Percents("hardest touchdown", "m/s", False, own, box, each)


def _hardest(trials: Trials, run: Run) -> float:
    """Speed [m/s] of the hardest touchdown of the last period."""
    before = np.abs(run.events["speed_before"][trials.numbers_of(run.events)])
    return float(before.max(initial=0.0))
