"""Laws that published experiments are modelled by, each against its closed form."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.special import hyp2f1

import tarsus as ts
from scene_files import scene
from tarsus.base.events import EventKind

G = 9.81

# --- friction of two constants --------------------------------------------------------------------------------


def on_a_belt(static: float, kinetic: float, speed: float, rate: float) -> ts.Scene:
    """A mass of 1 kg on a spring to a wall, on a belt that passes below: the base stays while the ground moves."""
    structure = ts.Lumped(
        coordinates=("z", "x"),
        mass=(1.0, 1.0),
        stiffness=(0.0, rate**2),
        damping=(0.0, 0.0),
        upward=(1.0, 0.0),
        forward=(0.0, 1.0),
    )
    belt = {"kind": "ramp", "stop": 1e3 * speed, "duration": 1e3}
    return ts.Scene(
        name="belt",
        robot=ts.Robot(structure=structure, feet={"block": ts.Foot(point="z", gap=0.0, along="x")}),
        ground=ts.Ground(
            gravity=ts.Gravity(acceleration=G),
            friction={"kind": "static_kinetic", "static": static, "kinetic": kinetic},
            motion={"along": {"displacement": belt}, "base": "stays"},
        ),
        duration=1.0,
    )


@pytest.mark.parametrize(("static", "kinetic"), [(0.6, 0.4), (0.5, 0.1), (0.3, 0.29)])
@pytest.mark.parametrize("speed", [1e-3, 0.1, 3.0])
def test_a_block_on_a_belt_sticks_and_slips_as_its_equation_says(static, kinetic, speed):
    """With A = (mu_s - mu_k) g / w^2: it sticks for 2 A / v and slips for (2 / w)(pi - atan(A w / v))."""
    rate = 20.0
    over = (static - kinetic) * G / rate**2
    stick, slip = 2.0 * over / speed, 2.0 / rate * (math.pi - math.atan(over * rate / speed))
    first = static * G / rate**2 / speed
    run = ts.simulate(on_a_belt(static, kinetic, speed, rate), first + 4.5 * (stick + slip))
    begins, ends = (
        run.events["time"][run.events["kind"] == kind] for kind in (EventKind.SLIP_BEGINS, EventKind.STICK_BEGINS)
    )
    assert run.ok and run.ledger.closure < 1e-8 and len(begins) == 5
    assert begins[0] == pytest.approx(first, rel=1e-12)
    near = 1e-9 / rate  # [s] in an oscillation's radians
    np.testing.assert_allclose(ends[:4] - begins[:4], slip, rtol=1e-11, atol=near)
    np.testing.assert_allclose(begins[1:] - ends[:4], stick, rtol=1e-11, atol=near)


def test_a_slip_has_no_more_friction_than_rest():
    with pytest.raises(ts.InputError, match="kinetic: a slip has at most the friction of rest"):
        ts.laws.StaticKineticFriction(static=0.3, kinetic=0.4)


# --- rarefied film --------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("knudsen", "within"), [(0.01, 1e-12), (0.1, 1e-9), (0.5, 1e-6), (1.0, 1e-5)])
def test_a_rarefied_film_has_veijolas_viscosity(knudsen, within):
    """Its momentum is C / h^2 times half a hypergeometric function, and the force that of the thick film, divided."""
    film = ts.laws.RarefiedFilm(coefficient=1e-21, thickness=1e-6, free_path=knudsen * 2e-6)
    thin = 9.638 * knudsen**1.159
    power = 2.0 / 1.159
    wanted = 0.5e-21 / 4e-12 * hyp2f1(1.0, power, 1.0 + power, -thin)
    assert film.momentum(1e-6, *film.parameters()) == pytest.approx(wanted, rel=within)
    step = 1e-9
    after, before = (film.momentum(1e-6 + by, *film.parameters()) for by in (step, -step))
    slope = (after - before) / (2.0 * step)
    assert slope == pytest.approx(-1e-21 / 8e-18 / (1.0 + thin), rel=max(1e-5, within))


# --- combs ----------------------------------------------------------------------------------------------------

FRONT, BEHIND, HEIGHT, TRAVEL = 1e-6, 13e-6, 40e-6, 4.6e-6
PLATES = 9.5e-19


def comb(volts: float, path: float = 0.0, film: float = 0.0) -> ts.Scene:
    """A shuttle of 3.5 ug on 10.3 N/m between two electrodes, as two feet that face each other: the front one, with
    fringes, pulls it to a stop, the one behind has a ground of its own."""
    gate = ts.Drive(load=ts.PointLoad(weights={"shuttle": 1.0}), law=ts.LinearForce(gain=0.0))
    structure = ts.Lumped(coordinates=("shuttle",), mass=[3.5e-9], stiffness=[10.3], damping=[0.0])
    figures, edges = {"coefficient": PLATES, "offset": FRONT}, {"kind": "fringing_field", "height": HEIGHT}
    films = {"kind": "rarefied_film", "coefficient": film, "thickness": FRONT, "free_path": path}
    between = {"film": films} if film else {}
    feet = {
        "stop": ts.Foot(point="shuttle", gap=TRAVEL, electrode="gate"),
        "back": ts.Foot(point="shuttle", normal=-1, gap=BEHIND - TRAVEL - FRONT, electrode="gate", ground="behind"),
    }
    return ts.Scene(
        name="comb",
        robot=ts.Robot(structure=structure, drives={"gate": gate}, feet=feet),
        ground={"electrostatic": figures, "laws": {"fringes": edges | figures, **between}},
        grounds={"behind": {"electrostatic": figures, "laws": between}},
        signals={"gate": ts.Constant(level=volts)},
        duration=1e-3,
    )


def test_a_comb_closes_where_no_place_holds_it():
    """From rest it passes every place where the energy that the spring takes is less than the electrodes' work."""
    x = np.linspace(1e-9, TRAVEL, 200_000)
    f0, b0 = TRAVEL + FRONT, BEHIND - TRAVEL
    f, b = f0 - x, b0 + x
    work = PLATES * (1.0 / f - 1.0 / f0 + np.log(f0 / f) / (math.pi * HEIGHT) + 1.0 / b - 1.0 / b0)
    dynamic = float(np.sqrt(0.5 * 10.3 * x**2 / work).max())
    static = np.sqrt(10.3 * x / (PLATES * (1.0 / f**2 + 1.0 / (math.pi * HEIGHT * f) - 1.0 / b**2)))
    assert dynamic < float(static.max())
    below, above = (ts.simulate(comb(dynamic * part)) for part in (1.0 - 1e-3, 1.0 + 1e-3))
    assert below.ok and above.ok and not len(below.events) and len(above.events)
    speed = math.sqrt(2.0 / 3.5e-9 * (work[-1] * (1.001 * dynamic) ** 2 - 0.5 * 10.3 * TRAVEL**2))
    assert above.events["speed_before"][0] == pytest.approx(speed, rel=1e-9)


