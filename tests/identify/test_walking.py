"""Ground, legs and single feet of a walker from records of its body, from numbers that are far off."""

from __future__ import annotations

import json
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

import tarsus as ts
from tarsus.base.errors import InputError
from tarsus.base.quantities import Quantity
from tarsus.base.spec import get_value, validate, with_values
from tarsus.files.draws import read_reliance, write_draws
from tarsus.fit.record_problem import RecordProblem, Seen, SeenRecord, Segment
from tarsus.fit.record_ties import TiedWindows
from tarsus.fit.unknowns import Prior
from tarsus.fit.verdict import Verdict
from tarsus.identify import walking
from tarsus.identify.campaign import RecordSet
from tarsus.identify.walk_feet import _scatter, alike, asked_of_feet, odd_feet, with_feet
from tarsus.identify.walk_prediction import missed, prediction_check, reliance_of
from tarsus.identify.walk_step import identify_walking, noise_of, unknowns_of
from tarsus.identify.walk_symmetry import mirrored
from tarsus.identify.walking import WalkRecord, _joined, identify_walk
from tarsus.model.scene import Provenance, Scene, Source
from tarsus.model.structure import Walker
from tarsus.plan.lowering import lower_scene, slot
from tarsus.plan.rows import rows_of
from tarsus.records.purpose import Purpose
from tarsus.solve import WindowStart, output_rows, simulate_windows
from tarsus.solve.outputs import Output

GROUND = {
    "ground.restitution.coefficient": 0.5,
    "ground.friction.coefficient": 0.3,
    "ground.adhesion.initial": 5e-7,
    "ground.film.coefficient": 5e-24,
}
LEGS = [
    f"robot.structure.legs.{leg}.{name}"
    for leg in ("L1", "R1")
    for name in ("stiffness_v", "damping_v", "stiffness_l", "damping_l")
]
BODY = tuple(Output(kind, at) for kind in (Quantity.DISPLACEMENT, Quantity.VELOCITY) for at in ("body_x", "body"))


FRICTION, BOUNCE = "ground.friction.coefficient", "ground.restitution.coefficient"
PATHS = (BOUNCE, FRICTION, "ground.adhesion.initial")
NOISE = np.array([1e-7, 1e-7, 5e-5, 5e-5])


def walked(
    scene: Scene, seconds: float, seed: int = 0, under: dict[str, float] | None = None, noise: np.ndarray = NOISE
) -> tuple[WalkRecord, np.ndarray]:
    """Surge and heave of the body at 20 kHz, displacements to 100 nm and velocities to 50 um/s, on a ground whose
    friction is another by a factor under some feet; states (nt, 2n)."""
    plan, times = lower_scene(scene), np.arange(1, round(20e3 * seconds) + 1) / 20e3
    row, place = rows_of(plan), slot(scene, FRICTION)
    assert place is not None
    parameters = row.parameters.copy()
    for foot, by in (under or {}).items():
        parameters[:, list(scene.robot.feet).index(foot), place.at] *= by
    own = replace(row, parameters=parameters)
    (window,) = simulate_windows(plan, [WindowStart(plan.initial, 0.0, times)], rows=own)
    values = output_rows(scene, list(BODY), times).values(window.states)
    values += noise[:, None] * np.random.default_rng(seed).standard_normal(values.shape)
    return WalkRecord(scene, times, BODY, values, noise), np.vstack([window.states.x, window.states.v]).T


def record(seconds: float) -> tuple[Scene, WalkRecord]:
    """A robot, and how its body moves, taken for that of one on another ground."""
    truth = ts.load_scene("millipede", hz=50, volts=14)
    known = with_values(truth, {path: GROUND[path] for path in PATHS})
    return truth, replace(walked(truth, seconds)[0], scene=known)


