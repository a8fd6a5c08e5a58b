"""Closed forms of feet that slide and stick: blocks, impacts, planes that shake, friction that bears on itself."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from scipy.optimize import brentq

import tarsus as ts
from scene_files import of_kind
from sliding_scenes import MASS, slider
from tarsus.base.events import EventKind
from tarsus.model.laws import AdhesiveFriction, Friction
from tarsus.model.scene import Initial
from walking_scenes import GRAVITY, block, moving, sticky, trotter

MU = 0.3
PRESS = MASS * GRAVITY
SPEED = 0.05


def place(run: ts.Run, *times: float) -> np.ndarray:
    return run.at(np.array(times)).foot_x[0]


def thrown(by: str, speed: float, **laws: Any) -> ts.Scene:
    """A block that slides, by contact modes or as the foot of a leg."""
    if by == "modes":
        return slider(speed=speed, **laws)
    return moving(block(ground=block().ground.model_copy(update=laws), duration=0.1), block_x=speed)


@pytest.mark.parametrize("by", ["modes", "legs"])
@pytest.mark.parametrize("sense", [1.0, -1.0])
def test_a_block_stops_where_friction_stops_it(sense: float, by: str) -> None:
    run = ts.simulate(thrown(by, sense * SPEED))
    stick = of_kind(run, EventKind.STICK_BEGINS)
    assert stick["time"] == pytest.approx([SPEED / (MU * GRAVITY)], rel=1e-12)
    assert place(run, run.duration) == pytest.approx(sense * SPEED**2 / (2.0 * MU * GRAVITY), rel=1e-10)
    assert run.ledger.friction == pytest.approx(0.5 * MASS * SPEED**2, rel=1e-10)
    assert run.ledger.closure < 1e-12
    series = run.at(np.array([0.5, 2.0]) * stick["time"])
    assert series.friction[0] == pytest.approx([-sense * MU * PRESS, 0.0], abs=1e-15 * PRESS)
    assert series.slipping[0].tolist() == [True, False]
    if run.marks is not None:
        assert run.marks["slipped"][-1, 0] == pytest.approx(SPEED**2 / (2.0 * MU * GRAVITY), rel=1e-9)


@pytest.mark.parametrize("by", ["modes", "legs"])
def test_adhesion_brakes_as_weight_does_and_friction_by_it_alone_does_not(by: str) -> None:
    held = ts.Adhesion(initial=2e-5, rate=0.0)
    both = ts.simulate(thrown(by, SPEED, adhesion=held))
    assert place(both, 0.1) == pytest.approx(SPEED**2 * MASS / (2.0 * MU * (PRESS + held.initial)), rel=1e-10)
    run = ts.simulate(thrown(by, SPEED, adhesion=held, friction=AdhesiveFriction(coefficient=MU)))
    assert place(run, 0.1) == pytest.approx(SPEED**2 * MASS / (2.0 * MU * held.initial), rel=1e-10)


@pytest.mark.parametrize("speed", [0.02, 0.06])
def test_an_oblique_impact_brakes_by_mu_times_its_normal_impulse(speed: float) -> None:
    """Of a point mass: v_t falls by mu (1 + e) v_n at most, and adhesion has no part in it."""
    fall, e = 0.1, 0.5
    run = ts.simulate(slider(speed=speed, fall=fall, gap=1e-6, gravity=None), 1e-3)
    braked = max(speed - MU * (1.0 + e) * fall, 0.0)
    assert run.events["kind"].tolist() == [EventKind.BOUNCE]
    lost = 0.5 * MASS * ((1.0 - e**2) * fall**2 + speed**2 - braked**2)
    assert run.events["energy"][0] == pytest.approx(lost, rel=1e-12)
    assert run.motion.last[3] == pytest.approx(braked, abs=1e-14 * speed)
    assert run.ledger.closure < 1e-12


def test_an_impact_with_friction_takes_energy_however_the_two_ways_are_coupled() -> None:
    """Kane's paradox: rates and impulses by Newton's and Coulomb's laws alone may gain some."""
    rng = np.random.default_rng(3)
    for _ in range(60):
        coupling, speed = rng.uniform(-0.95, 0.95), rng.normal(0.0, 0.2)
        laws = {
            "gravity": None,
            "restitution": ts.Restitution(coefficient=rng.uniform(0.3, 1.0)),
            "friction": Friction(coefficient=float(np.exp(rng.uniform(-3.0, 2.0)))),
        }
        run = ts.simulate(slider(speed=speed, fall=0.1, gap=1e-6, coupling=coupling, **laws), 1e-4)
        mass, before, after = run.plan.system.mass, np.array([-0.1, speed]), run.motion.last[2:]
        lost = 0.5 * before @ mass @ before - 0.5 * after @ mass @ after
        assert run.events["energy"][0] == pytest.approx(lost, rel=1e-9)
        assert lost > -1e-15 * MASS
        push, along = mass @ (after - before)
        assert push > 0.0 and abs(along) <= laws["friction"].coefficient * push * (1.0 + 1e-12)
        assert after[0] == pytest.approx(laws["restitution"].coefficient * 0.1, rel=1e-12)


