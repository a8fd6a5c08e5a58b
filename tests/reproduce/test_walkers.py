"""Walkers built from the millipede's parameters: the source's matrices, provenance of every number, their files."""

from __future__ import annotations

from importlib.resources import files

import numpy as np
import pytest

import tarsus as ts
from tarsus.base.errors import InputError
from tarsus.base.spec import float_paths
from tarsus.files.toml import parse_scene, scene_text
from tarsus.model.scene import Source, provenance_problems
from tarsus_reproduce.legs import millipede_leg
from tarsus_reproduce.millipede_parameters import millipede_parameters
from tarsus_reproduce.walkers import hexapod_walker, many_legs, millipede, packaged_walkers


@pytest.fixture(scope="module")
def parameters():
    return millipede_parameters(millipede_leg().leg)


def test_the_three_masses_of_the_source(parameters):
    scene = millipede(parameters)
    walker = scene.robot.structure
    upward = [walker.row(point).argmax() for point in ("body", "L1", "R1")]
    along = [walker.row(point).argmax() for point in ("body_x", "L1_x", "R1_x")]
    pattern = np.array([[2.0, -1.0, -1.0], [-1.0, 1.0, 0.0], [-1.0, 0.0, 1.0]])
    matrices = walker.matrices()
    assert walker.size == 6
    for index, stiffness, damping in (
        (upward, parameters.stiffness_v, parameters.damping_v),
        (along, parameters.stiffness_l, parameters.damping_l),
    ):
        np.testing.assert_allclose(
            matrices.stiffness[np.ix_(index, index)], stiffness.value * pattern, rtol=1e-5
        )
        np.testing.assert_allclose(matrices.damping[np.ix_(index, index)], damping.value * pattern, rtol=1e-5)
        masses = [parameters.body_mass.value, parameters.leg_mass.value, parameters.leg_mass.value]
        np.testing.assert_allclose(np.diag(matrices.mass)[index], masses, rtol=1e-5)


def test_one_voltage_drives_up_and_along_and_no_force_is_left_over(parameters):
    scene = millipede(parameters)
    drive = scene.robot.drives["L1"]
    load = drive.load.vector(scene.robot.structure) * drive.law.gain
    up, way = parameters.gain_v.value, parameters.gain_l.value
    np.testing.assert_allclose(load, [way, up, -way, -up, 0.0, 0.0], rtol=2e-5)
    assert load[::2].sum() == load[1::2].sum() == 0.0
    on = {name: wave.volts(np.array([5e-3, 15e-3])).tolist() for name, wave in scene.waveforms.items()}
    assert on == {"L1": [14.0, 0.0], "R1": [0.0, 14.0]}


def test_a_body_of_many_pairs_has_the_share_of_each(parameters):
    assert millipede(parameters, legs=8).robot.structure.body.mass == pytest.approx(
        4 * parameters.body_mass.value
    )
    scene = many_legs(parameters)
    walker = scene.robot.structure
    assert walker.size == 4 + 60
    assert walker.body.mass == pytest.approx(3e-6)
    assert walker.body.pitch_inertia == pytest.approx(3e-6 * 10e-3**2 / 12)
    assert walker.body.roll_inertia == pytest.approx(3e-6 * 2e-3**2 / 12)
    hips = np.array([(leg.x, leg.y) for leg in walker.legs.values()])
    np.testing.assert_allclose(hips.mean(axis=0), 0.0, atol=1e-12)
    assert np.ptp(hips[:, 0]) == pytest.approx(10e-3 * 14 / 15) and np.ptp(hips[:, 1]) == 2e-3
    assert scene.interval("robot.structure.body.mass") == pytest.approx((15 * 0.05e-6, 15 * 0.5e-6))