# Slow. The body's motion is in no channel.
@pytest.mark.slow
def test_currents_alone_tell_the_ground() -> None:
    rng = np.random.default_rng(0)
    truth = ts.load_scene("millipede", hz=50, volts=14)
    outputs = tuple(Output(Quantity.CURRENT, drive, motional=True) for drive in truth.robot.drives)
    times = np.arange(1, 1001) / 20e3
    values = ts.simulate(truth, 0.05).outputs(list(outputs), times)
    noise = 0.01 * np.sqrt((values**2).mean(axis=1))  # 40 dB
    noisy = values + noise[:, None] * rng.standard_normal(values.shape)
    record = WalkRecord(with_values(truth, GROUND), times, outputs, noisy, noise)
    found = identify_walk([record], dict.fromkeys(GROUND, 1.0))
    assert found.followed == 1.0
    error = np.log(found.values / [float(get_value(truth, path)) for path in GROUND])
    assert np.abs(error / np.sqrt(np.diag(found.covariance))).max() < 3.5
    assert abs(error[3]) < 0.05  # the film; of the first contacts none tells the restitution


def test_noise_is_seen_below_a_motion_with_jumps() -> None:
    rng, times = np.random.default_rng(1), np.arange(4000) / 20e3
    motion = 1e-3 * np.sin(2.0 * np.pi * 100.0 * times) + 2e-3 * (times % 0.01 > 0.004)
    found = noise_of(np.array([motion + 5e-5 * rng.standard_normal(4000)]))
    assert found[0] == pytest.approx(5e-5, rel=0.1)  # one in forty values is beside a jump, and 4000 have a scatter


def test_what_a_device_knows_of_itself_narrows_what_is_sought() -> None:
    scene = ts.load_scene("millipede")
    wide = unknowns_of(scene)
    assert wide["ground.restitution.coefficient"] == 1.0 and wide[LEGS[0]] == 0.1
    known = Provenance(source=Source.CALIBRATED, note="Measured.", interval=((0.30, 0.48),))
    narrow = unknowns_of(with_values(scene, {"provenance": {"ground.restitution.coefficient": known}}))
    assert narrow["ground.restitution.coefficient"] == pytest.approx(np.log(1.6) / (2 * 1.96), rel=1e-4)


@pytest.mark.parametrize("turns", [False, True])
def test_legs_that_no_record_tells_apart_widen_the_intervals(turns: bool) -> None:
    scene = four_legs()
    outputs = tuple(Output(Quantity.ACCELERATION, at) for at in ("body_x", "body"))
    outputs += (Output(Quantity.ANGLE, "roll"),) if turns else ()
    times = np.arange(1, 401) / 20e3
    values = ts.simulate(scene, 0.02).outputs(list(outputs), times)
    noise = 0.01 * np.sqrt((values**2).mean(axis=1))
    legs = {f"robot.structure.legs.{leg}.stiffness_v": 1.2 + 0.1 * k for k, leg in enumerate(("L1", "R1", "L2", "R2"))}
    record = WalkRecord(scene, times, outputs, values, noise)
    walker = scene.robot.structure
    assert isinstance(walker, Walker)
    added = mirrored(walker, [record], {**legs, "ground.friction.coefficient": 0.4})
    # half a turn puts L1 in the place of R2 and R1 in that of L2: 1.2 and 1.5, 1.3 and 1.4 N/m
    off = np.log([1.5 / 1.2, 1.4 / 1.3, 1.3 / 1.4, 1.2 / 1.5, 1.0])
    assert added == pytest.approx(np.zeros((5, 5)) if turns else 0.5 * np.outer(off, off))


def four_legs() -> Scene:
    """The millipede on two pairs of legs that walk in diagonals, turning about both axes."""
    scene = ts.load_scene("millipede", hz=50, volts=14)
    robot = scene.robot.model_dump(exclude_none=True)
    one, places = (robot["structure"]["legs"]["L1"], {"L1": (1, 1), "R1": (1, -1), "L2": (-1, 1), "R2": (-1, -1)})
    robot["structure"]["legs"] = {leg: one | {"x": 1e-3 * x, "y": 1e-3 * y} for leg, (x, y) in places.items()}
    robot["structure"]["body"] |= {"mass": 2e-7, "roll_inertia": 2e-13, "pitch_inertia": 2e-13}
    drive, foot = (json.dumps(robot[what]["L1"]) for what in ("drives", "feet"))
    robot["drives"], robot["feet"] = (
        {leg: json.loads(text.replace("L1", leg)) for leg in places} for text in (drive, foot)
    )
    return validate(Scene, scene.model_dump(exclude_none=True) | {"robot": robot, "provenance": {}})


