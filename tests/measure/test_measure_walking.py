"""Measures of a walk on marks made by hand, and the energy of switching in closed form."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
import pytest

import tarsus as ts
from tarsus.base.events import EventKind
from tarsus.measure import Judgement, RunTable, Scope, walk_statistics
from tarsus.measure.switching import charging_energy, rise_squares
from tarsus.model.scene import Scene
from tarsus.solve.codes import EVENT_TYPE, structured_marks
from walking_devices import creeping_millipede

T = 0.02
EDGES = T * np.arange(5)


@pytest.fixture(scope="module")
def scene() -> Scene:
    return creeping_millipede()


@dataclass(frozen=True)
class Hand:
    """A walk as measures see it: three periods of 20 ms."""

    scene: Scene
    marks: np.ndarray | None
    all_events: np.ndarray
    duration: float = 3 * T
    period: float = T
    foot_names: tuple[str, ...] = ("L1", "R1")

    @property
    def end_time(self) -> float:
        return self.duration


def marks(*rows: tuple[float, ...]) -> np.ndarray:
    """Marks from (time, surge, heave, slipped of L1, of R1, lowest, highest); feet stay at 0."""
    table = [(t, x, z, 0.0, 0.0, left, right, low, high) for t, x, z, left, right, low, high in rows]
    return structured_marks(np.array(table), 2)


@pytest.fixture
def walk(scene) -> Hand:
    way = marks(
        (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
        (T, 5e-6, 1e-6, 2e-6, 0.0, -1e-6, 9e-6),
        (2 * T, 8e-6, 1e-6, 2e-6, 1e-6, 0.0, 4e-6),
        (3 * T, 9e-6, 1e-6, 5e-6, 3e-6, 1e-6, 3e-6),
    )
    return Hand(scene, way, np.zeros(0, EVENT_TYPE))


def test_the_way_after_transients_and_its_spread(walk):
    found = walk_statistics(walk)
    assert found["stride"].value == pytest.approx(2e-6)  # 3 and 1 um; the first period is a transient
    assert found["stride"].spread == pytest.approx(np.std([3e-6, 1e-6], ddof=1)) and found["stride"].n == 2
    assert found["mean_speed"].value == pytest.approx(2e-6 / T)
    assert found["body_lengths_per_second"].value == pytest.approx(2e-6 / T / 10e-3)
    assert found["vertical_amplitude"].value == pytest.approx(3e-6)  # 4 and 2 um
    assert found["foot_slip"].per_foot == pytest.approx({"L1": 1.5e-6, "R1": 1.5e-6})
    ratios = {"L1": (0.0 + 3.0 / 4.0) / 2.0, "R1": (1.0 / 4.0 + 2.0 / 3.0) / 2.0}
    assert found["slip_ratio"].per_foot == pytest.approx(ratios)
    everything = walk_statistics(walk, skip=0)
    assert everything["stride"].value == pytest.approx(3e-6) and everything["stride"].n == 3


def test_the_whole_run_counts_from_its_start(walk):
    found = walk_statistics(walk)
    assert found["max_heave"].value == 9e-6 and found["max_surge"].value == 9e-6
    back = replace(walk, marks=np.concatenate([walk.marks[:3], marks((3 * T, -20e-6, 0, 0, 0, 0, 0))]))
    assert walk_statistics(back)["max_surge"].value == 20e-6
    assert walk_statistics(back)["stride"].value == pytest.approx((3e-6 - 28e-6) / 2)


def test_longer_periods_are_whole_ones_of_the_run(walk):
    found = walk_statistics(walk, period=3 * T)
    assert found["stride"].value == pytest.approx(9e-6)
    assert found["vertical_amplitude"].value == pytest.approx(10e-6)
    with pytest.raises(ts.InputError, match=r"expected a multiple of 0\.02 s"):
        walk_statistics(walk, period=0.03)


def test_a_run_that_ended_early_has_the_periods_that_it_reached(walk):
    early = replace(walk, marks=walk.marks[:3])
    assert walk_statistics(early)["stride"].n == 1
    none = walk_statistics(replace(walk, marks=walk.marks[:1]))
    assert math.isnan(none["stride"].value) and none["stride"].n == 0
    empty = walk_statistics(replace(walk, marks=None))
    assert list(empty) == list(walk_statistics(walk))
    assert {name: m.unit for name, m in empty.items()} == {name: m.unit for name, m in walk_statistics(walk).items()}


def test_a_walker_that_stands_has_no_cost_of_transport(walk):
    still = walk.marks.copy()
    for name in ("body", "slipped"):
        still[name] = 0.0
    found = walk_statistics(replace(walk, marks=still))
    assert found["stride"].value == 0.0
    assert math.isnan(found["cost_of_transport"].value) and math.isnan(found["slip_ratio"].value)


def test_cost_of_transport_is_energy_over_weight_and_way(walk, scene):
    found = walk_statistics(walk)
    energy = 2 * scene.robot.drives["L1"].capacitance * 14.0**2
    weight = (2e-7 + 2 * 1.03333e-9) * 9.81
    assert found["electrical_energy"].value == pytest.approx(energy)
    assert found["cost_of_transport"].value == pytest.approx(energy / (weight * 2e-6))
    share = found["stride"].spread / found["stride"].value
    assert found["cost_of_transport"].spread == pytest.approx(share * found["cost_of_transport"].value)
    for path in ("robot.drives.R1.capacitance", "ground.gravity"):
        unknown = replace(walk, scene=ts.with_values(scene, {path: None}))
        assert math.isnan(walk_statistics(unknown)["cost_of_transport"].value)
        assert math.isnan(walk_statistics(unknown)["electrical_energy"].value) == (path != "ground.gravity")


def test_a_dead_leg_needs_no_capacitance(walk, scene):
    quiet = {"robot.drives.R1.capacitance": None, "signals.R1": ts.Constant(level=0.0)}
    found = walk_statistics(replace(walk, scene=ts.with_values(scene, quiet)))
    assert found["electrical_energy"].value == pytest.approx(scene.robot.drives["L1"].capacitance * 14.0**2)


def test_length_of_the_body_is_from_hip_to_hip_unless_it_is_described(scene):
    long = ts.load_scene("millipede-30").robot.structure
    assert long.length == 10e-3
    hips = ts.with_values(long, {"body.length": None})
    assert hips.length == pytest.approx(14 * 10e-3 / 15, rel=1e-5)
    assert ts.with_values(scene.robot.structure, {"body.length": None}).length == 0.0


def feet_events(*rows: tuple[float, int, EventKind]) -> np.ndarray:
    """Events of two feet (time, foot, kind), those before flights with apexes far above what is seen."""
    events = np.zeros(len(rows), EVENT_TYPE)
    events["time"], events["foot"], events["kind"] = zip(*rows, strict=True)
    events["apex"] = 1e-5
    return events


def test_the_time_that_no_foot_is_on_the_ground(walk):
    """L1 stands until 25 ms and from 35 ms, R1 until 10 ms and from 30 ms to 50 ms and for good from 55 ms."""
    start, left, down = EventKind.CONTACT_AT_START, EventKind.RELEASE, EventKind.CAPTURE
    rows = (
        (0.0, 0, start),
        (0.0, 1, start),
        (0.010, 1, left),
        (0.025, 0, left),
        (0.030, 1, down),
        (0.035, 0, down),
        (0.045, 0, left),
        (0.050, 1, left),
        (0.055, 1, down),
        (0.055, 0, down),
    )
    found = walk_statistics(replace(walk, all_events=feet_events(*rows)))
    assert found["all_feet_up"].value == pytest.approx(0.5 * (5.0 / 20.0 + 5.0 / 20.0)), (
        "25 to 30 ms and 50 to 55 ms of the second and third period"
    )
    assert found["longest_hold"].value == pytest.approx(25e-3)
    always = walk_statistics(replace(walk, all_events=feet_events(*rows[:2])))
    assert always["all_feet_up"].value == 0.0 and always["longest_hold"].value == pytest.approx(3 * T)
    turns = ((0.0, 0, start), (0.02, 0, left), (0.02, 1, down))
    assert walk_statistics(replace(walk, all_events=feet_events(*turns)))["all_feet_up"].value == 0.0


def test_the_height_of_a_walk_is_over_all_its_settled_periods(walk):
    found = walk_statistics(walk)
    assert found["heave_span"].value == pytest.approx(4e-6), "of 0 to 4 and 1 to 3 um"
    assert walk_statistics(walk, skip=0)["heave_span"].value == pytest.approx(10e-6)
    assert "tilt" not in found


def test_the_tilt_of_a_period_is_the_larger_at_its_ends():
    turning = ts.load_scene("hexapod-walker")
    rows = np.zeros((4, 7 + 12))
    rows[:, 0], rows[:, 3], rows[:, 4] = T * np.arange(4), [0.02, -0.05, 0.01, 0.0], [0.0, 0.01, 0.0, -0.03]
    run = Hand(turning, structured_marks(rows, 6), np.zeros(0, EVENT_TYPE), foot_names=tuple(turning.robot.feet))
    assert walk_statistics(run, skip=0)["tilt"].value == pytest.approx((0.05 + 0.05 + 0.03) / 3.0)


SQUARE = ts.Square(amplitude=7.0, offset=7.0, frequency=50.0)
RISES = [
    (SQUARE, 14.0**2),
    (ts.Square(amplitude=7.0, offset=7.0, frequency=50.0, phase=math.pi), 14.0**2),
    (ts.Square(amplitude=7.0, offset=-7.0, frequency=50.0, phase=1.0), 14.0**2),
    (ts.Square(amplitude=7.0, frequency=50.0, duty=0.3), 14.0**2),
    (ts.Square(amplitude=7.0, offset=7.0, frequency=100.0), 2 * 14.0**2),
    (ts.Sine(amplitude=3.0, frequency=50.0), 36.0),
    (ts.Sine(amplitude=3.0, frequency=50.0, phase=2.0, offset=1.0), 36.0),
    (ts.waveforms.RampedSquare(amplitude=3.0, frequency=50.0, duty=0.5), 36.0),
    (ts.OnOff(levels=(0.0, 5.0, 3.0, 14.0), durations=(5e-3,) * 4, repeat=True), 25.0 + 121.0),
]


@pytest.mark.parametrize(("signal", "squares"), RISES, ids=lambda one: getattr(one, "kind", ""))
def test_every_rise_of_a_period_counts_once(signal, squares):
    np.testing.assert_allclose(rise_squares(signal, EDGES), squares, rtol=1e-12)


def test_a_voltage_that_does_not_repeat_starts_from_nothing():
    ramp = ts.waveforms.Ramp(start=0.0, stop=6.0, duration=0.03)
    assert rise_squares(ramp, EDGES).tolist() == [0.0, 36.0, 0.0, 0.0]
    constant = ts.Constant(level=5.0)
    assert rise_squares(constant, EDGES).tolist() == [25.0, 0.0, 0.0, 0.0]
    stairs = ts.OnOff(levels=(2.0, 5.0, 1.0, 4.0), durations=(0.01, 0.01, 0.01, 0.01))
    assert rise_squares(stairs, EDGES).tolist() == [25.0, 9.0, 0.0, 0.0]  # steps on the way up gain nothing
    assert rise_squares(ts.Square(amplitude=7.0, frequency=50.0, duty=1.0), EDGES).tolist() == [49.0, 0.0, 0.0, 0.0]


def test_recovered_charge_is_not_drawn_again(scene):
    drive = scene.robot.drives["L1"]
    full = charging_energy(drive, SQUARE, EDGES)
    np.testing.assert_allclose(full, drive.capacitance * 14.0**2)
    half = ts.with_values(drive, {"recovery": 0.4})
    np.testing.assert_allclose(charging_energy(half, SQUARE, EDGES), 0.6 * full)


def test_a_batch_measures_with_the_values_of_each_run(scene):
    capacitance, mass = [1e-9, 3e-9], [2e-7, 4e-7]
    vary = {
        "robot.drives.L1.capacitance": capacitance,
        "robot.structure.body.mass": mass,
        "ground.gravity.acceleration": [9.81, 1.62],
    }
    batch = ts.simulate_batch(scene, vary, 0.06, threads=1)
    other = scene.robot.drives["R1"].capacitance
    for i in range(2):
        found = batch.measures(i)
        energy = (capacitance[i] + other) * 14.0**2
        weight = (mass[i] + 2 * 1.03333e-9) * vary["ground.gravity.acceleration"][i]
        assert found["electrical_energy"].value == pytest.approx(energy)
        assert found["cost_of_transport"].value == pytest.approx(energy / (weight * found["stride"].value), rel=1e-9)
        alone = ts.simulate(batch.run(i).scene, 0.06).measures
        assert list(alone) == list(found)
        assert alone["stride"].value == pytest.approx(found["stride"].value, rel=1e-5)


def test_the_mean_height_is_the_time_mean_of_the_gap(scene):
    run = ts.simulate(scene, 0.06)
    edges = Judgement(RunTable.of(run)).windows.edges
    times = np.linspace(edges[0], edges[-1], 4001)
    gap = run.states(0.5 * (times[1:] + times[:-1])).gap
    found = run.measures.mean_height
    assert found.scope is Scope.MEAN
    for i, foot in enumerate(run.foot_names):
        assert found.per_foot[foot] == pytest.approx(float(gap[i].mean()), rel=1e-4)
    assert (
        run.measures.peak.value == max(run.measures.peak.per_foot.values()) and run.measures.peak.scope is Scope.WORST
    )
