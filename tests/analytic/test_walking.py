"""Closed forms and equivalences of the walking engine."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.optimize import brentq

import tarsus as ts
from tarsus.model.scene import Initial
from walking_scenes import GRAVITY, block, moving, sticky, trotter

SLIP, STICK = 7, 8
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


@pytest.mark.parametrize("drive", [0.0, 0.6, 0.95])
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


def test_a_walker_that_leaves_small_angles_says_so():
    scene = trotter(legs=3, ground=sticky(adhesion=None))
    assert ts.simulate(scene).remarks == ()
    velocity = np.zeros(scene.robot.structure.size)
    velocity[3] = 1000.0  # rad/s
    spun = scene.model_copy(update={"initial": Initial(velocity=tuple(velocity))})
    remark = ts.simulate(spun, duration=0.01).remarks[-1]
    assert remark.startswith("The body's pitch reached") and "small angles" in remark
