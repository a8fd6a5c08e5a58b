"""The millipedes as files: what is derived follows from Table 4.1's leg as its note says, and robots of many legs."""

from __future__ import annotations

import numpy as np
import pytest

import tarsus as ts
from tarsus.base.errors import InputError
from tarsus.base.spec import float_paths
from tarsus.files.toml import parse_scene, scene_text
from tarsus.model.scene import Source, provenance_problems
from tarsus.model.structure.leg import SingleMode
from tarsus_reproduce.legs import millipede_leg
from tarsus_reproduce.walkers import hexapod_walker, many_legs

WALKERS = ("millipede", "millipede-table", "millipede-printed", "millipede-30", "hexapod-walker")


@pytest.fixture(scope="module")
def leg():
    return millipede_leg().leg


def first_leg(scene):
    """Numbers of the leg L1 with its drive's: gain upward and along the way [N/V]."""
    own, drive = scene.robot.structure.legs["L1"], scene.robot.drives["L1"]
    return own, drive.law.gain, drive.law.gain * drive.load.weights["L1_hip_x"]


@pytest.mark.parametrize("scene", [many_legs(2), ts.load_scene("millipede-table")], ids=["pair", "table"])
def test_numbers_of_table_4_1_follow_from_its_leg(leg, scene):
    mode = SingleMode.of(leg)
    arm = abs(leg.thigh.length * np.cos(leg.thigh.angle) + leg.shin.length * np.cos(leg.shin.angle))
    own, up, along = first_leg(scene)
    assert own.stiffness_v == pytest.approx(mode.stiffness, rel=1e-5)
    assert own.damping_v == pytest.approx(mode.damping, rel=1e-5)
    assert up == pytest.approx(mode.gain, rel=1e-5)
    assert own.stiffness_l == pytest.approx(leg.hip_joint.stiffness / arm**2, rel=1e-5)
    ratio = leg.knee_joint.damping / leg.knee_joint.stiffness
    assert own.damping_l == pytest.approx(own.stiffness_l * ratio, rel=1e-5)
    assert along == pytest.approx(leg.torque_gain / arm, rel=1e-5)
    assert scene.gait.high == leg.rated_volts


def test_two_links_turning_as_one_weigh_at_the_foot_as_they_do_in_the_file(leg):
    inertia = leg.thigh.mass / 3.0 + leg.shin.mass * (1.0 + 1.0 / 3.0)  # of equal links at a right angle, per length^2
    assert first_leg(many_legs(2))[0].mass == pytest.approx(inertia, rel=1e-5)


@pytest.mark.parametrize(
    ("name", "ratio_v", "ratio_l", "force_along"),
    [("millipede", 0.0238, 0.183, 0.373), ("millipede-printed", 0.071, 0.136, 0.945)],
)
def test_chosen_damping_is_the_ratio_that_its_note_says(name, ratio_v, ratio_l, force_along):
    scene = ts.load_scene(name)
    own, up, along = first_leg(scene)
    share = scene.robot.structure.body.mass  # two legs carry it
    for way, ratio in (("v", ratio_v), ("l", ratio_l)):
        damping = 2.0 * ratio * (getattr(own, f"stiffness_{way}") * share) ** 0.5
        assert getattr(own, f"damping_{way}") == pytest.approx(damping, rel=1e-5)
        assert f"{ratio:g}" in scene.provenance[f"robot.structure.legs.*.damping_{way}"].note
    assert along == pytest.approx(force_along * up, rel=1e-5)


def test_the_printed_millipede_has_table_4_1_at_an_arm_of_500_um(leg):
    own, up, _ = first_leg(ts.load_scene("millipede-printed"))
    assert own.stiffness_v == pytest.approx(leg.hip_joint.stiffness / 500e-6**2, rel=1e-5)
    assert up == pytest.approx(leg.torque_gain / 500e-6, rel=1e-5)
    # Critical masses: 0.69 mg as read; 0.18 mg if the hip joint sat at the body, 0.5 mm from the foot.
    assert SingleMode.of(leg).critical_mass == pytest.approx(0.69e-6, abs=0.005e-6)
    at_body = ts.with_values(leg, {"hip.length": 500e-6})
    assert SingleMode.of(at_body).critical_mass == pytest.approx(0.178e-6, abs=0.002e-6)