@pytest.mark.parametrize("path", [0.0, 68e-9])
def test_films_of_a_comb_brake_on_both_sides(path):
    """The power that they take is C v^2 [Q(f)/f^3 + Q(b)/b^3], and the account closes."""
    closing = comb(70.0, path, film=4.4e-21)
    end = 0.999 * ts.simulate(closing).events["time"][0]
    run, t = ts.simulate(closing, end), np.linspace(0.0, end, 40_001)
    states = run.states(t)
    f, b = states.gap + FRONT
    film = sum(1.0 / h**3 / (1.0 + 9.638 * (path / h) ** 1.159) for h in (f, b))
    lost = float(np.trapezoid(4.4e-21 * states.v[0] ** 2 * film, t))
    assert run.ledger.closure < 1e-8
    assert -run.ledger.laws["film"] == pytest.approx(lost, rel=1e-5)


# --- restitution by speed -------------------------------------------------------------------------------------


@pytest.mark.parametrize("power", [0.1, 0.25, 0.5])
def test_flights_of_a_ball_fall_as_its_restitution_says(power):
    """Departing speeds are v_(n+1) = e_0 v_0^p v_n^(1-p), and flights 2 v / g."""
    law = ts.laws.PowerRestitution(coefficient=0.6, speed=1.0, power=power)
    values = {"ground.restitution": None, "ground.laws": {"power_restitution": law}}
    run = ts.simulate(scene("ball", values), 2.5)
    speeds = run.events["speed_before"]
    assert run.ok and len(speeds) > 3
    assert speeds[0] == pytest.approx(math.sqrt(2.0 * G), rel=1e-12)
    np.testing.assert_allclose(speeds[1:], 0.6 * speeds[:-1] ** (1.0 - power), rtol=1e-12)
    np.testing.assert_allclose(np.diff(run.events["time"]), 2.0 * speeds[1:] / G, rtol=1e-12)


