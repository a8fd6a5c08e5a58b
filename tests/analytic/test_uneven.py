"""Uneven ground against closed forms: balls on stairs, sleds on slopes and teeth, feet in corners and pits."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import tarsus as ts
from scene_files import of_kind
from tarsus.base.events import EventKind
from tarsus.base.spec import with_values
from tarsus.model.scene import Scene
from tarsus.model.structure import Walker
from walking_scenes import GRAVITY, block, moving, sticky, trotter

Kind = EventKind
MASS = 1e-6  # of the block


def on(scene: Scene, gap: float | None = None, **profile: Any) -> Scene:
    """A scene on uneven ground, its feet at a height above level ground."""
    given: dict[str, Any] = {"ground.profile": profile}
    if gap is not None:
        given |= {f"robot.feet.{name}.gap": gap for name in scene.robot.feet}
    return with_values(scene, given)


def place(run: ts.Run, time: float) -> float:
    found = run.at(np.array([time])).foot_x
    assert found is not None
    return float(found[0, 0])


def falls(x: float, z: float, vx: float, tread: float, drop: float, ratio: float, until: float) -> list[float]:
    """Times at which a ball bounces on stairs that go down by ``drop`` at tread, 2 tread ..., from rest at x, z."""
    t, vz, out = 0.0, 0.0, []
    while True:
        for k in range(1000):  # the tread that it reaches: the first whose time of fall lies above it
            height = -k * drop
            reach = vz * vz + 2.0 * GRAVITY * (z - height)
            if reach < 0.0:
                continue
            fall = (vz + math.sqrt(reach)) / GRAVITY
            if fall > 0.0 and k * tread <= x + vx * fall < (k + 1) * tread:
                break
        t, x, z, vz = t + fall, x + vx * fall, height, ratio * math.sqrt(reach)
        if t > until:
            return out
        out.append(t)


@pytest.mark.parametrize("ratio", [0.5, 0.9])
def test_a_ball_falls_down_stairs(ratio: float) -> None:
    tread, drop, speed = 10e-3, 4e-3, 0.35
    scene = moving(block(friction=None), block_x=speed)
    scene = with_values(scene, {"ground.restitution.coefficient": ratio})
    run = ts.simulate(on(scene, gap=5e-3, kind="staircase", tread=tread, rise=-drop, start=tread), 0.4)
    expected = falls(0.0, 5e-3, speed, tread, drop, ratio, 0.4)
    assert run.ok and len(expected) >= 3
    assert of_kind(run, Kind.BOUNCE)["time"] == pytest.approx(expected, rel=1e-10)
    assert run.ledger.closure < 1e-8


def test_a_ball_hits_the_side_of_a_step() -> None:
    """Along the way it comes back by the coefficient of restitution; upward it does not notice."""
    scene = moving(block(friction=None), block_x=0.5)
    run = ts.simulate(on(scene, gap=1e-3, kind="staircase", tread=0.1, rise=10e-3, start=5e-3, steps=1), 0.0145)
    side = run.events[0]
    assert side["time"] == pytest.approx(0.01, rel=1e-12)
    assert (side["kind"], side["speed_before"], side["speed_after"]) == pytest.approx((Kind.BOUNCE, 0.5, 0.25))
    assert run.events[1]["time"] == pytest.approx(math.sqrt(2e-3 / GRAVITY), rel=1e-12)
    assert place(run, 0.0145) == pytest.approx(5e-3 - 0.25 * 0.0045, rel=1e-9)
    assert run.ledger.closure < 1e-8


@pytest.mark.parametrize("friction", [None, 0.1])
def test_a_sled_swings_in_a_tooth(friction: float | None) -> None:
    """It slides down with g (sin a - mu cos a), keeps v (cos 2a - mu sin 2a) of its speed in the corner, where it hits
    the next side, and rises with -g (sin a + mu cos a)."""
    half, height = 10e-3, 2e-3
    angle, mu = math.atan2(height, half), friction or 0.0
    scene = with_values(block(friction=friction), {"ground.restitution": None, "robot.feet.block.gap": height / 2})
    sled = on(scene, kind="sawtooth", length=2 * half, height=height, start=-1.5 * half)
    down, up = (GRAVITY * (math.sin(angle) + sign * mu * math.cos(angle)) for sign in (-1.0, 1.0))
    run = ts.simulate(sled, 0.9)
    way, expected, t = math.hypot(half, height) / 2, [], 0.0
    while True:
        t += math.sqrt(2.0 * way / down)
        if t > 0.9 or len(expected) > 8:
            break
        expected.append(t)
        speed = math.sqrt(2.0 * way * down) * (math.cos(2 * angle) - mu * math.sin(2 * angle))
        t += speed / up
        way = 0.5 * speed**2 / up
    assert run.ok and len(expected) >= 4
    assert of_kind(run, Kind.CAPTURE)["time"][: len(expected)] == pytest.approx(expected, rel=1e-9)
    assert run.ledger.closure < 1e-8


def test_a_sled_flies_off_a_ramp() -> None:
    """Over the top of a slope it goes on straight, a parabola, and lands on the level beyond."""
    rise, length, speed = 2e-3, 10e-3, 0.5
    angle = math.atan2(rise, length)
    points = [(0.0, 0.0), (length, rise), (length, 0.0)]
    scene = with_values(moving(block(friction=None), block_x=speed), {"ground.restitution": None})
    run = ts.simulate(on(scene, gap=0.0, kind="polyline", given=points), 0.1)
    v = speed * math.cos(angle)
    top = math.sqrt(v * v - 2.0 * GRAVITY * rise)
    climb = (v - top) / (GRAVITY * math.sin(angle))
    vz = top * math.sin(angle)
    fall = (vz + math.sqrt(vz * vz + 2.0 * GRAVITY * rise)) / GRAVITY
    lands = of_kind(run, Kind.CAPTURE)[-1]
    assert lands["time"] == pytest.approx(climb + fall, rel=1e-10)
    assert place(run, float(lands["time"])) == pytest.approx(length + top * math.cos(angle) * fall, rel=1e-10)
    assert run.ledger.closure < 1e-8


def soft(angle: float, **ground: Any) -> Scene:
    """A body on one leg whose springs and dampers differ in the two directions, on a long slope."""
    scene = trotter(
        1, ground=sticky(**{"adhesion": None, "restitution": None, "friction": None} | ground), turning=False
    )
    high = math.tan(angle)
    scene = with_values(scene, {"signals": {}, "robot.feet.leg0.gap": 0.0})
    return on(scene, kind="polyline", given=[(-1.0, -high), (1.0, high)])


def test_springs_couple_the_directions_of_a_slope() -> None:
    """One leg that slides without friction down a slope: the linear equations of body and foot along the facet."""
    angle, end = 0.4, 4e-3
    scene = soft(angle)
    walker = scene.robot.structure
    assert isinstance(walker, Walker)
    leg = walker.legs["leg0"]
    s, c = math.sin(angle), math.cos(angle)

    def rates(_: float, y: np.ndarray) -> list[float]:
        x, z, place, vx, vz, v = y  # of the body, and of the foot along the slope
        along = leg.stiffness_l * (x - c * place) + leg.damping_l * (vx - c * v)
        up = leg.stiffness_v * (z - s * place) + leg.damping_v * (vz - s * v)
        slide = (c * along + s * (up - leg.mass * GRAVITY)) / leg.mass
        return [vx, vz, v, -along / walker.body.mass, -up / walker.body.mass - GRAVITY, slide]

    run = ts.simulate(scene, end)
    assert run.ok and len(of_kind(run, Kind.RELEASE)) == 0
    found = solve_ivp(rates, (0.0, end), np.zeros(6), method="DOP853", rtol=1e-12, atol=1e-18).y[:, -1]
    n = walker.size
    last = run.motion.last
    assert last[:2] == pytest.approx(found[:2], rel=1e-8)
    assert last[2:4] == pytest.approx([c * found[2], s * found[2]], rel=1e-8)
    assert last[n + 2 : n + 4] == pytest.approx([c * found[5], s * found[5]], rel=1e-7)
    assert run.ledger.closure < 1e-8


@pytest.mark.parametrize("law", ["none", "film"])
def test_a_tilted_world_is_an_incline(law: str) -> None:
    """A leg with equal springs on a slope moves as on level ground whose gravity is turned."""
    angle, end = 0.3, 6e-3
    alike = {f"robot.structure.legs.leg0.{name}_l": value for name, value in (("stiffness", 1.3), ("damping", 3e-6))}
    alike |= {f"robot.structure.legs.leg0.{name}_v": value for name, value in (("stiffness", 1.3), ("damping", 3e-6))}
    laws: dict[str, Any] = {"restitution": ts.Restitution(coefficient=0.5), "friction": ts.Friction(coefficient=0.2)}
    if law == "film":
        laws["film"] = ts.Film(coefficient=2e-26, thickness=1e-7)
    sloped = with_values(soft(angle, **laws), alike)
    level = with_values(sloped, {"ground.profile": None, "ground.incline": angle})
    s, c = math.sin(angle), math.cos(angle)
    # both start 20 um above the ground along its normal, at rest
    height = 20e-6
    level = with_values(level, {"robot.feet.leg0.gap": height})
    sloped = with_values(sloped, {"robot.feet.leg0.gap": height / c})
    one, other = ts.simulate(sloped, end), ts.simulate(level, end)
    assert one.ok and other.ok
    assert one.events["kind"].tolist() == other.events["kind"].tolist() and len(one.events) > 5
    assert one.events["time"] == pytest.approx(other.events["time"], rel=1e-9)
    assert one.events["speed_before"] == pytest.approx(other.events["speed_before"], rel=1e-6, abs=1e-12)
    x, z = one.motion.last[2:4]
    along, up = other.motion.last[2:4]
    assert (c * x + s * z, c * z - s * x) == pytest.approx((along, up), rel=1e-7, abs=1e-13)
    for run in (one, other):
        assert run.ledger.closure < 1e-8


@pytest.mark.parametrize("friction", [None, 0.1])
def test_a_block_waits_in_a_corner(friction: float | None) -> None:
    """Pushed against the side of a step it stops there, stands on both facets, and goes back when it is pulled."""
    push, side, half = 2e-6, 1e-3, 0.05
    mu = friction or 0.0
    scene = with_values(block(friction=friction), {"ground.restitution": None})
    scene = scene.model_copy(update={"signals": {"along": ts.Square(amplitude=push, frequency=0.5 / half)}})
    run = ts.simulate(on(scene, gap=0.0, kind="staircase", tread=1.0, rise=1e-3, start=side, steps=1), 0.09)
    away = push / MASS - mu * GRAVITY
    arrives = of_kind(run, Kind.CAPTURE)[0]
    assert arrives["time"] == pytest.approx(math.sqrt(2.0 * side / away), rel=1e-10)
    assert arrives["speed_before"] == pytest.approx(math.sqrt(2.0 * side * away), rel=1e-10)
    assert place(run, 0.9 * half) == side == place(run, half)
    assert place(run, 0.09) == pytest.approx(side - 0.5 * away * (0.09 - half) ** 2, rel=1e-9)
    assert run.ledger.closure < 1e-8


def test_a_foot_that_both_facets_drive_to_a_ridge_stands_on_it() -> None:
    """A spring pulls it off the ground, and electrostatics hold it: it slides to the ridge, stands there, and leaves
    when neither facet holds it. It went to and fro on the ridge in no time, without end."""
    hold, spring, push, rise, slope, beside = 4e-6, 1e-6, 6e-6, 0.1, 0.2, 5e-6
    leg = ts.structures.WalkerLeg(
        x=-beside, mass=1e-9, stiffness_v=1.0, damping_v=1e-4, stiffness_l=0.01, damping_l=1e-4
    )
    load = ts.PointLoad(weights={"L": 1.0})
    drives = {name: ts.Drive(load=load, law=ts.LinearForce(gain=gain)) for name, gain in (("volts", 0.0), ("up", 1.0))}
    line = {"kind": "polyline", "given": [[-1e-3, -slope * 1e-3], [0.0, 0.0], [1e-3, -slope * 1e-3]]}
    scene = Scene(
        name="ridge",
        duration=rise,
        robot=ts.Robot(
            structure=Walker(body=ts.structures.WalkerBody(mass=1e6), legs={"L": leg}),
            drives=drives,
            feet={"L": ts.Foot(point="L", gap=spring, electrode="volts")},
        ),
        signals={"volts": ts.Constant(level=10.0), "up": {"kind": "ramp", "stop": push, "duration": rise}},
        ground={"electrostatic": {"coefficient": hold * 1e-12, "offset": 1e-5}, "profile": line},
    )
    run = ts.simulate(scene)
    assert run.ok and run.ledger.closure < 1e-8 and len(run.events) < 100
    assert place(run, 0.02) == place(run, 0.05) == pytest.approx(beside, rel=1e-12)
    cos, sin = math.cos(math.atan(slope)), math.sin(math.atan(slope))
    leaves = (hold + 0.01 * beside * sin) / cos - spring
    assert of_kind(run, Kind.RELEASE)["time"][-1] == pytest.approx(rise * leaves / push, rel=1e-8)
    assert run.series.state.gap[0, -1] > 1e-7