def test_records_that_are_none_are_refused() -> None:
    scene = ts.load_scene("millipede", hz=50, volts=14)
    times = np.arange(1, 20) / 20e3
    with pytest.raises(InputError, match="expected values of shape"):
        WalkRecord(scene, times, BODY, np.zeros((3, 19)), np.ones(4))
    with pytest.raises(InputError, match="12 samples or more, got 1"):
        WalkRecord(scene, times[:1], BODY, np.zeros((4, 1)), np.ones(4))
    with pytest.raises(InputError, match="structure is of another kind"):
        WalkRecord(ts.load_scene("cantilever"), times, BODY, np.zeros((4, 19)), np.ones(4))
    with pytest.raises(InputError, match="got none"):
        identify_walk([], {"ground.restitution.coefficient": 1.0})


def test_a_set_to_be_compared_is_of_a_walker_where_it_states_a_gait() -> None:
    gait = ts.load_scene("millipede").gait
    sets = [RecordSet(purpose=one, files="a.h5") for one in (Purpose.WALKING, Purpose.VALIDATION, Purpose.MODAL)]
    assert [one.walks for one in sets] == [True, False, False]
    assert RecordSet(purpose=Purpose.VALIDATION, files="a.h5", gait=gait).walks


@pytest.mark.parametrize(("friction", "least", "most"), [(1.0, 0.0, 0.01), (0.8, 0.02, 1.0)])
def test_a_walk_that_was_left_out_says_how_far_a_prediction_is_off(
    friction: float, least: float, most: float, tmp_path: Path
) -> None:
    scene, path = ts.load_scene("millipede", hz=50, volts=14), "ground.friction.coefficient"
    record = walked(scene, 0.065, 2)[0]
    draws = friction * float(get_value(scene, path)) * np.linspace(0.999, 1.001, 5)[:, None]
    check = prediction_check([path], draws, [record])
    assert least <= check.value <= most
    currents = tuple(Output(Quantity.CURRENT, drive) for drive in ("L1", "R1", "L1", "R1"))
    assert missed([path], draws, [replace(record, outputs=currents)]) == 0.0  # which show no way
    reliance = reliance_of([check, replace(check, name="jump", value=3.0, limit=2.5, cause="feet jump")])
    assert reliance.missed == check.value and "feet jump (jump 3, 2.5 at most)" in reliance.doubts
    write_draws(tmp_path / "draws.npz", [path], draws[0], draws, reliance)
    assert read_reliance(tmp_path / "draws.npz") == reliance


@pytest.mark.slow
def test_a_campaign_of_walks_goes_through_the_same_verb(tmp_path: Path) -> None:
    ts.synthesize("millipede", tmp_path, seed=3, perturb=0.1)
    truth = ts.read_scene(tmp_path / "truth" / "device.toml")
    found = ts.identify(tmp_path)
    step = found.steps["walking"]
    assert found.files_used == 8 and not found.not_done
    words = {row[0]: row[4] for row in found.table().json()["rows"]}
    for path in ("ground.restitution.coefficient", "ground.friction.coefficient"):
        assert words[path] == "determined"
        assert step.value(path) == pytest.approx(float(get_value(truth, path)), rel=0.02)
    for path in step.paths:
        if words[path] == "determined":
            off = abs(np.log(step.value(path) / float(get_value(truth, path))))
            assert off < 4.5 * np.std(np.log(step.draws(path))), path
    assert words["ground.adhesion.rate"] == "assumed"  # contacts of a millisecond tell nothing of it


