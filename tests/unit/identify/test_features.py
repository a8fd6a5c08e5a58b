"""Features of runs and their errors."""

from __future__ import annotations

import numpy as np
import pytest

import tarsus as ts
from laboratory import LABORATORY
from scene_files import scene
from tarsus.base.errors import InputError
from tarsus.identify.features import FEATURES, Features, Resolution, features_of, simulated
from tarsus.identify.limits import field_limits

E = "ground.restitution.coefficient"
BOUNCING = ts.load_scene(
    LABORATORY, volts=2, hz=100, **{"signals.pzt.kind": "ramped_square", "signals.pzt.duty": 0.25}
)
DURATION = 0.08


def test_features_are_the_measures_and_the_highest_rebound():
    run = ts.simulate(BOUNCING, DURATION)
    found = features_of(run)
    assert found.names == FEATURES and found.units == ("s", "m", "1", "m/s", "m") and found.periods == 5
    for k in range(4):
        assert found.values[k] == run.measures[FEATURES[k]].value
    late = run.all_events[run.all_events["time"] > 0.03]
    after_bounce = np.flatnonzero(late["kind"][:-1] == 1) + 1
    apexes = late["apex"][after_bounce]
    assert found.values[4] == pytest.approx(apexes[apexes > 1e-6].mean(), rel=1e-6)


def test_a_batch_has_the_features_of_its_runs_and_several_feet_their_own():
    found = simulated(BOUNCING, {E: [0.2, 0.4]}, DURATION)
    alone = features_of(ts.simulate(ts.with_values(BOUNCING, {E: 0.4}), DURATION))
    assert found.of(1).values == pytest.approx(alone.values, rel=1e-4)
    plate = features_of(ts.simulate(scene("three_feet"), 0.02), ("peak", "impacts"))
    assert plate.names == ("peak.a", "impacts.a", "peak.b", "impacts.b", "peak.c", "impacts.c")
    stopped = simulated(BOUNCING, {E: [0.2]}, DURATION, accuracy=ts.Accuracy(steps=20))
    assert np.isnan(stopped.values).all()


def test_an_unknown_feature_is_refused_with_the_nearest():
    with pytest.raises(InputError, match="no feature 'peek'; did you mean 'peak'"):
        features_of(ts.simulate(BOUNCING, DURATION), ("peek",))


def test_errors_average_out_but_for_the_share_of_the_model():
    tool = Resolution(length=3e-7, share=0.01)
    error = [
        Features(("peak",), ("m",), np.array([1e-4]), np.array([4e-7]), n).error(tool)[0]
        for n in (1, 25, 10**8)
    ]
    assert error == pytest.approx([np.hypot(5e-7, 1e-6), np.hypot(1e-7, 1e-6), 1e-6], rel=1e-4)
    nothing = Features(("impact_speed",), ("m/s",), np.array([np.nan]), np.array([np.nan]), 4)
    assert nothing.error(Resolution(speed=1e-3)) == pytest.approx([5e-4])


def test_limits_are_those_of_the_description():
    assert field_limits(BOUNCING, E) == (0.0, 1.0)
    assert field_limits(BOUNCING, "robot.structure.damping_ratios.0")[0] == 0.0
    with pytest.raises(InputError, match="unknown path"):
        field_limits(BOUNCING, "ground.restitution.coeficient")
    with pytest.raises(InputError, match="the path of a number"):
        field_limits(BOUNCING, "ground.restitution")
