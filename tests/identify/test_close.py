"""Records close to the ground: what they tell of film and attraction at their smallest gap holds the truth."""

from __future__ import annotations

import numpy as np
import pytest

from laboratory import HEXAPOD
from tarsus.base.spec import get_value
from tarsus.files.library import load_scene
from tarsus.identify.electrostatics import identify_close
from tarsus.identify.estimates import Estimates
from tarsus.identify.flight import ATTRACTION, FILM
from tarsus.identify.foot import FootModel
from tarsus.identify.traces import trace_of
from tarsus.records.purpose import Purpose
from tarsus.synthesis.plan import planned
from tarsus.synthesis.recordings import Instrument, recorded, rest_of


# Slow: six records of a hexapod. The flights and their fit are those of the film, in test_chain.py.
@pytest.mark.slow
def test_attraction_and_damping_at_the_smallest_gap_hold_the_truth():
    scene = load_scene(HEXAPOD)
    model = FootModel(scene, "foot1", "pzt", tuple(scene.robot.structure.points))
    takes = [one for one in planned(scene, 20e3, "pzt") if one.purpose is Purpose.CLOSE]
    traces = [
        trace_of(record, model.points, take.name, record.drive, rest_of(take), take.gap)
        for n, take in enumerate(takes)
        for record in recorded(scene, take, Instrument(), "pzt", [n])
    ]
    step = identify_close(model, Estimates.nothing(model), traces, seed=7)
    assert step.used[0].used == len(traces) == 6 and not step.left_out
    gap = min(one.gap or 1.0 for one in takes)
    film, thickness, pull, offset = (float(get_value(scene, path)) for path in (*FILM, *ATTRACTION))
    truth = film / (gap + thickness) ** 3, pull / (gap + offset) ** 2
    for true, (value, draws, _) in zip(truth, step.combinations.values(), strict=True):
        low, high = np.quantile(draws, [0.025, 0.975])
        assert low < true < high and value == pytest.approx(true, rel=0.2)
    for one in step.residuals:
        assert 0.9 < one.rms < 1.1
