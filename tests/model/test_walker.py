import itertools

import numpy as np
import pytest

from tarsus.base.errors import InputError
from tarsus.model.structure import Walker, WalkerBody, WalkerLeg

LEG = {"mass": "1 ug", "stiffness_v": 1.2, "damping_v": 1e-3, "stiffness_l": 0.7, "damping_l": 2e-4}
PLACES = {"front": ("3 mm", "1 mm", "-0.2 mm"), "rear": ("-2 mm", "-1.5 mm", "0.1 mm")}


def walker(*, roll: bool = True, pitch: bool = True, **legs: dict) -> Walker:
    body = {"mass": "3 mg", "roll_inertia": 1e-12 if roll else None, "pitch_inertia": 2e-11 if pitch else None}
    places = {name: dict(zip("xyz", place, strict=True)) for name, place in PLACES.items()}
    return Walker(body=body, legs={name: {**LEG, **place, **legs.get(name, {})} for name, place in places.items()})


def test_matrices_of_the_three_mass_millipede() -> None:
    """(4.4), upward, and the same along the way."""
    it = Walker(body={"mass": 2e-7}, legs={"a": LEG, "b": LEG})
    matrices = it.matrices()
    upward, along = [1, 3, 5], [0, 2, 4]
    np.testing.assert_allclose(np.diag(matrices.mass), [2e-7, 2e-7, *[1e-9] * 4], rtol=1e-15)
    pattern = np.array([[2.0, -1.0, -1.0], [-1.0, 1.0, 0.0], [-1.0, 0.0, 1.0]])
    np.testing.assert_allclose(matrices.stiffness[np.ix_(upward, upward)], 1.2 * pattern)
    np.testing.assert_allclose(matrices.damping[np.ix_(upward, upward)], 1e-3 * pattern)
    np.testing.assert_allclose(matrices.stiffness[np.ix_(along, along)], 0.7 * pattern)
    np.testing.assert_allclose(matrices.damping[np.ix_(along, along)], 2e-4 * pattern)
    assert not matrices.stiffness[np.ix_(upward, along)].any()
    np.testing.assert_array_equal(it.vertical(), [0, 1, 0, 1, 0, 1])
    assert (it.size, it.body_size, it.body_coordinates) == (6, 2, ("surge", "heave"))
    assert it.leg_coordinate("b") == 4


@pytest.mark.parametrize(("roll", "pitch"), [*itertools.product([False, True], repeat=2)])
def test_matrices_are_those_of_the_energies(roll: bool, pitch: bool) -> None:
    """A random small motion: kinetic and elastic energy summed body by body and spring by spring in space."""
    it = walker(roll=roll, pitch=pitch)
    rng = np.random.default_rng(7)
    q, rate = rng.normal(size=(2, it.size)) * 1e-6
    where = dict(zip(it.body_coordinates, q, strict=False))
    turn = np.array([where.get("roll", 0.0), where.get("pitch", 0.0), 0.0])
    kinetic = 0.5 * float(it.body_mass() @ rate[: it.body_size] ** 2)
    elastic = 0.0
    for i, leg in enumerate(it.legs.values()):
        moved = np.array([where["surge"], 0.0, where["heave"]]) + np.cross(turn, [leg.x, leg.y, leg.z])
        foot = q[it.body_size + 2 * i :][:2]
        elastic += 0.5 * leg.stiffness_l * (moved[0] - foot[0]) ** 2
        elastic += 0.5 * leg.stiffness_v * (moved[2] - foot[1]) ** 2
        kinetic += 0.5 * leg.mass * float(np.sum(rate[it.body_size + 2 * i :][:2] ** 2))
    matrices = it.matrices()
    assert 0.5 * q @ matrices.stiffness @ q == pytest.approx(elastic, rel=1e-12)
    assert 0.5 * rate @ matrices.mass @ rate == pytest.approx(kinetic, rel=1e-12)
    np.testing.assert_allclose(matrices.stiffness, matrices.stiffness.T)


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


def test_rigid_translations_cost_nothing() -> None:
    it = walker()
    stiffness = it.matrices().stiffness
    forward = it.row("body_x") + sum(it.row(f"{leg}_x") for leg in it.legs)
    np.testing.assert_allclose(stiffness @ it.vertical(), 0.0, atol=1e-15)
    np.testing.assert_allclose(stiffness @ forward, 0.0, atol=1e-15)


def test_bad_walkers_in_sentences() -> None:
    with pytest.raises(InputError) as caught:
        Walker(body={"mass": 0.0, "roll_inertia": -1e-12}, legs={"a": {**LEG, "mass": "0 ug", "stiffness_l": -1.0}})
    assert [one.split(":")[0].removeprefix("Walker.") for one in caught.value.problems] == [
        "body.mass",
        "body.roll_inertia",
        "legs.a.mass",
        "legs.a.stiffness_l",
    ]
    with pytest.raises(InputError, match=r"^Walker.legs: .*at least one leg"):
        Walker(body=WalkerBody(mass=1.0), legs={})
    leg = WalkerLeg(**LEG)
    with pytest.raises(InputError, match=r"Walker.legs.a: its point 'a_x' .*\n.*Walker.legs.a_x: "):
        Walker(body=WalkerBody(mass=1.0), legs={"a": leg, "a_x": leg})
    with pytest.raises(InputError, match=r"Walker.legs.body: its point 'body' would bear the name"):
        Walker(body=WalkerBody(mass=1.0), legs={"body": leg})