@pytest.mark.parametrize("coupling", [0.6, -0.6])
def test_friction_bears_on_the_push_that_bears_it(coupling: float) -> None:
    """m a + mu N = 0 and N = m g + c a: the block stops with a = -mu g / (1 + mu c/m)."""
    run = ts.simulate(slider(speed=SPEED, coupling=coupling))
    braking = MU * GRAVITY / (1.0 + MU * coupling)
    assert of_kind(run, EventKind.STICK_BEGINS)["time"] == pytest.approx([SPEED / braking], rel=1e-11)
    series = run.at(np.array([0.5 * SPEED / braking]))
    assert series.contact[0, 0] == pytest.approx(PRESS - coupling * MASS * braking, rel=1e-10)
    assert run.ledger.closure < 1e-12


def test_a_block_whose_friction_would_press_it_down_without_end_jams() -> None:
    """At mu |c| > m no motion follows (Painleve); the run says so, and does not stall."""
    jammed = ts.simulate(slider(speed=SPEED, coupling=-0.6, friction=Friction(coefficient=2.0)))
    assert jammed.code.name == "JAMMED" and "friction" in jammed.code.value
    assert ts.simulate(slider(speed=-SPEED, coupling=-0.6, friction=Friction(coefficient=2.0))).ok


def test_the_path_there_and_back():
    """Thrown along against a force F: back at x = 0 after 2 m v / F, the path m v^2 / F - v T + F T^2 / 2 m by T."""
    speed, force, end = 0.01, 1e-6, 0.03
    scene = moving(block(friction=None, signals={"along": ts.Constant(level=-force)}), block_x=speed)
    run = ts.simulate(scene, duration=end)
    path = MASS * speed**2 / force - speed * end + force * end**2 / (2.0 * MASS)
    assert run.marks["slipped"][-1, 0] == pytest.approx(path, rel=1e-10)


@pytest.mark.parametrize("drive", [0.0, 0.6, 0.95])
def test_a_block_on_a_plane_that_shakes_up_and_along_follows_its_equation(drive):
    """Friction follows the changing load: dv/dt = (F_x - mu N(t))/m while it slides, N = m g - F_z(t)."""
    omega = 2.0 * math.pi * 80.0
    signals = {
        "along": ts.Sine(amplitude=2.0 * MU * PRESS, frequency=80.0),
        "upward": ts.Sine(amplitude=drive * PRESS, frequency=80.0),
    }
    run = ts.simulate(block(signals=signals), duration=0.02)
    begin, end = (
        of_kind(run, EventKind.SLIP_BEGINS)[0]["time"],
        of_kind(run, EventKind.STICK_BEGINS, EventKind.SLIP_BEGINS)[1]["time"],
    )

    def excess(t):
        return 2.0 * math.sin(omega * t) - (1.0 - drive * math.sin(omega * t))

    assert begin == pytest.approx(brentq(excess, 0.0, 0.25 / 80.0, xtol=1e-15), rel=1e-9)

    def speed(t):
        swept = (2.0 + drive) / omega * (math.cos(omega * begin) - math.cos(omega * t))
        return MU * GRAVITY * (swept - (t - begin))

    assert end == pytest.approx(brentq(speed, 1.5 * begin, 1.2 / 80.0, xtol=1e-15), rel=1e-8)


def test_a_walker_that_leaves_the_range_of_its_model_says_so():
    scene = trotter(legs=3, ground=sticky(adhesion=None))
    assert ts.simulate(scene).remarks == ()
    velocity = np.zeros(scene.robot.structure.size)
    velocity[3] = 1000.0  # rad/s
    spun = scene.model_copy(update={"initial": Initial(velocity=tuple(velocity))})
    remark = ts.simulate(spun, duration=0.01).remarks[-1]
    assert remark.startswith("The run leaves its model's range: tilt") and "small angles" in remark
    (heaved,) = ts.simulate("millipede", volts=40).remarks  # its body cannot tilt
    assert "heave span 896.4 µm, and the model holds for a heave span below 600 µm (hips 2 mm apart" in heaved
