"""Attractors: the ball on a vibrating table in closed form, the millipede's gaits, starts that do not settle."""

from __future__ import annotations

import math

import numpy as np
import pytest

import tarsus as ts
from scene_files import scene
from tarsus.base.events import IMPACTS


def table(restitution, gamma):
    return scene("vibrating_table", {"ground.restitution.coefficient": restitution, "signals.table.amplitude": gamma})


def multipliers_of_bounce(e, gamma, sign):
    """Of one bounce a period: a(t) = -1 + gamma sin(2 pi t) in the table's frame, T = 1 s, v+ = e / (1 + e), impact at
    the phase theta with gamma cos(theta) / (2 pi) = 1/2 - v+; the return map of impact time and speed has determinant
    e^2 and the trace below."""
    sine = sign * math.sqrt(1.0 - (math.pi * (1.0 - e) / (gamma * (1.0 + e))) ** 2)
    trace = -2.0 * e + (1.0 + e) ** 2 * (1.0 - gamma * sine)
    return np.sort_complex(np.roots([1.0, -trace, e * e]))


@pytest.fixture(scope="module")
def ball():
    return ts.attractors(table(0.8, 0.5), starts=40, seed=1)


def test_a_ball_rests_or_bounces(ball):
    assert len(ball) == 2 and not ball.others
    assert sum(one.share.count for one in ball.found) == 40
    for i, one in enumerate(ball.found):
        assert one.share.count == len(one.members) == (ball.label == i).sum()
        assert one.share.low < one.share.share < one.share.high
    rest, bounce = sorted(ball.found, key=lambda one: one.impacts)
    assert (rest.multiple, rest.impacts, rest.energy) == (1, 0, 0.0)
    assert (bounce.multiple, bounce.impacts) == (1, 1) and bounce.confirmed and rest.confirmed
    after = 0.8 / 1.8
    assert bounce.energy == pytest.approx(0.5 * (after / 0.8) ** 2 * (1.0 - 0.64), rel=1e-6)
    assert bounce.measures["impact_speed"].value == pytest.approx(after / 0.8, rel=1e-6)
    assert np.sort_complex(bounce.orbit.multipliers) == pytest.approx(multipliers_of_bounce(0.8, 0.5, 1.0), abs=1e-7)


def test_single_long_runs_lead_where_they_are_said_to(ball):
    for r in range(0, 40, 5):
        values = {path: one[0] for path, one in ball.box.values(ball.points[r : r + 1]).items()}
        run = ts.simulate(ts.with_values(ball.box.scene, values), 200.0)
        late = (run.events["time"] > 150.0) & np.isin(run.events["kind"], IMPACTS)
        assert late.sum() in (0, 50) and (late.sum() > 0) == (ball[int(ball.label[r])].impacts > 0)


def test_the_edge_of_the_basins_is_the_unstable_bounce(ball):
    (edge,) = ball.edges
    assert edge.width < 2e-10
    assert not edge.orbit.stable
    assert np.sort_complex(edge.orbit.multipliers) == pytest.approx(multipliers_of_bounce(0.8, 0.5, -1.0), abs=1e-6)


def test_beyond_the_flip_a_ball_bounces_with_twice_the_period():
    gamma = math.hypot(math.pi / 3.0, 10.0 / 9.0) + 0.01
    found = ts.attractors(table(0.5, gamma), starts=12, over={"height": (0.1, 0.14)}, edges=False)
    assert (2, 2) in [(one.multiple, one.impacts) for one in found.found]


def test_a_motion_that_only_the_own_start_leads_to_is_found_with_no_share():
    """A ball that lies on its table at first, and starts above it that all go on to bounce."""
    scene = table(0.8, 0.5)
    found = ts.attractors(scene, starts=3, over={"height": (0.24, 0.28)}, edges=False)
    lying = found[found.own]
    assert len(found) == 2 and lying.impacts == 0 and lying.share.count == 0 == len(lying.members)
    assert found[0].share.count == 3 and (found.label == 0).all() and lying.share.high > 0.0


