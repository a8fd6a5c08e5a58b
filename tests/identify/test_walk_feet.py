"""Ground that differs from foot to foot: asked for by records, named by foot, and no more of what is alike."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

import tarsus as ts
from tarsus.base.quantities import Quantity
from tarsus.base.spec import get_value, with_values
from tarsus.fit.record_problem import RecordProblem, Seen, SeenRecord, Segment
from tarsus.fit.record_ties import TiedWindows
from tarsus.fit.unknowns import Prior
from tarsus.identify.walk_feet import _scatter, asked_of_feet, odd_feet, with_feet
from tarsus.identify.walk_step import identify_walking
from tarsus.identify.walking import WalkRecord
from tarsus.plan.lowering import lower_scene, slot
from tarsus.plan.rows import rows_of
from tarsus.solve import Output, WindowStart, output_rows, simulate_windows

FRICTION, BOUNCE = "ground.friction.coefficient", "ground.restitution.coefficient"
BODY = tuple(Output(kind, at) for kind in (Quantity.DISPLACEMENT, Quantity.VELOCITY) for at in ("body_x", "body"))
NOISE = np.array([1e-7, 1e-7, 5e-5, 5e-5])


def walked(
    scene: ts.Scene, seconds: float, under: dict[str, float], noise: np.ndarray
) -> tuple[WalkRecord, np.ndarray]:
    """How the body moves on a ground whose friction is another by a factor under some feet; states (nt, 2n)."""
    plan, times = lower_scene(scene), np.arange(1, round(20e3 * seconds) + 1) / 20e3
    row, place = rows_of(plan), slot(scene, FRICTION)
    assert place is not None
    parameters = row.parameters.copy()
    for foot, by in under.items():
        parameters[:, list(scene.robot.feet).index(foot), place.at] *= by
    own = replace(row, parameters=parameters)
    (window,) = simulate_windows(plan, [WindowStart(plan.initial, 0.0, times)], rows=own)
    values = output_rows(scene, list(BODY), times).values(window.states)
    values += noise[:, None] * np.random.default_rng(5).standard_normal(values.shape)
    return WalkRecord(scene, times, BODY, values, noise), np.vstack([window.states.x, window.states.v]).T


@pytest.mark.parametrize(("under", "asked"), [({}, []), ({"R1": 0.8}, [FRICTION])])
def test_records_ask_for_feet_that_differ_and_for_nothing_else(under: dict[str, float], asked: list[str]) -> None:
    scene = ts.load_scene("millipede", hz=50, volts=14)
    record, states = walked(scene, 0.028, under, noise=0.1 * NOISE)  # two landings at 100 nm leave friction 10 % open
    channels = tuple(Seen(one, noise) for one, noise in zip(BODY, record.noise.tolist(), strict=True))
    priors = {path: Prior(float(get_value(scene, path)), factor=1.2) for path in (FRICTION, BOUNCE)}
    problem = RecordProblem((scene,), (SeenRecord(channels, record.times, record.values),), priors)
    segments = [  # a landing of the one foot, and one of the other
        Segment(0, record.times[a], (record.times[a], record.times[b]), states[a], np.repeat([1e-6, 1e-3], 6))
        for a, b in pairwise((119, 353, 559))
    ]
    tied = TiedWindows(problem, np.repeat([3e-9, 3e-6], 6))
    fit = tied.solve(segments, np.zeros(2), exact=True)
    gains = asked_of_feet(tied, fit, [FRICTION, BOUNCE])
    assert sorted(gains, key=lambda path: -gains[path])[:1] == asked
    if asked:  # what seemed to differ beside it is alike once friction may
        own = TiedWindows(with_feet(problem, asked), tied.ties)
        found = own.solve(fit.segments, np.append(fit.moved, [0.0, 0.0]), exact=True)
        ratio = found.values[f"under R1: {FRICTION}"] / found.values[f"under L1: {FRICTION}"]
        assert ratio == pytest.approx(0.8, abs=0.04) and not asked_of_feet(own, found, [BOUNCE])


@pytest.mark.parametrize(("odd", "most"), [(0.0, 1.0), (40.0, 30.0)])
def test_a_window_that_pulls_another_way_than_all_others_raises_the_limit(odd: float, most: float) -> None:
    information = np.tile(np.eye(2), (8, 1, 1))
    score = np.tile([3.0, -3.0], (8, 1)) + odd * np.outer(np.arange(8) == 3, [1.0, -1.0])
    inverse = np.linalg.inv(information.sum(axis=0))
    assert _scatter(information, score, inverse, inverse @ score.sum(axis=0)) >= most
    assert _scatter(information[:2], score[:2], 4.0 * inverse, 4.0 * inverse @ score[:2].sum(axis=0)) == 1.0


def test_the_odd_foot_is_the_one_off_all_others_and_of_two_it_is_both() -> None:
    feet = {f"{foot}: {FRICTION}": (value, 0.01) for foot, value in (("A", 0.40), ("B", 0.33), ("C", 0.41))}
    assert odd_feet(FRICTION, feet) == ["B"]
    assert odd_feet(FRICTION, {name: feet[name] for name in list(feet)[:2]}) == ["A", "B"]


@pytest.mark.slow
def test_lower_friction_under_one_foot_is_named_with_both_frictions() -> None:
    truth = ts.load_scene("millipede", hz=50, volts=14)
    far = {FRICTION: 0.3, BOUNCE: 0.5, "ground.adhesion.initial": 5e-7, "ground.film.coefficient": 5e-24}
    record, _ = walked(truth, 0.06, {"R1": 0.8}, NOISE)
    step = identify_walking(with_values(truth, far), [replace(record, scene=with_values(truth, far))], 1)
    said = [one.cause for one in step.checks if not one.passed]
    assert len(said) == 1 and said[0].startswith("the ground differs under foot L1 and foot R1: " + FRICTION)
    true = float(get_value(truth, FRICTION))
    for foot, by in (("L1", 1.0), ("R1", 0.8)):
        value, drawn, _ = step.combinations[f"{foot}: {FRICTION}"]
        assert abs(value - by * true) < 3.5 * np.std(drawn) and np.std(drawn) < 0.05 * true
