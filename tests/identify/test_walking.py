"""Ground and legs of a walker from records of its body, from numbers that are far off."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import tarsus as ts
from tarsus.base.errors import InputError
from tarsus.base.quantities import Quantity
from tarsus.base.spec import get_value, validate, with_values
from tarsus.files.draws import read_reliance, write_draws
from tarsus.fit.record_problem import Segment
from tarsus.fit.verdict import Verdict
from tarsus.identify.campaign import RecordSet
from tarsus.identify.walk_prediction import missed, prediction_check, reliance_of
from tarsus.identify.walk_step import noise_of, unknowns_of
from tarsus.identify.walk_symmetry import untold
from tarsus.identify.walking import WalkRecord, _joined, identify_walk
from tarsus.model.scene import Provenance, Scene, Source
from tarsus.model.structure import Walker
from tarsus.records.purpose import Purpose
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


def body_record(scene: Scene, seconds: float, rng: np.random.Generator) -> WalkRecord:
    """Surge and heave of the body at 20 kHz: displacements to 100 nm, velocities to 50 um/s."""
    times = np.arange(1, round(20e3 * seconds) + 1) / 20e3
    values = ts.simulate(scene, seconds).outputs(list(BODY), times)
    noise = np.array([1e-7, 1e-7, 5e-5, 5e-5])
    noisy = values + noise[:, None] * rng.standard_normal(values.shape)
    return WalkRecord(scene, times, BODY, noisy, noise)


@pytest.mark.slow
def test_the_ground_is_found_while_the_robot_walks() -> None:
    rng = np.random.default_rng(0)
    nominal = ts.load_scene("millipede", hz=50, volts=14)
    truth = with_values(nominal, {p: float(get_value(nominal, p) * np.exp(0.1 * rng.standard_normal())) for p in LEGS})
    spread = dict.fromkeys(GROUND, 1.0) | dict.fromkeys(LEGS, 0.1)
    record = replace(body_record(truth, 0.1, rng), scene=with_values(nominal, GROUND))
    found = identify_walk([record], spread)
    assert found.followed == 1.0 and found.settled  # every window to its noise
    true = np.array([float(get_value(truth, path)) for path in found.paths])
    sigma = np.log(found.values / true) / np.sqrt(np.diag(found.covariance))
    assert np.abs(sigma).max() < 3.5 and np.sqrt(np.mean(sigma**2)) < 1.6
    off = np.abs(found.values / true - 1.0)
    assert off[0] < 0.02 and off[1] < 0.03 and off[2] < 0.2
    assert found.verdict("ground.restitution.coefficient") is Verdict.DETERMINED


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
    added = untold(walker, [record], {**legs, "ground.friction.coefficient": 0.4})
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
    record = body_record(scene, 0.065, np.random.default_rng(2))
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
@pytest.mark.parametrize("known", [True, False])
def test_rough_ground_is_known_or_leaves_nothing_determined(known: bool) -> None:
    """Heights of 0.2 um RMS: where the scene says them the numbers hold, where it says level ground starts jump."""
    rng = np.random.default_rng(0)
    level = ts.load_scene("millipede", hz=50, volts=14)
    rough = with_values(
        level,
        {
            "ground.profile": {
                "kind": "random",
                "seed": 3,
                "rms": 2e-7,
                "correlation_length": 3e-4,
                "hurst": 0.8,
                "spacing": 4e-5,
            }
        },
    )
    truth = with_values(rough, {p: float(get_value(rough, p) * np.exp(0.1 * rng.standard_normal())) for p in LEGS})
    record = replace(body_record(truth, 0.1, rng), scene=with_values(rough if known else level, GROUND))
    found = identify_walk([record], dict.fromkeys(GROUND, 1.0) | dict.fromkeys(LEGS, 0.1))
    true = np.array([float(get_value(truth, path)) for path in found.paths])
    sigma = np.abs(np.log(found.values / true)) / np.sqrt(np.diag(found.covariance))
    sure = [found.verdict(path) is Verdict.DETERMINED for path in found.paths]
    if known:
        assert found.jump < 2.0 and sigma.max() < 3.5 and sum(sure) > 8
    else:
        assert found.jump > 2.5 and not any(sure)


def test_a_window_that_is_not_followed_is_joined_to_the_one_before_it_in_its_record() -> None:
    edges = [(0, 0.0, 0.1), (0, 0.1, 0.2), (0, 0.2, 0.3), (1, 0.0, 0.1), (1, 0.1, 0.2)]
    windows = [Segment(number, a, (a, b), np.zeros(2), np.ones(2)) for number, a, b in edges]
    joined = _joined(windows, np.array([True, False, False, False, True]))
    assert [(one.record, one.begin, one.span) for one in joined] == [
        (0, 0.0, (0.0, 0.3)),
        (1, 0.0, (0.0, 0.1)),
        (1, 0.1, (0.1, 0.2)),
    ]
