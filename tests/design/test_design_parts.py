"""Parts of the design of signals: grounds, energies, plateaus; each against a closed form."""

from __future__ import annotations

import tomllib

import numpy as np
import pytest

import tarsus as ts
from tarsus.base.errors import InputError
from tarsus.design.energy import period_rises
from tarsus.design.grounds import Grounds, corners, over_of, spread
from tarsus.design.judge import MEAN, WORST, Judge
from tarsus.design.pulses import Levels, Step, families
from tarsus.design.request import settings_text
from tarsus.fit.unknowns import Unknowns
from tarsus.measure.switching import rise_squares

GAP = "robot.feet.tip.gap"
TWO = Step(0.02, 8.0, -8.0, 0.01, 1e-5, 1.6e-3, Levels((-8.0, 8.0)))
FREE = Step(0.02, 8.0, -8.0, 0.01, 1e-5, 1.6e-3, Levels((-8.0, 8.0), free=True))


@pytest.fixture(scope="module")
def scene():
    return ts.load_scene("cantilever")


def test_a_box_spreads_over_its_sides_and_has_its_corners(scene):
    box = over_of(scene, {GAP: ("66 um", "74 um"), "ground.restitution.coefficient": (0.15, 0.5)})
    assert isinstance(box, Unknowns) and len(corners(box)) == 4
    points = spread(box, 256)
    assert np.allclose(points.min(axis=0), box.low, atol=0.01 * (box.high - box.low))
    assert np.allclose(points.mean(axis=0), 0.5 * (box.low + box.high), rtol=0.01)
    grounds = Grounds.nominal(scene, box.names).with_more(points)
    assert len(grounds) == 257 and grounds.points()[0, 0] == 70e-6 and grounds.weights.sum() == pytest.approx(1.0)


def test_a_finite_number_of_grounds_keeps_its_weights_and_gives_the_scene_itself_none(scene, tmp_path):
    members = Grounds({GAP: np.array([69e-6, 72e-6])}, np.array([1.0, 3.0]))
    judge = Judge(lambda rows, grounds: rows, Grounds.nominal(scene, [GAP]), members, MEAN, 0)
    grounds = judge.fixed(24)
    assert grounds.weights.tolist() == [0.0, 0.25, 0.75] and grounds.values[GAP][0] == 70e-6
    file = tmp_path / "draws.npz"
    np.savez(file, paths=np.array([GAP]), samples=np.array([[68e-6], [71e-6], [70e-6]]))
    drawn = over_of(scene, file)
    assert isinstance(drawn, Grounds) and drawn.values[GAP].tolist() == [68e-6, 71e-6, 70e-6]


@pytest.mark.parametrize(("risk", "count"), [(MEAN, 24), (WORST, 400)])
def test_of_many_draws_some_stand_for_all_where_a_risk_averages(scene, risk, count):
    gaps = np.linspace(66e-6, 74e-6, 400)
    members = Grounds({GAP: gaps}, np.where(gaps < 70e-6, 1.0, 0.0))
    judge = Judge(lambda rows, grounds: rows, Grounds.nominal(scene, [GAP]), members, risk, 0)
    grounds = judge.fixed(24)
    assert len(grounds) == 1 + count and grounds.values[GAP][0] == 70e-6 and grounds.weights[0] == 0.0
    assert np.all(grounds.values[GAP][1:][grounds.weights[1:] > 0.0] < 70e-6)


@pytest.mark.parametrize(
    ("given", "told"),
    [
        ({GAP: ("74 um", "66 um")}, " is empty"),
        ({"robot.feet.tip.gab": (0.0, 1.0)}, "did you mean"),
        ({"ground.restitution.coefficient": (0.2, 1.4)}, "coefficient"),
        ({GAP: 3.0}, "expected"),
    ],
)
def test_a_box_that_is_none_is_refused(scene, given, told):
    with pytest.raises(InputError, match=told) as refused:
        over_of(scene, given)
    assert len(refused.value.problems) == 1


def test_rises_of_many_signals_are_those_of_each():
    rng = np.random.default_rng(3)
    levels = np.round(rng.uniform(-8.0, 8.0, (60, 5)), 1)
    levels[:5, 2] = levels[:5, 1]
    for row, total in zip(levels, period_rises(levels), strict=True):
        signal = ts.OnOff(levels=tuple(row), durations=(1e-3,) * 5, repeat=True)
        assert total == pytest.approx(rise_squares(signal, np.array([5e-3, 10e-3]))[0], abs=1e-9)


@pytest.mark.parametrize("step", [TWO, FREE])
def test_every_point_is_a_signal_of_the_period_that_holds_half_of_each_half(step):
    choices, rng = families(step, 2), np.random.default_rng(1)
    numbers = rng.integers(0, len(choices), 300)
    signals = step.place(choices, numbers, rng.random((300, step.unknowns(2))) * 1.2 - 0.1)
    levels, durations = np.split(signals, 2, axis=1)
    assert np.allclose(durations.sum(axis=1), 0.02) and (durations > 0.0).all()
    for number, row, volts in zip(numbers, durations, levels, strict=True):
        a, _ = choices[number].sizes
        assert volts[a] == 8.0 and volts[-1] == -8.0 and row[: a + 1].sum() == pytest.approx(0.01)
        assert row[a] >= 0.005 - 1e-12 and row[-1] >= 0.005 - 1e-12


@pytest.mark.parametrize(
    ("design", "names"),
    [
        ("landing", "foot pairs seed tick"),
        ("design", "scene free limits over of risk candidates periods"),
        ("gait", "free limits"),
        ("adapt", "steps noise"),
        ("leg", "shortest load"),
    ],
)
def test_every_design_has_a_file_of_its_settings(design, names):
    text = settings_text(design)
    tomllib.loads(text)
    said = {line.lstrip("# ").partition(" =")[0].strip("[]") for line in text.splitlines()}
    assert set(names.split()) <= said
    with pytest.raises(InputError, match=f"did you mean '{design}'"):
        settings_text(f"{design}x")
