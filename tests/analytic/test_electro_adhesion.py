"""Feet that adhere as much as their volts command: closed forms of walls and ceilings that hold and let go."""

from __future__ import annotations

import math

import numpy as np
import pytest

import tarsus as ts
from sliding_scenes import MASS, slider
from tarsus.base.errors import InputError
from tarsus.base.events import EventKind
from tarsus.model.drive.laws import LinearForce
from tarsus.model.drive.waveforms import Ramp, Waveform
from tarsus.model.laws import ElectroAdhesion, Friction
from tarsus.model.scene import Drive, PointLoad, Scene
from walking_scenes import GRAVITY, block, trotter

MU = 0.3
K = 2e-9  # N/V^2
WEIGHT = MASS * GRAVITY
SYSTEMS = {"legged": block(friction=MU), "modal": slider(friction=Friction(coefficient=MU))}


def padded(scene: Scene, degrees: float, pad: Waveform) -> Scene:
    """The block on an incline, its foot a pad under the volts of a drive of its own, which pushes nothing."""
    ((name, foot),) = scene.robot.feet.items()
    drive = Drive(load=PointLoad(weights={foot.point: 0.0}), law=LinearForce(gain=0.0))
    changes = {
        "robot.drives.pad": drive,
        f"robot.feet.{name}.electrode": "pad",
        "ground.incline": math.radians(degrees),
        "ground.laws": {"electro_adhesion": ElectroAdhesion(initial=0.0, coefficient=K)},
        "signals": {"pad": pad},
        "duration": 0.1,
    }
    return ts.with_values(scene, changes)


def first(run: ts.Run, kind: EventKind) -> np.void:
    assert run.ok, run.code
    return run.events[run.events["kind"] == kind][0]


@pytest.fixture(params=SYSTEMS, name="scene")
def _scene(request: pytest.FixtureRequest) -> Scene:
    return SYSTEMS[request.param]


def test_a_ceiling_holds_as_long_as_the_strength_exceeds_the_weight(scene: Scene) -> None:
    high, time = 120.0, 0.05
    run = ts.simulate(padded(scene, 180.0, Ramp(start=high, stop=0.0, duration=time)))
    lets_go = time * (1.0 - math.sqrt(WEIGHT / K) / high)
    release = first(run, EventKind.RELEASE)
    assert release["time"] == pytest.approx(lets_go, rel=1e-12)
    assert release["strength"] == pytest.approx(WEIGHT, rel=1e-12)
    fallen = run.at(np.array([lets_go + 0.01]))
    assert fallen.state.gap[0, 0] == pytest.approx(0.5 * GRAVITY * 0.01**2, rel=1e-9)
    assert run.ledger.closure < 1e-12
    held = run.at(np.array([0.01]))
    assert held.strength[0, 0] == pytest.approx(K * (high * 0.8) ** 2, rel=1e-12)
    assert held.contact[0, 0] == pytest.approx(-WEIGHT, rel=1e-12)


@pytest.mark.parametrize("share", [1.0 + 1e-9, 1.0 - 1e-9])
def test_a_foot_is_released_at_the_moment_at_which_the_channel_falls(scene: Scene, share: float) -> None:
    """To a level that holds by a billionth the foot stays; to one that does not it leaves at the edge itself."""
    least = math.sqrt(WEIGHT / K)
    pad = ts.OnOff(levels=(2.0 * least, least * math.sqrt(share)), durations=(0.0123, 1.0))
    run = ts.simulate(padded(scene, 180.0, pad), 0.05)
    releases = run.events[run.events["kind"] == EventKind.RELEASE]
    if share > 1.0:
        assert run.ok and len(releases) == 0
    else:
        assert releases["time"][0] == pytest.approx(0.0123, rel=1e-14)


@pytest.mark.parametrize("weight", [1e-1, 1e-4, 1e-7])
def test_volts_that_pass_through_zero_let_go_however_shortly(scene: Scene, weight: float) -> None:
    """V = A cos w t holds until K V^2 falls to the weight; at 1e-7 of the most for 2e-4 of a period alone."""
    high, hertz = math.sqrt(WEIGHT / (K * weight)), 40.0
    run = ts.simulate(padded(scene, 180.0, ts.Sine(amplitude=high, frequency=hertz, phase=0.5 * math.pi)), 0.02)
    lets_go = math.acos(math.sqrt(weight)) / (2.0 * math.pi * hertz)
    assert first(run, EventKind.RELEASE)["time"] == pytest.approx(lets_go, rel=1e-7)


def test_a_wall_holds_while_friction_bears_the_weight_and_brakes_afterwards(scene: Scene) -> None:
    """mu K V^2 >= m g; below, m v' = mu K V(t)^2 - m g along the wall, and friction takes its work."""
    high, time, end = 200.0, 0.1, 0.09
    run = ts.simulate(padded(scene, 90.0, Ramp(start=high, stop=0.0, duration=time)), end)
    slips = time * (1.0 - math.sqrt(WEIGHT / (MU * K)) / high)
    assert first(run, EventKind.SLIP_BEGINS)["time"] == pytest.approx(slips, rel=1e-12)
    times, weights = np.polynomial.legendre.leggauss(20)
    at = 0.5 * (end - slips) * (times + 1.0) + slips
    weights = 0.5 * (end - slips) * weights
    braking = MU * K * (high * (1.0 - at / time)) ** 2
    pushed = (braking - WEIGHT) / MASS
    place = float(weights @ (pushed * (end - at)))
    assert run.at(np.array([end])).foot_x[0, 0] == pytest.approx(place, rel=1e-9)
    assert run.ledger.closure < 1e-12
    fallen = -place * WEIGHT - 0.5 * MASS * float(weights @ pushed) ** 2
    assert run.ledger.friction == pytest.approx(fallen, rel=1e-8)


def test_a_pad_takes_what_its_capacitance_stores_and_no_work(scene: Scene) -> None:
    """C V^2 / 2 once it is charged; the ledger of a block that hangs still is empty."""
    capacitance, high = 1e-9, 150.0
    pad = ts.OnOff(levels=(0.0, high), durations=(0.001, 1.0))
    standing = ts.with_values(padded(scene, 0.0, pad), {"robot.drives.pad.capacitance": capacitance})
    run = ts.simulate(standing, 0.01)
    moved = 0.0 if scene.name == "slider" else 0.5 * GRAVITY * 0.01**2  # the block's body falls beside it
    assert run.electrical_energy == pytest.approx(0.5 * capacitance * high**2, rel=1e-9)
    assert run.ledger.work_in == pytest.approx(MASS * GRAVITY * moved, rel=1e-9, abs=1e-18)


def test_a_pad_needs_an_electrode_and_has_no_return_map() -> None:
    law = {"ground.laws.electro_adhesion": ElectroAdhesion(initial=0.0, coefficient=K)}
    with pytest.raises(InputError, match="give a foot its electrode"):
        ts.with_values(block(), law)
    ringing = ts.with_values(trotter(2), law)
    with pytest.raises(InputError, match="no return map where volts command how strongly feet adhere"):
        ts.periodic(ringing)
