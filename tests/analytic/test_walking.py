"""Closed forms and equivalences of the walking engine."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.optimize import brentq

import tarsus as ts
from tarsus.model.laws import Friction
from tarsus.model.scene import Initial
from walking_scenes import GRAVITY, block, moving, sticky, trotter

BOUNCE, CAPTURE, RELEASE, REST, AT_START, SLIP, STICK = 1, 2, 3, 4, 5, 7, 8
MASS, MU = 1e-6, 0.3


def of_kind(run, *kinds):
    return run.events[np.isin(run.events["kind"], kinds)]


def test_the_path_there_and_back():
    """Thrown along against a force F: back at x = 0 after 2 m v / F, the path m v^2 / F - v T + F T^2 / 2 m by T."""
    speed, force, end = 0.01, 1e-6, 0.03
    scene = moving(block(friction=None, signals={"along": ts.Constant(level=-force)}), block_x=speed)
    run = ts.simulate(scene, duration=end)
    path = MASS * speed**2 / force - speed * end + force * end**2 / (2.0 * MASS)
    assert run.marks["slipped"][-1, 0] == pytest.approx(path, rel=1e-10)


@pytest.mark.parametrize("above", [0.999, 1.001])
def test_a_block_on_a_vibrating_plane_slips_when_friction_cannot_carry_it(above):
    """In the plane's frame the block feels m A w^2 sin(w t)."""
    frequency = 50.0
    omega, push = 2.0 * math.pi * frequency, above * MU * MASS * GRAVITY
    scene = block(signals={"along": ts.Sine(amplitude=push, frequency=frequency)})
    run = ts.simulate(scene, duration=0.9 / frequency)
    if above < 1.0:
        assert not len(of_kind(run, SLIP))
        assert run.marks["slipped"][-1, 0] == 0.0
        return
    begin, end = of_kind(run, SLIP)[0], of_kind(run, STICK)[0]
    onset = math.asin(1.0 / above) / omega
    assert begin["time"] == pytest.approx(onset, rel=1e-9)

    def speed(t):
        swept = push / (MASS * omega) * (math.cos(omega * onset) - math.cos(omega * t))
        return swept - MU * GRAVITY * (t - onset)

    assert end["time"] == pytest.approx(brentq(speed, onset * 1.01, 0.5 / frequency, xtol=1e-15), rel=1e-7)


@pytest.mark.parametrize("drive", [0.6, 0.95])
def test_a_block_on_a_plane_that_shakes_up_and_along_follows_its_equation(drive):
    """Friction follows the changing load: dv/dt = (F_x - mu N(t))/m while it slides, N = m g - F_z(t)."""
    omega = 2.0 * math.pi * 80.0
    weight = MASS * GRAVITY
    signals = {
        "along": ts.Sine(amplitude=2.0 * MU * weight, frequency=80.0),
        "upward": ts.Sine(amplitude=drive * weight, frequency=80.0),
    }
    run = ts.simulate(block(signals=signals), duration=0.02)
    begin, end = of_kind(run, SLIP)[0]["time"], of_kind(run, STICK, SLIP)[1]["time"]

    def excess(t):
        return 2.0 * math.sin(omega * t) - (1.0 - drive * math.sin(omega * t))

    assert begin == pytest.approx(brentq(excess, 0.0, 0.25 / 80.0, xtol=1e-15), rel=1e-9)

    def speed(t):
        swept = (2.0 + drive) / omega * (math.cos(omega * begin) - math.cos(omega * t))
        return MU * GRAVITY * (swept - (t - begin))

    assert end == pytest.approx(brentq(speed, 1.5 * begin, 1.2 / 80.0, xtol=1e-15), rel=1e-8)


def test_no_foot_goes_below_the_ground_and_no_stuck_foot_drifts():
    run = ts.simulate(trotter(legs=6, ground=sticky(friction=Friction(coefficient=0.2))), duration=0.04)
    series = run.at(np.linspace(0.0, 0.04, 20001))
    gap, held = series.state.gap, series.state.held
    assert gap.min() > -1e-12
    assert held.any() and not held.all()
    assert np.all(gap[held] == 0.0)
    stuck = held & ~series.slipping
    both = stuck[:, 1:] & stuck[:, :-1]
    for foot in range(6):
        events = run.events[run.events["foot"] == foot]["time"]
        apart = np.searchsorted(events, series.time[1:]) != np.searchsorted(events, series.time[:-1])
        still = both[foot] & ~apart
        assert still.any()
        assert np.all(np.diff(series.foot_x[foot])[still] == 0.0)
    assert series.slipping.any()
    bound = 0.2 * np.maximum(series.contact + series.strength, 0.0)
    assert np.all(np.abs(series.friction[held]) <= bound[held] * (1.0 + 1e-9) + 1e-15)


def test_one_foot_lets_go_while_others_hold():
    """Only the driven foot is pulled off; the rest of them stay where they stick."""
    scene = trotter(legs=3, ground=sticky(adhesion=ts.Adhesion(initial=2e-6, rate=0.0)), turning=False)
    feet = {name: foot.model_copy(update={"gap": 0.0}) for name, foot in scene.robot.feet.items()}
    signals = {"leg1": ts.Sine(amplitude=14.0, frequency=100.0, phase=math.pi)}
    robot = scene.robot.model_copy(update={"feet": feet})
    lifted = scene.model_copy(update={"signals": signals, "robot": robot})
    run = ts.simulate(lifted, duration=5e-3)
    gone = of_kind(run, RELEASE)
    assert gone["foot"][0] == 1
    assert gone["pull"][0] == pytest.approx(2e-6, rel=1e-9)
    held = run.at(np.array([gone["time"][0] * (1.0 + 1e-6)])).state.held[:, 0]
    assert held.tolist() == [True, False, True]


def test_a_walker_that_leaves_small_angles_says_so():
    scene = trotter(legs=3, ground=sticky(adhesion=None))
    assert ts.simulate(scene).remarks == ()
    velocity = np.zeros(scene.robot.structure.size)
    velocity[3] = 1000.0  # rad/s
    spun = scene.model_copy(update={"initial": Initial(velocity=tuple(velocity))})
    remark = ts.simulate(spun, duration=0.01).remarks[-1]
    assert remark.startswith("The body's pitch reached") and "small angles" in remark