def test_scatter_is_seeded_lognormal_and_of_the_stiffness_only(parameters):
    one, same, other = (many_legs(parameters, scatter=0.3, seed=seed) for seed in (4, 4, 5))
    assert one == same != other
    legs = one.robot.structure.legs.values()
    for name in ("stiffness_v", "stiffness_l"):
        spread = np.log([getattr(leg, name) / getattr(parameters, name).value for leg in legs])
        assert abs(spread.mean()) < 4 * 0.3 / np.sqrt(30) and 0.2 < spread.std(ddof=1) < 0.4
    assert len({(leg.mass, leg.damping_v, leg.damping_l) for leg in legs}) == 1
    assert one.origin("robot.structure.legs.R7.stiffness_v").source is Source.ASSUMED
    assert many_legs(parameters).origin("robot.structure.legs.R7.stiffness_v").source is Source.DERIVED


def test_dead_legs_stand_without_a_drive(parameters):
    whole, hurt = many_legs(parameters), many_legs(parameters, dead=("L4", "R9", "R13"))
    assert set(whole.robot.drives) - set(hurt.robot.drives) == {"L4", "R9", "R13"}
    assert hurt.robot.structure == whole.robot.structure and len(hurt.robot.feet) == 30
    assert hurt.waveforms == {
        name: wave for name, wave in whole.waveforms.items() if name in hurt.robot.drives
    }


def test_six_legs_walk_in_tripods(parameters):
    scene = hexapod_walker(parameters)
    times = (np.arange(40) + 0.5) / 40 / scene.gait.frequency
    high = np.array([wave.volts(times) > 7.0 for wave in scene.waveforms.values()])
    assert np.all(high.sum(axis=0) == 3)
    assert [leg for leg, on in zip(scene.waveforms, high[:, 0], strict=True) if on] == ["L1", "R2", "L3"]


@pytest.mark.parametrize("build", [millipede, hexapod_walker, many_legs], ids=lambda one: one.__name__)
def test_every_number_says_where_it_comes_from_and_files_keep_it(build, parameters):
    scene = build(parameters)
    assert [path for path in float_paths(scene) if scene.origin(path) is None] == []
    assert provenance_problems(scene) == []
    assert all(origin.note.endswith(".") for origin in scene.provenance.values())
    assert parse_scene(scene_text(scene)) == scene


def test_packaged_files_are_what_the_builders_make():
    for name, scene in packaged_walkers().items():
        assert ts.load_scene(name) == scene
        text = files("tarsus_reproduce").joinpath("devices", f"{name}.toml").read_text(encoding="utf-8")
        assert text == scene_text(scene), (
            f"write it anew: tarsus.write_scene(packaged_walkers()['{name}'], FILE)"
        )


def test_gaits_are_addressed_by_paths():
    scene = ts.load_scene("millipede", **{"gait.duty": 0.3}, hz="20 Hz", volts=10)
    assert (scene.gait.duty, scene.gait.frequency, scene.gait.high) == (0.3, 20.0, 10.0)
    assert scene.origin("gait.high").note == "Set by the user; was 14 V (printed)."
    assert scene.waveforms["L1"].volts(np.array([14e-3, 16e-3])).tolist() == [10.0, 0.0]
    still = ts.load_scene("millipede", **{"signals.R1": {"kind": "constant", "level": "3 V"}})
    assert still.waveforms["R1"].volts(np.zeros(1)).tolist() == [3.0]
    assert still.waveforms["L1"] == ts.load_scene("millipede").waveforms["L1"]
    with pytest.raises(InputError, match="made of square waves"):
        ts.load_scene("millipede", wave="sine")


def test_refused(parameters):
    for legs in (0, 3, -2):
        with pytest.raises(
            InputError, match=rf"^legs: expected an even number of legs, 2 or more, got {legs}$"
        ):
            millipede(parameters, legs=legs)
    with pytest.raises(InputError) as caught:
        many_legs(parameters, dead=("L16", "L2"), scatter=-0.1)
    assert caught.value.problems == [
        "dead: there is no leg 'L16'; did you mean 'L6'?",
        "scatter: expected a spread of 0 or more, got -0.1",
    ]
