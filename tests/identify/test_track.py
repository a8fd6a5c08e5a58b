"""Numbers over a series of campaigns: what is steady raises no alarm, what moves does."""

import json

import numpy as np
import pytest

import tarsus as ts
from identify.campaigns import folder, session, truth
from tarsus.base.errors import InputError
from tarsus.base.spec import get_value, with_values
from tarsus.identify.track import FALSE_ALARMS, drift_of, track


@pytest.mark.parametrize(("series", "numbers", "n"), [(400, 3, 5), pytest.param(2000, 5, 8, marks=pytest.mark.slow)])
def test_a_steady_device_raises_alarms_as_seldom_as_stated(series, numbers, n):
    draw = np.random.default_rng(1)
    errors = draw.uniform(0.5, 2.0, (series, numbers, n))
    values = 3.0 + errors * draw.normal(size=errors.shape)
    tests = 2 * numbers * (n - 1)
    alarmed = [
        any(drift_of(v, e, tests)[0] is not None for v, e in zip(*one, strict=True))
        for one in zip(values, errors, strict=True)
    ]
    # the limit is Bonferroni's, whose tests overlap: fewer alarms than stated; 4 sd of 2,000 series above is 1.9 %
    assert np.mean(alarmed) < FALSE_ALARMS + 4.0 * np.sqrt(FALSE_ALARMS / series)


def test_a_jump_and_a_slow_drift_are_found():
    errors = np.full(8, 0.1)
    jump = np.where(np.arange(8) < 5, 1.0, 2.0)
    since, (rate, error) = drift_of(jump, errors, 14)
    assert since == 5 and rate > 3.0 * error
    slow = 1.0 + 0.1 * np.arange(8)  # one standard error a campaign: no two neighbours differ
    since, (rate, error) = drift_of(slow, errors, 14)
    assert since is not None and 2 < since < 8
    assert rate == pytest.approx(0.1, rel=1e-9) and error == pytest.approx(0.1 / np.sqrt(42.0), rel=1e-9)
    assert drift_of([1.0, np.nan, 1.05], [0.1, np.nan, 0.1], 2)[0] is None


def test_a_series_needs_two_campaigns():
    with pytest.raises(InputError, match="at least two"):
        track([folder()])


@pytest.mark.slow
def test_a_device_whose_adhesion_grew_is_found_and_nothing_else_moves(tmp_path):
    device = truth()
    grown = with_values(device, {"ground.adhesion.initial": 1.5 * get_value(device, "ground.adhesion.initial")})
    sessions = [session(tmp_path / str(seed), device, seed) for seed in (11, 12, 13)]
    found = ts.identify(sessions[0], track=[*sessions[1:], session(tmp_path / "14", grown, 14)])
    assert [one.path for one in found.drifts if one.since is not None] == ["ground.adhesion.initial"]
    assert found.drifts[[one.path for one in found.drifts].index("ground.adhesion.initial")].since == 3
    assert json.dumps(found.to_dict()) and "moved since '14'" in str(found)
