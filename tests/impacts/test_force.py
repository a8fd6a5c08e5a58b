"""Forces by differences: on exact records, the growth of their noise, and shapes against modes."""

from __future__ import annotations

import numpy as np
import pytest

import tarsus as ts
from hexapod_records import POINTS, records, runs, structure, true_column
from tarsus.impacts.alignment import align, subtract
from tarsus.impacts.detection import detect_impacts
from tarsus.impacts.shapes import compare_with_modes, mode_shapes
from tarsus.records.measurement import Channel, Measurement, Quantity
from tarsus.synthesis.vibrometer import point_velocities
from tarsus_reproduce.forces import CLEAR, estimate_forces, impact_forces, point_matrices

SMALL = ts.Lumped(
    coordinates=("a", "b"),
    mass=((2e-3, 5e-4), (5e-4, 1e-3)),
    damping=((0.02, 0.01), (0.01, 0.03)),
    stiffness=((40.0, -10.0), (-10.0, 30.0)),
)


def exact_difference(rate: float) -> Measurement:
    """Velocities near the ground less in the air up to 30 ms, without any noise."""
    times = np.arange(0.0, 0.03, 1.0 / rate)
    near, far = (point_velocities(run, POINTS, times) for run in runs())
    return Measurement(tuple(Channel(n, Quantity.VELOCITY) for n in POINTS), near - far, 1.0 / rate)


def test_an_impact_is_a_force_at_the_foot_alone():
    record = exact_difference(2e6)
    events = runs()[0].events
    after = np.ceil(events["time"][:3] * record.rate).astype(int)
    found = impact_forces(record, structure(), POINTS, "foot1", after)
    assert found.ratio == pytest.approx(np.tile(np.eye(6)[0], (3, 1)), abs=1e-3)
    mobility = np.linalg.inv(structure().matrices().mass)[0, 0]
    change = events["speed_before"][:3] + events["speed_after"][:3]
    assert found.values[:, 0] * record.step == pytest.approx(change / mobility, rel=1e-3)


def test_no_force_acts_before_contact_and_one_at_it():
    record = exact_difference(2e6)
    found = estimate_forces(record, structure(), POINTS)
    after = int(np.ceil(runs()[0].events["time"][0] * record.rate))
    before, at = np.abs(found.values[:, : after - 1]).max(), np.abs(found.values[0, after - 1])
    assert before < 1e-9 * at
    assert not found.noise.any(), "no channel states a noise"


def test_the_noise_of_forces_is_its_closed_form():
    random = np.random.default_rng(2)
    sizes, count = np.array([1e-3, 2e-3]), 60
    trials, jumps = [], []
    for _ in range(600):
        noise = sizes[:, None] * random.standard_normal((2, count))
        channels = tuple(Channel("ab"[i], Quantity.VELOCITY, noise=sizes[i]) for i in range(2))
        record = Measurement(channels, noise, 1e-3)
        found = estimate_forces(record, SMALL, ["a", "b"])
        jump = impact_forces(record, SMALL, ["a", "b"], "a", np.array([30]))
        trials.append(found.values)
        jumps.append(jump.values[0])
    assert np.std(trials, axis=0) == pytest.approx(found.noise, rel=0.15)
    assert found.noise[0, -1] > 1.001 * found.noise[0, 0]
    assert np.std(jumps, axis=0) == pytest.approx(jump.noise[0], rel=0.1)


def test_the_noise_of_a_ratio_is_its_closed_form_where_it_is_clear():
    random = np.random.default_rng(3)
    ratios = []
    for _ in range(500):
        clean = np.zeros((2, 20))
        clean[:, 10:] = np.linalg.solve(SMALL.matrices().mass, [1e-3, 0.0])[:, None]
        noisy = clean + 1e-3 * random.standard_normal(clean.shape)
        channels = tuple(Channel(n, Quantity.VELOCITY, noise=1e-3) for n in "ab")
        found = impact_forces(Measurement(channels, noisy, 1e-5), SMALL, ["a", "b"], "a", np.array([10]))
        ratios.append(found.ratio[0, 1])
    assert np.abs(found.values[0, 0]) > CLEAR * found.noise[0, 0]
    assert np.std(ratios) == pytest.approx(found.ratio_noise[0, 1], rel=0.15)


def test_a_ratio_of_noises_is_not_given():
    close, in_air = records()
    first = float(runs()[0].events["time"][0])
    left = subtract(close, in_air, align(close, in_air, POINTS, before=first - 1e-4))
    found = impact_forces(left, structure(), POINTS, "foot1", detect_impacts(left, "foot1").after)
    clear = np.abs(found.values[:, 0]) > CLEAR * found.noise[:, 0]
    assert np.isnan(found.ratio[~clear]).all() and np.isfinite(found.ratio[clear]).all()
    assert np.mean(clear) < 0.2, "at 40 dB the printed mass matrix drowns nearly every impact in noise"


def test_points_stand_for_coordinates():
    m = point_matrices(SMALL, ["b", "a"])
    assert m.mass == pytest.approx(np.array([[1e-3, 5e-4], [5e-4, 2e-3]]))
    weighted = ts.Lumped(coordinates=("a", "b"), mass=(1e-3, 1e-3), stiffness=(1.0, 1.0), weights={"mean": (0.5, 0.5)})
    rows = np.array([[0.5, 0.5], [1.0, 0.0]])
    found = point_matrices(weighted, ["mean", "a"]).mass
    assert rows.T @ found @ rows == pytest.approx(1e-3 * np.eye(2))


def test_shapes_beside_modes():
    frequencies, shapes = mode_shapes(structure(), POINTS)
    assert frequencies == pytest.approx([117.2, 136.1, 329.2, 342.2, 678.1, 2866.1], abs=0.1)
    sixth = compare_with_modes(-3.0 * shapes[:, 5], structure(), POINTS)
    assert sixth.best == 5 and sixth.assurance[5] == pytest.approx(1.0)
    printed = compare_with_modes([-1.5, 0.59, 0.97, 0.40, 0.42, -0.42], structure(), POINTS)
    assert printed.assurance[5] == pytest.approx(0.965, abs=0.01)
    assert np.delete(printed.assurance, 5).max() < 0.3
    assert compare_with_modes(true_column(), structure(), POINTS).best == 5