@pytest.mark.slow
@pytest.mark.parametrize(("known", "seed", "holds"), [(True, 3, True), (False, 3, True), (False, 5, False)])
def test_rough_ground_is_known_or_leaves_nothing_wrong_determined(known: bool, seed: int, holds: bool) -> None:
    """Heights of 0.2 um RMS: where the scene says them the numbers hold. Where it says level ground starts jump and
    nothing is determined, but on heights under which the numbers hold all the same."""
    rng = np.random.default_rng(0)
    level = ts.load_scene("millipede", hz=50, volts=14)
    heights = {"kind": "random", "seed": seed, "rms": 2e-7, "correlation_length": 3e-4, "hurst": 0.8, "spacing": 4e-5}
    rough = with_values(level, {"ground.profile": heights})
    truth = with_values(rough, {p: float(get_value(rough, p) * np.exp(0.1 * rng.standard_normal())) for p in LEGS})
    record = replace(walked(truth, 0.1)[0], scene=with_values(rough if known else level, GROUND))
    found = identify_walk([record], dict.fromkeys(GROUND, 1.0) | dict.fromkeys(LEGS, 0.1))
    true = np.array([float(get_value(truth, path)) for path in found.paths])
    sigma = np.abs(np.log(found.values / true)) / np.sqrt(np.diag(found.covariance))
    sure = [found.verdict(path) is Verdict.DETERMINED for path in found.paths]
    if holds:
        assert found.jump < 2.0 and sigma.max() < 3.5 and sum(sure) > 8
    else:
        assert found.jump > 2.5 and not any(sure)


def test_the_first_contacts_tell_the_ground() -> None:
    truth, seen = record(0.03)
    found = identify_walk([seen], dict.fromkeys(PATHS, 1.0))
    assert found.followed == 1.0 and found.settled
    assert len(found.edges[0]) > 2 and found.edges[0][0] == 0.0 and found.edges[0][-1] == seen.times[-1]
    events = np.unique(ts.simulate(truth, 0.03).events["time"])
    inner = found.edges[0][1:-1]
    assert np.abs(inner[:, None] - events).min() > 1e-4  # no window begins near an event
    error = np.log(found.values / [float(get_value(truth, path)) for path in PATHS])
    assert np.abs(error / np.sqrt(np.diag(found.covariance))).max() < 3.5
    assert np.sqrt(found.covariance[1, 1]) < 0.1  # told by the first steps


@pytest.mark.parametrize("confirmed", [False, True])
def test_feet_are_told_apart_only_where_another_start_asks_for_it_too(
    monkeypatch: pytest.MonkeyPatch, confirmed: bool
) -> None:
    """A wrong minimum asks for feet that differ; so the record is taken up again, from numbers that are drawn."""
    _, seen = record(0.008)
    friction, drawn, taken_up = PATHS[1], list[int](), walking._taken_up

    def asked(windows, fit, paths):
        return dict.fromkeys(paths, 2.0) if confirmed or not drawn else {}

    def again(problem, records, moved, seed=0):
        drawn.extend([seed] if seed else [])
        return taken_up(problem, records, moved, seed)

    monkeypatch.setattr(walking, "asked_of_feet", asked)
    monkeypatch.setattr(walking, "_taken_up", again)
    found = identify_walk([seen], dict.fromkeys(PATHS, 1.0), differing=[friction])
    assert drawn == [1] and dict(found.asked) == ({friction: 2.0} if confirmed else {})
    assert set(found.feet) == ({f"{foot}: {friction}" for foot in ("L1", "R1")} if confirmed else set())


def test_a_window_with_one_sample_far_off_is_not_followed() -> None:
    """By eight of its noise, which its mean square hardly shows: an impact at another moment leaves no more."""
    _, seen = record(0.012)
    seen.values[3, 120] += 8.0 * seen.noise[3]
    found = identify_walk([seen], dict.fromkeys(PATHS, 1.0))
    assert np.nanmean(found.residuals[0] ** 2) < 1.2 and not found.good.all()
    assert {found.verdict(path) for path in PATHS} <= {Verdict.PREFERRED, Verdict.UNDECIDED, Verdict.ASSUMED}


def test_of_two_starts_that_are_followed_the_one_that_leaves_less_is_taken(monkeypatch: pytest.MonkeyPatch) -> None:
    _, seen = record(0.008)
    costs, together = list[float](), walking._together

    def worse(windows, segments, moved):  # the first
        joint = together(windows, segments, moved)
        costs.append(joint.fit.cost)
        return joint if costs[1:] else joint._replace(fit=replace(joint.fit, cost=joint.fit.cost + 100.0, values={}))

    monkeypatch.setattr(walking, "_together", worse)
    monkeypatch.setattr(walking, "asked_of_feet", lambda *_: {} if costs[1:] else {PATHS[1]: 2.0})
    found = identify_walk([seen], dict.fromkeys(PATHS, 1.0), differing=[PATHS[1]])
    assert len(costs) == 2 and len(found.values) == 3  # of the first there is none


