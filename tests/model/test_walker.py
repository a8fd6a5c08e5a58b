"""Walkers: their matrices, points and turns, and where their path goes."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from tarsus.measure.path import path_of
from tarsus.model.structure import Walker, WalkerLeg

LEG = {"mass": "1 ug", "stiffness_v": 1.2, "damping_v": 1e-3, "stiffness_l": 0.7, "damping_l": 2e-4}
PLACES = {"front": ("3 mm", "1 mm", "-0.2 mm"), "rear": ("-2 mm", "-1.5 mm", "0.1 mm")}


def walker(*, roll: bool = True, pitch: bool = True, **legs: dict) -> Walker:
    body = {"mass": "3 mg", "roll_inertia": 1e-12 if roll else None, "pitch_inertia": 2e-11 if pitch else None}
    places = {name: dict(zip("xyz", place, strict=True)) for name, place in PLACES.items()}
    return Walker(body=body, legs={name: {**LEG, **place, **legs.get(name, {})} for name, place in places.items()})


@pytest.mark.parametrize(("roll", "pitch"), [*itertools.product([False, True], repeat=2)])
def test_matrices_are_those_of_the_energies(roll: bool, pitch: bool) -> None:
    """Random small motions: both energies and the power lost, body by body and spring by spring in space."""
    it = walker(roll=roll, pitch=pitch)
    matrices = it.matrices()
    rng = np.random.default_rng(7)
    for _ in range(it.size**2):
        q, rate = rng.normal(size=(2, it.size)) * 1e-6
        kinetic, elastic, lost = 0.5 * float(it.body_mass() @ rate[: it.body_size] ** 2), 0.0, 0.0
        for i, leg in enumerate(it.legs.values()):
            stretch, speed = (stretched(it, i, leg, motion) for motion in (q, rate))
            elastic += 0.5 * (leg.stiffness_l * stretch[0] ** 2 + leg.stiffness_v * stretch[1] ** 2)
            lost += leg.damping_l * speed[0] ** 2 + leg.damping_v * speed[1] ** 2
            kinetic += 0.5 * leg.mass * float(np.sum(rate[it.body_size + 2 * i :][:2] ** 2))
        assert 0.5 * q @ matrices.stiffness @ q == pytest.approx(elastic, rel=1e-12)
        assert rate @ matrices.damping @ rate == pytest.approx(lost, rel=1e-12)
        assert 0.5 * rate @ matrices.mass @ rate == pytest.approx(kinetic, rel=1e-12)
    for matrix in (matrices.mass, matrices.damping, matrices.stiffness):
        np.testing.assert_allclose(matrix, matrix.T)


def stretched(it: Walker, i: int, leg: WalkerLeg, motion: np.ndarray) -> np.ndarray:
    """Along and upward: how far the hip of leg number i moves from its foot."""
    where = dict(zip(it.body_coordinates, motion, strict=False))
    turn = np.array([where.get("roll", 0.0), where.get("pitch", 0.0), 0.0])
    moved = np.array([where["surge"], 0.0, where["heave"]]) + np.cross(turn, [leg.x, leg.y, leg.z])
    return moved[[0, 2]] - motion[it.body_size + 2 * i :][:2]


def test_points_move_as_their_names_say() -> None:
    it = walker()
    assert it.points == (
        "body",
        "body_x",
        "front",
        "front_x",
        "front_hip",
        "front_hip_x",
        "rear",
        "rear_x",
        "rear_hip",
        "rear_hip_x",
    )
    x = np.arange(1.0, 9.0)  # surge, heave, roll, pitch, front x, front height, rear x, rear height
    moved = {point: float(it.row(point) @ x) for point in it.points}
    assert (moved["body_x"], moved["body"]) == (1.0, 2.0)
    assert (moved["front_x"], moved["front"], moved["rear_x"], moved["rear"]) == (5.0, 6.0, 7.0, 8.0)
    assert moved["front_hip"] == pytest.approx(2.0 + 1e-3 * 3.0 - 3e-3 * 4.0)
    assert moved["rear_hip"] == pytest.approx(2.0 - 1.5e-3 * 3.0 + 2e-3 * 4.0)
    assert moved["front_hip_x"] == pytest.approx(1.0 - 0.2e-3 * 4.0)
    assert it.leg_of("rear_hip_x") == "rear" and it.leg_of("body_x") is None
    for unknown in ("tail", "tail_x", "front_x_x", "body_hip"):
        with pytest.raises(KeyError):
            it.row(unknown)
    with pytest.raises(KeyError):
        it.leg_coordinate("tail")


def test_a_body_that_goes_ahead_and_turns_goes_round_a_circle() -> None:
    yaw = np.linspace(0.0, np.pi, 2001)
    x, y = path_of(0.1 * yaw, np.zeros(2001), yaw)
    assert np.hypot(x, y - 0.1) == pytest.approx(np.full(2001, 0.1), rel=1e-6)
    assert (x[-1], y[-1]) == pytest.approx((0.0, 0.2), abs=1e-7)