def test_slow_impacts_lose_no_less_than_is_said():
    law = ts.laws.PowerRestitution(coefficient=0.6, speed=1.0, power=0.5, most=0.9)
    assert law.rebound(0.01, *law.parameters()) == pytest.approx(0.009)
    values = {"ground.restitution": None, "ground.laws": {"power_restitution": law}}
    run = ts.simulate(scene("ball", values), 12.0)
    assert run.ok and run.events["kind"][-1] == EventKind.REST


# --- fringing field -------------------------------------------------------------------------------------------


# --- momenta below zero ---------------------------------------------------------------------------------------


class FilmBehind(ts.DampingLaw):
    """A film on the other side of a foot, whose momentum is below 0 and falls ever faster as the foot rises."""

    coefficient: float = ts.quantity("N m^2 s", "film coefficient", ge=0.0)
    behind: float = ts.quantity("m", "thickness at contact", gt=0.0)

    @staticmethod
    def momentum(gap, coefficient, behind):
        return -0.5 * coefficient / ((behind - gap) * (behind - gap))


def test_a_momentum_is_counted_from_anywhere():
    """It took ever shorter steps, as if it were deep in a film: m v + P(g) stays, and the foot falls."""
    law = FilmBehind(coefficient=4.4e-21, behind=6e-6)
    values = {
        "ground.gravity": None,
        "ground.laws": {"film_behind": law},
        "robot.structure.mass": [3.5e-9],
        "robot.feet.ball.gap": 5e-6,
        "initial.velocity": [-0.1],
    }
    run = ts.simulate(scene("ball", values), 2e-4)
    assert run.ok
    states = run.states(np.linspace(0.0, 2e-4, 20))
    momentum = [law.momentum(g, *law.parameters()) for g in states.gap[0]]
    whole = -3.5e-10 - law.momentum(5e-6, *law.parameters())
    np.testing.assert_allclose(3.5e-9 * states.v[0] - momentum, whole, rtol=1e-8)


# --- laws with a pole at contact ------------------------------------------------------------------------------


class Pole(ts.SmoothLaw):
    """Attraction that has no bound where the gap closes."""

    strength: float = ts.quantity("N m^2", "size", default=1e-15)
    uses_rate = False

    @staticmethod
    def force(gap: float, gap_rate: float, volts: float, time: float, strength: float) -> float:
        return -strength / (gap * gap)


@pytest.mark.parametrize("film", [None, (1e-20, 1e-8), (1e-18, 1e-7), (1e-16, 1e-10)])
@pytest.mark.parametrize("strength", [-1e-15, 1e-18, 1e-15, 3e-14])
def test_a_force_without_bound_beside_a_film_ends_in_a_run_or_a_sentence(strength, film):
    """The run reaches its end, or says that the law changes too fast; each takes milliseconds."""
    structure = ts.Lumped(coordinates=("tip",), mass=(1e-8,), stiffness=(4.0,), damping=(1e-6,))
    ground = {"laws": {"pole": Pole(strength=strength)}, "restitution": {"coefficient": 0.3}}
    if film is not None:
        ground["film"] = dict(zip(("coefficient", "thickness"), film, strict=True))
    foot = ts.Foot(point="tip", gap=10e-6)
    scene = ts.Scene(
        name="pole",
        robot=ts.Robot(structure=structure, feet={"tip": foot}),
        ground=ts.Ground(**ground),
        initial={"displacement": (8e-6,)},
        duration=5e-3,
    )
    run = ts.simulate(scene)
    assert run.ok or "a ground law changes too fast" in run.ended.value
    if run.ok:
        assert run.ledger.closure < 1e-6