def test_chaos_is_a_class_of_its_own():
    found = ts.attractors(table(0.9, 3.0), starts=4, edges=False)
    assert len(found) == 0
    assert [one.count for one in found.others.values()] == [4] and "chaos" in next(iter(found.others))
    assert "chaos" in str(found)


def test_a_drive_that_begins_elsewhere_leads_to_the_same_motion():
    """The phase of the drive and what it did before are parts of a start."""
    over = {"phase": ("0 deg", "360 deg"), "robot.drives.pzt.history.0": ("-10 V", "10 V")}
    found = ts.attractors("cantilever", starts=12, over=over, edges=False)
    assert [one.share.count for one in found.found] == [12]
    assert found[0].impacts == ts.periodic("cantilever").impacts


def test_drives_of_a_gait_are_ahead_together():
    """A walker that is put down while it walks: the scene of each gait, whose legs have phases, walks it alone."""
    found = ts.attractors("millipede", starts=12, over={"phase": ("0 deg", "360 deg")}, edges=False)
    travels = [one.travel * 1e6 for one in found]
    assert len(found) > 1 and all(min(abs(one - each) for each in (1.539, 3.293, 4.632)) < 1e-3 for one in travels)
    for one in found:
        late = np.array(list(one.scene.gait.phases.values()))
        assert np.ptp(late) == pytest.approx(0.5) and late.max() < 0.5  # alternating still, and ahead
        assert one.measures["stride"].value == pytest.approx(one.travel, rel=1e-4)


def test_a_mass_between_two_stops():
    """Feet that face each other: no lift is one of both, and none goes through the other stop. Mirrored in x and half a
    period the system is itself, so that motions are symmetric or come in pairs."""
    given = scene("impact_oscillator", {"robot.feet.stop.gap": 0.5})
    other = given.robot.feet["stop"].model_copy(update={"normal": 1})
    feet = {"stop": given.robot.feet["stop"], "other": other}
    both = given.model_copy(update={"robot": given.robot.model_copy(update={"feet": feet})})
    found = ts.attractors(both, starts=8, edges=False)
    assert 0.0 < found.box.ends["height"][1] <= 0.5
    assert found[0].confirmed and found[0].impacts % 2 == 0
    kinds = found[0].run.events
    late = kinds[kinds["time"] > found[0].run.duration - 4.0 * found[0].period]
    assert (late["foot"] == 0).sum() == pytest.approx((late["foot"] == 1).sum(), abs=1)


@pytest.mark.parametrize(
    ("over", "said"),
    [
        ({"height": (1.0, 0.0)}, "height: the range from 1 m to 0 m is empty"),
        ({"ground.restitution.coefficient": (0.1, 0.2)}, "is no part of a start"),
        ({"nothing": (0.0, 1.0)}, "nothing: unknown path"),
    ],
)
def test_axes_that_are_no_part_of_a_start_are_refused(over, said):
    with pytest.raises(ts.InputError, match=said):
        ts.attractors(table(0.8, 0.5), starts=4, over=over)


def test_a_motion_of_twelve_periods_has_multipliers():
    """Each impact contracts areas by e^2: the multipliers' product, whatever the period; it is known as they are, to
    1e-9 of the entries of the return's derivative."""
    values = {
        "ground.restitution.coefficient": 0.759375,
        "signals.table.amplitude": 1.3984375,
        "initial.displacement": (118e-6,),  # found at a point of the orbit where entries are below 50, of others 2000
    }
    (found,) = ts.attractors(ts.with_values(ts.load_scene("ball-on-table"), values), starts=8, edges=False).found
    assert (found.multiple, found.impacts) == (12, 12) and found.orbit is not None
    assert np.prod(found.orbit.multipliers).real == pytest.approx(0.759375**24, abs=1e-9)