def test_the_three_masses_of_the_source():
    """(4.4)-(4.6): body, spring and damper to each leg, upward and along the way."""
    scene = ts.load_scene("millipede-table")
    walker, (leg, up, way) = scene.robot.structure, first_leg(scene)
    upward = [walker.row(point).argmax() for point in ("body", "L1", "R1")]
    along = [walker.row(point).argmax() for point in ("body_x", "L1_x", "R1_x")]
    pattern = np.array([[2.0, -1.0, -1.0], [-1.0, 1.0, 0.0], [-1.0, 0.0, 1.0]])
    matrices = walker.matrices()
    assert walker.size == 6
    for index, end in ((upward, "v"), (along, "l")):
        at = np.ix_(index, index)
        np.testing.assert_allclose(matrices.stiffness[at], getattr(leg, f"stiffness_{end}") * pattern)
        np.testing.assert_allclose(matrices.damping[at], getattr(leg, f"damping_{end}") * pattern)
        np.testing.assert_allclose(np.diag(matrices.mass)[index], [walker.body.mass, leg.mass, leg.mass])
    drive = scene.robot.drives["L1"]
    load = drive.load.vector(walker) * drive.law.gain
    np.testing.assert_allclose(load, [way, up, -way, -up, 0.0, 0.0])
    assert load[::2].sum() == load[1::2].sum() == 0.0, "no force is left over"


def test_a_body_of_many_pairs_has_the_share_of_each():
    scene = many_legs()
    walker = scene.robot.structure
    assert walker.size == 4 + 60
    assert walker.body.mass == pytest.approx(15 * 0.2e-6)
    assert walker.body.pitch_inertia == pytest.approx(3e-6 * 10e-3**2 / 12)
    assert walker.body.roll_inertia == pytest.approx(3e-6 * 2e-3**2 / 12)
    hips = np.array([(leg.x, leg.y) for leg in walker.legs.values()])
    np.testing.assert_allclose(hips.mean(axis=0), 0.0, atol=1e-12)
    assert np.ptp(hips[:, 0]) == pytest.approx(10e-3 * 14 / 15) and np.ptp(hips[:, 1]) == 2e-3
    assert scene.interval("robot.structure.body.mass") == pytest.approx((15 * 0.05e-6, 15 * 0.5e-6))


def test_scatter_is_seeded_lognormal_and_of_the_stiffness_only():
    one, same, other = (many_legs(scatter=0.3, seed=seed) for seed in (4, 4, 5))
    assert one == same != other
    legs, nominal = one.robot.structure.legs.values(), first_leg(many_legs(2))[0]
    for name in ("stiffness_v", "stiffness_l"):
        spread = np.log([getattr(leg, name) / getattr(nominal, name) for leg in legs])
        assert abs(spread.mean()) < 4 * 0.3 / np.sqrt(30) and 0.2 < spread.std(ddof=1) < 0.4
    assert len({(leg.mass, leg.damping_v, leg.damping_l) for leg in legs}) == 1
    assert one.origin("robot.structure.legs.R7.stiffness_v").source is Source.ASSUMED
    assert many_legs().origin("robot.structure.legs.R7.stiffness_v").source is Source.DERIVED
    assert ts.load_scene("millipede-30") == many_legs(scatter=0.1, seed=1)


def test_dead_legs_stand_without_a_drive_and_six_walk_in_tripods():
    whole, hurt = many_legs(), many_legs(dead=("L4", "R9", "R13"))
    assert set(whole.robot.drives) - set(hurt.robot.drives) == {"L4", "R9", "R13"}
    assert hurt.robot.structure == whole.robot.structure and len(hurt.robot.feet) == 30
    scene = hexapod_walker()
    assert ts.load_scene("hexapod-walker") == scene
    times = (np.arange(40) + 0.5) / 40 / scene.gait.frequency
    high = np.array([wave.volts(times) > 7.0 for wave in scene.waveforms.values()])
    assert np.all(high.sum(axis=0) == 3)
    assert [leg for leg, on in zip(scene.waveforms, high[:, 0], strict=True) if on] == ["L1", "R2", "L3"]


@pytest.mark.parametrize(
    "scene", [*map(ts.load_scene, WALKERS), hexapod_walker(), many_legs(4)], ids=lambda one: one.name
)
def test_every_number_says_where_it_comes_from_and_files_keep_it(scene):
    assert [path for path in float_paths(scene) if scene.origin(path) is None] == []
    assert provenance_problems(scene) == []
    assert all(origin.note.endswith(".") for origin in scene.provenance.values())
    assert parse_scene(scene_text(scene)) == scene


def test_bad_numbers_of_legs_and_spreads_are_refused():
    for legs in (0, 3, -2):
        with pytest.raises(InputError, match=f"got {legs}"):
            many_legs(legs)
    with pytest.raises(InputError, match=r"got -0\.1"):
        many_legs(scatter=-0.1)
    with pytest.raises(InputError, match="L16"):
        many_legs(dead=("L16", "L2"))
