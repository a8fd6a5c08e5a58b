"""What a gait's design may choose, and what is said of everything else."""

from __future__ import annotations

import numpy as np
import pytest

import tarsus as ts
from tarsus.base.errors import InputError
from tarsus.base.spec import with_values
from tarsus.design.free import Symmetry, designed, free_of, significant
from tarsus.files.toml import parse_scene, scene_text
from tarsus.model.scene import Source
from tarsus_reproduce.walkers import hexapod_walker


def changes(free, cube):
    return dict(zip(free.paths, free.values(cube).T, strict=True))


@pytest.fixture(scope="module")
def hexapod() -> ts.Scene:
    return hexapod_walker()


def test_numbers_of_a_gait_range_as_usual_or_as_said(hexapod):
    free = free_of(hexapod, {"gait.duty": None, "gait.frequency": None, "gait.high": ("7 V", 12.0)})
    own = hexapod.gait
    assert own is not None and free.names == ("duty", "frequency", "high") and free.numbers.units == ("1", "Hz", "V")
    assert free.numbers.low.tolist() == [0.1, 0.5 * own.frequency, 7.0]
    assert free.numbers.high.tolist() == [0.9, 2.0 * own.frequency, 12.0]
    values = changes(free, np.array([[0.0, 0.5, 1.0]]))
    assert values["gait.duty"][0] == pytest.approx(0.1) and values["gait.high"][0] == pytest.approx(12.0)


def test_free_phases_write_the_gait_out_leg_by_leg_without_changing_it(hexapod):
    free = free_of(hexapod, ["gait.phases"])
    layout = hexapod.robot.layout()
    assert free.scene.gait is not None and hexapod.gait is not None and layout is not None
    assert free.scene.gait.waveforms(layout) == hexapod.gait.waveforms(layout)
    assert len(free) == 5 and free.circular.all()  # the first leg is at 0
    (first,) = {path for path in free.paths if not free.share[free.tied.index(path)].any()}
    assert first == "gait.phases.L1"


@pytest.mark.parametrize(
    ("symmetry", "point", "phases"),
    [
        (Symmetry.MIRROR, [0.25, 0.5], {"L1": 0.0, "R1": 0.5, "L2": 0.25, "R2": 0.75, "L3": 0.5, "R3": 0.0}),
        (Symmetry.PAIRS, [0.25, 0.5], {"L1": 0.0, "R1": 0.0, "L2": 0.25, "R2": 0.25, "L3": 0.5, "R3": 0.5}),
        # every leg half a period after its neighbour, and the sides half a period apart: a tripod
        (Symmetry.WAVE, [0.5, 0.5], {"L1": 0.0, "R1": 0.5, "L2": 0.5, "R2": 0.0, "L3": 0.0, "R3": 0.5}),
    ],
)
def test_symmetry_ties_phases(hexapod, symmetry, point, phases):
    free = free_of(hexapod, ["gait.phases"], symmetry)
    found = changes(free, np.array([point]))
    assert {path.rpartition(".")[2]: float(own[0]) for path, own in found.items()} == pytest.approx(phases)
    ts.with_values(free.scene, {path: float(own[0]) for path, own in found.items()})  # a gait that the robot takes


def test_all_that_is_wrong_is_said_at_once(hexapod):
    wrong = {
        "gait.dutty": None,
        "initial.displacement.0": (0.0, 1.0),
        "gait.duty": (0.6, 0.4),
        "gait.low": None,
        "gait.frequency": ("1 m", "2 m"),
        "gait.high": ("1 V", "2 V"),
    }
    with pytest.raises(InputError) as told:
        free_of(hexapod, wrong, Symmetry.WAVE)
    said = " | ".join(told.value.problems)
    assert "gait.dutty: the scene has no such number" in said and "did you mean 'gait.duty'" in said
    assert "initial.displacement.0: " in said
    assert "gait.duty: the range from" in said and "gait.low: has no usual range; give one" in said
    assert "gait.frequency: expected a frequency (Hz), got '1 m'" in said
    assert "symmetry: 'wave' ties phases, so gait.phases has to be free" in said
    assert len(told.value.problems) == 6


@pytest.mark.parametrize(
    ("free", "said"),
    [
        (
            {"gait.low": ("0 V", "9 V"), "gait.high": ("8 V", "14 V")},
            "gait.low: reaches 9 V, above the least upper voltage 8 V",
        ),
        (["gait.phases", "gait.phases.L2"], "gait.phases.L2: is free twice"),
    ],
)
def test_what_does_not_go_together_is_said(hexapod, free, said):
    with pytest.raises(InputError, match=said):
        free_of(hexapod, free)


def test_designed_numbers_have_six_digits_and_say_who_set_them(hexapod):
    free = free_of(hexapod, ["gait.frequency", "gait.duty", "gait.phases"])
    assert free_of(hexapod, "gait.frequency, gait.duty,gait.phases").names == free.names
    values = changes(free, np.random.default_rng(1).random((50, len(free))))
    assert max(len(repr(float(one)).strip("0.").replace(".", "")) for own in values.values() for one in own) <= 6
    first = {path: float(own[0]) for path, own in values.items()}
    found = designed(with_values(free.scene, first), free.paths)
    assert {found.origin(path).source for path in free.paths} == {Source.DESIGNED}
    assert "`tarsus design`" in found.origin("gait.frequency").note
    assert found.origin("gait.high").source is not Source.DESIGNED  # the search did not set it
    assert parse_scene(scene_text(found)).origin("gait.duty").source is Source.DESIGNED


def test_significant_digits_are_the_nearest_floats_of_decimals():
    given = np.array([202.8829871234, 0.30000000000000004, 1234567.0, -0.000123456789, 0.0])
    assert significant(given).tolist() == [202.883, 0.3, 1234570.0, -0.000123457, 0.0]
