"""Gaits: periodic motions of walkers modulo their travel."""

from __future__ import annotations

import numpy as np
import pytest

import tarsus as ts
from tarsus.base.spec import with_values
from tarsus.orbits.follow import Follower
from tarsus.orbits.orbit import Orbit, converge


@pytest.fixture(scope="module")
def gait() -> Orbit:
    return ts.periodic(ts.load_scene("millipede"))


def test_the_packaged_walker_has_a_stable_gait(gait):
    assert gait.kind.startswith("stable, period 1, 8 impacts, 2 of them held, travels ")
    assert gait.mismatch <= 1e-10 and np.abs(gait.multipliers).max() < 1.0
    run = ts.simulate(gait.scene, 45 * gait.period)
    assert gait.travel == pytest.approx(np.diff(run.marks["body"][:, 0])[-1], rel=1e-7)
    # its events are those of the run, a period on
    start = gait.start
    later = run.events[(run.events["time"] > start) & (run.events["time"] < start + gait.period)]
    assert list(later["kind"]) == list(gait.events["kind"]) and list(later["foot"]) == list(gait.events["foot"])
    np.testing.assert_allclose(later["time"] - start, gait.events["time"], rtol=0, atol=1e-8 * gait.period)


def test_where_a_walker_is_has_the_multiplier_one_apart_from_the_others(gait):
    assert gait.travel_multiplier == pytest.approx(1.0, abs=1e-12)
    assert np.abs(np.abs(gait.multipliers) - 1.0).min() > 0.1
    assert gait.to_dict()["travel_m"] == gait.travel


def test_a_deviation_decays_by_the_largest_multiplier(gait):
    returns, largest = gait.map, float(np.abs(gait.multipliers[0]))
    state = gait.state + 1e-5 * returns.free[:, 0] * returns.scales(gait.state)[1]
    sizes = []
    for _ in range(8):
        state = returns(state).state
        sizes.append(float(np.abs((state - gait.state) / returns.scales(gait.state)).max()))
    assert (sizes[7] / sizes[1]) ** (1.0 / 6.0) == pytest.approx(largest, rel=0.5)


def test_a_gait_goes_on_at_a_higher_voltage_and_at_a_later_section(gait):
    follower = Follower.of(gait, "gait.high", 1.0)
    higher = converge(gait.scene, follower.map(14.2), gait.state, 1)
    assert higher is not None and higher.kind[:28] == gait.kind[:28] and higher.travel > gait.travel
    later, state = gait.map.later(gait.state, gait.events, 1)
    again = converge(gait.scene, later, state, 1)
    assert again is not None and list(later.contacts.held) != list(gait.map.contacts.held)
    assert again.travel == pytest.approx(gait.travel, rel=1e-8)
    np.testing.assert_allclose(np.abs(again.multipliers[0]), np.abs(gait.multipliers[0]), rtol=1e-6)


@pytest.mark.slow
def test_a_gait_is_followed_along_its_voltage(gait):
    (found,) = ts.branch(gait.scene, {"gait.high": (14.0, 14.2)}, starts=0)
    assert found.ended == "end of the range"
    first, last = found.points[0], found.points[-1]
    assert first.orbit.travel == pytest.approx(gait.travel, rel=1e-8) and last.at == 14.2
    alone = ts.periodic(gait.scene, values={"gait.high": 14.2})
    assert last.orbit.kind == alone.kind
    assert last.orbit.travel == pytest.approx(alone.travel, rel=1e-8)
    assert np.abs(last.orbit.multipliers[0]) == pytest.approx(np.abs(alone.multipliers[0]), rel=1e-5)


def test_without_a_gait_there_is_no_period():
    with pytest.raises(ts.InputError, match="no drive is periodic"):
        ts.periodic(with_values(ts.load_scene("millipede"), {"gait": None}))
