"""Legs at an angle, as of bristle robots: pressed down they drive the body along, which way the frequency decides."""

from __future__ import annotations

import math

import pytest

import tarsus as ts
from independent.compare import compare
from tarsus.measure import point_speed
from tarsus.model.structure import WalkerBody, WalkerLeg, WalkerTip

TILT = 30.0  # deg
HARD, SOFT = 8e3, 0.4e3  # of a bristle, along it and across it [N/m]
WEIGHT = 9.81e-3  # of the body [N]


def bristle(x: float, tilt: float) -> WalkerLeg:
    stiff = {"stiffness_v": 2e4, "damping_v": 0.1, "stiffness_l": 2e4, "damping_l": 0.1}
    own = {"stiffness_v": HARD, "damping_v": 0.06, "stiffness_l": SOFT, "damping_l": 0.04}
    return WalkerLeg(x=x, mass=2e-6, tilt=math.radians(tilt), tip=WalkerTip(mass=5e-7, **stiff), **own)


def robot(wave: dict[str, object], duration: float = 0.5, tilt: float = TILT, friction: float = 0.3) -> ts.Scene:
    """A body of 1 g on two bristles, which a force shakes up and down: 1 V is its weight."""
    legs = {"front": bristle(5e-3, tilt), "hind": bristle(-5e-3, tilt)}
    motor = ts.Drive(load=ts.PointLoad(weights={"body": 1.0}), law=ts.LinearForce(gain=WEIGHT))
    return ts.Scene(
        name="bristles",
        duration=duration,
        robot=ts.Robot(
            structure=ts.Walker(body=WalkerBody(mass=1e-3), legs=legs),
            drives={"motor": motor},
            feet={name: ts.Foot(point=name, gap=0.0) for name in legs},
        ),
        ground={
            "gravity": {"acceleration": 9.81},
            "restitution": {"coefficient": 0.0},
            "friction": {"coefficient": friction},
        },
        signals={"motor": wave},
        initial={"standing": {}},
    )


def shaken(hertz: float, **options: float) -> ts.Scene:
    return robot({"kind": "sine", "amplitude": "0.9 V", "frequency": hertz}, **options)


@pytest.mark.parametrize("tilt", [-50.0, 0.0, 10.0, 30.0])
def test_a_body_that_is_pressed_down_goes_along(tilt):
    """By F sin cos (1 / across - 1 / along) a bristle, on tips that stick: forward where feet are behind their hips."""
    press = 0.5 * WEIGHT
    slow = {"kind": "ramp", "start": "0 V", "stop": "-1 V", "duration": "0.4 s"}
    run = ts.simulate(robot(slow, tilt=tilt, friction=3.0))
    at = run.scene.robot.structure.row("body_x")
    moved = float(at @ (run.states([0.49]).x[:, 0] - run.states([0.0]).x[:, 0]))
    turn = math.radians(tilt)
    expected = press * math.sin(turn) * math.cos(turn) * (1.0 / SOFT - 1.0 / HARD)
    assert moved == pytest.approx(expected, rel=1e-3, abs=1e-12)


def test_motion_reverses_over_the_frequency_and_with_the_tilt():
    """The field's best-known curve: backward below the resonance of the body on its bristles, forward above."""
    speeds = [point_speed(ts.simulate(shaken(hertz)), "body_x", 0.2, 0.5) for hertz in (80.0, 110.0, 170.0, 300.0)]
    assert max(speeds[:2]) < -1e-3 < 5e-3 < min(speeds[2:])
    there, back = (
        point_speed(ts.simulate(shaken(300.0, duration=0.1, tilt=tilt)), "body_x", 0.0, 0.1) for tilt in (30, -30)
    )
    assert back == pytest.approx(-there, rel=1e-6)


@pytest.mark.full  # 9 s each: the other simulator's steps
@pytest.mark.parametrize("hertz", [80.0, 300.0])
def test_the_second_simulator_walks_on_bristles_alike(hertz):
    """Bristles that differ slip one by one; their tips are softer than elsewhere here, for the other's small steps."""
    legs = {"front": {"tilt": 0.4}, "hind": {"stiffness_v": 0.9 * HARD}}
    changes = {f"{leg}.{name}": value for leg, own in legs.items() for name, value in own.items()}
    soft = {"mass": 5e-6, "stiffness_v": 2e3, "stiffness_l": 2e3}
    changes |= {f"{leg}.tip.{name}": value for leg in legs for name, value in soft.items()}
    scene = shaken(hertz, duration=0.008)
    found = compare(ts.with_values(scene, {f"robot.structure.legs.{at}": to for at, to in changes.items()}))
    assert found.wrong is None and found.compared == found.events >= 12


def test_a_leg_at_an_angle_has_a_tip():
    with pytest.raises(ts.InputError, match=r"legs\.front\.tilt: a leg at an angle has a compliant tip"):
        ts.with_values(shaken(80.0), {"robot.structure.legs.front.tip": None})