@pytest.mark.slow
def test_of_a_record_that_no_ground_explains_no_number_is_determined() -> None:
    _, seen = record(0.05)
    values = seen.values.copy()
    values[:, 500:] = values[:, 499::-1]  # backwards in time from 25 ms on
    found = identify_walk([replace(seen, values=values)], dict.fromkeys(PATHS, 1.0))
    assert found.edges[0][-1] < 0.03 and found.followed < 0.7
    assert not any(found.verdict(path) is Verdict.DETERMINED for path in PATHS)


@pytest.mark.full
def test_numbers_that_no_robot_takes_are_lost_and_others_are_tried(monkeypatch: pytest.MonkeyPatch) -> None:
    _, seen = record(0.008)
    refused, solve = [], TiedWindows.solve

    def some(self, segments, moved, **options):
        if len(refused) < 7:  # all that a beginning is tried from, and some that go on from others
            refused.append(moved)
            raise InputError("ground.restitution.coefficient: expected a pure number from 0 to 1")
        return solve(self, segments, moved, **options)

    monkeypatch.setattr(TiedWindows, "solve", some)
    found = identify_walk([seen], dict.fromkeys(PATHS, 1.0))
    assert len(refused) == 7 and not np.array_equal(refused[0], refused[-1])
    assert found.followed == 1.0


@pytest.mark.parametrize(("under", "asked"), [({}, []), ({"R1": 0.8}, [FRICTION])])
def test_records_ask_for_feet_that_differ_and_for_nothing_else(under: dict[str, float], asked: list[str]) -> None:
    scene = ts.load_scene("millipede", hz=50, volts=14)
    record, states = walked(scene, 0.028, 5, under, 0.1 * NOISE)  # two landings at 100 nm leave friction 10 % open
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
        wider = {name: Prior(1.0, factor=(one.factor or 1.0) ** 2) for name, one in own.problem.priors.items()}
        assert alike(own.problem, own.problem) and not alike(own.problem, replace(own.problem, priors=wider))


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
    assert odd_feet(FRICTION, feet | {f"B: {FRICTION}": (0.49, 0.01)}) == ["B"]


@pytest.mark.slow
def test_lower_friction_under_one_foot_is_named_with_both_frictions() -> None:
    truth = ts.load_scene("millipede", hz=50, volts=14)
    far = {FRICTION: 0.3, BOUNCE: 0.5, "ground.adhesion.initial": 5e-7, "ground.film.coefficient": 5e-24}
    record, _ = walked(truth, 0.06, 5, {"R1": 0.8})
    step = identify_walking(with_values(truth, far), [replace(record, scene=with_values(truth, far))], 1)
    said = [one.cause for one in step.checks if not one.passed]
    assert len(said) == 1 and said[0].startswith("the ground differs under foot L1 and foot R1: " + FRICTION)
    true = float(get_value(truth, FRICTION))
    for foot, by in (("L1", 1.0), ("R1", 0.8)):
        value, drawn, _ = step.combinations[f"{foot}: {FRICTION}"]
        assert abs(value - by * true) < 3.5 * np.std(drawn) and np.std(drawn) < 0.05 * true


def test_a_window_that_is_not_followed_is_joined_to_the_one_before_it_in_its_record() -> None:
    edges = [(0, 0.0, 0.1), (0, 0.1, 0.2), (0, 0.2, 0.3), (1, 0.0, 0.1), (1, 0.1, 0.2)]
    windows = [Segment(number, a, (a, b), np.zeros(2), np.ones(2)) for number, a, b in edges]
    joined = _joined(windows, np.array([True, False, False, False, True]))
    assert [(one.record, one.begin, one.span) for one in joined] == [
        (0, 0.0, (0.0, 0.3)),
        (1, 0.0, (0.0, 0.1)),
        (1, 0.1, (0.1, 0.2)),
    ]
