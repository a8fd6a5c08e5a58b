"""Walkers whose bodies have modes, payloads on springs and legs with compliant tips, against contact modes and closed
forms."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import tarsus as ts
from sliding_scenes import by_modes
from tarsus.base.errors import InputError
from tarsus.base.events import EventKind
from tarsus.model.laws import ElectroAdhesion, Friction
from tarsus.model.scene import Initial, Scene, Standing
from tarsus.model.structure import Lumped, WalkerMode
from tarsus.model.structure.body_modes import body_modes
from walking_bodies import BAG, BODIES, TIP, with_body
from walking_scenes import GRAVITY, block, sticky, trotter


def same_walk(scene: Scene, duration: float, within: float) -> tuple[ts.Run, ts.Run]:
    """Both engines, event by event."""
    tight = ts.Accuracy(gap=1e-11, drive=1e-11)
    legged, modal = (ts.simulate(one, duration, tight) for one in (scene, by_modes(scene)))
    assert legged.ok and modal.ok, (legged.code, modal.code)
    for name in ("foot", "kind"):
        np.testing.assert_array_equal(legged.events[name], modal.events[name])
    np.testing.assert_allclose(legged.events["time"], modal.events["time"], rtol=0.0, atol=within * duration)
    assert max(legged.ledger.closure, modal.ledger.closure) < 1e-8
    return legged, modal


@pytest.mark.parametrize("body", BODIES)
def test_both_engines_agree_on_bodies_that_are_not_rigid(body: str) -> None:
    legged, modal = same_walk(with_body(trotter(3), **BODIES[body]), 0.006, 1e-9)
    assert len(legged.events) >= 10
    for term in ("work_in", "damping", "friction", "impacts", "kinetic", "elastic"):
        size = abs(legged.ledger.work_in)
        assert getattr(legged.ledger, term) == pytest.approx(getattr(modal.ledger, term), abs=1e-8 * size)


def test_both_engines_agree_on_adhesion_by_volts() -> None:
    pads = {"electro_adhesion": ElectroAdhesion(initial=0.0, coefficient=5e-9)}
    legged, _ = same_walk(trotter(3, ground=sticky(adhesion=None, laws=pads)), 0.01, 1e-9)
    assert {EventKind.RELEASE, EventKind.CAPTURE} <= set(legged.events["kind"].tolist())


def floating(body: dict[str, Any], **start: float) -> Scene:
    """A body without weight on a leg that nothing ties to it, so that its foot stays in the air; start: velocities of
    coordinates of the body [m/s]."""
    scene = with_body(block(), **body)
    walker = scene.robot.structure
    speeds = np.zeros(walker.size)
    for name, speed in start.items():
        speeds[walker.body_coordinates.index(name)] = speed
    feet = {name: foot.model_copy(update={"gap": 1e-6}) for name, foot in scene.robot.feet.items()}
    return scene.model_copy(
        update={
            "initial": Initial(velocity=tuple(speeds)),
            "robot": scene.robot.model_copy(update={"feet": feet}),
            "ground": scene.ground.model_copy(update={"gravity": None}),
        }
    )


def test_a_payload_and_a_mode_ring_as_they_do_alone() -> None:
    """Of a free body M with a payload m the difference rings at k (1/M + 1/m); a mode at its own frequency."""
    bag = BAG.model_copy(update={"damping_v": 0.0})
    mode = WalkerMode(frequency=300.0, damping_ratio=0.05, mass=1e-7)
    run = ts.simulate(floating({"payloads": {"bag": bag}, "modes": {"bends": mode}}, bag=1e-3, bends=2e-3), 0.05)
    times = np.linspace(0.0, 0.05, 60)
    seen = dict(zip(run.scene.robot.structure.body_coordinates, run.at(times).body, strict=True))
    mass = run.scene.robot.structure.body.mass
    rate = math.sqrt(bag.stiffness_v * (1.0 / mass + 1.0 / bag.mass))
    np.testing.assert_allclose(
        seen["bag"] - seen["heave"], 1e-3 / rate * np.sin(rate * times), atol=1e-10 * 1e-3 / rate
    )
    omega, zeta = 2.0 * math.pi * mode.frequency, mode.damping_ratio
    own = omega * math.sqrt(1.0 - zeta**2)
    ringing = 2e-3 / own * np.exp(-zeta * omega * times) * np.sin(own * times)
    np.testing.assert_allclose(seen["bends"], ringing, atol=1e-10 * 2e-3 / own)
    assert run.ledger.closure < 1e-11
    lost = 0.5 * mode.mass * 2e-3**2
    assert run.ledger.damping == pytest.approx(lost, rel=2.0 * math.exp(-2.0 * zeta * omega * 0.05))


def test_a_payload_hangs_into_its_spring_where_a_walker_stands() -> None:
    scene = with_body(trotter(3, ground=sticky(friction=Friction(coefficient=0.8))), payloads={"bag": BAG})
    scene = scene.model_copy(update={"initial": Initial(standing=Standing()), "signals": {}})
    run = ts.simulate(scene, 0.01)
    walker = scene.robot.structure
    assert set(run.events["kind"].tolist()) == {EventKind.CONTACT_AT_START}
    start, last = run.motion.acting.rows.initial[0], run.motion.last
    assert np.abs(last - start)[: walker.size].max() < 1e-9 * np.abs(start).max()
    under = walker.hip_row_z("leg0") * 0.0
    names = walker.body_coordinates
    for name, weight in (("heave", 1.0), ("roll", BAG.y), ("pitch", -BAG.x)):
        under[names.index(name)] = weight
    sag = under @ start[: walker.body_size] - start[names.index("bag")]
    assert sag == pytest.approx(BAG.mass * GRAVITY / BAG.stiffness_v, rel=1e-9)
    pressed = run.at(np.array([0.005])).contact.sum()
    assert pressed == pytest.approx(walker.total_mass * GRAVITY, rel=1e-9)


def test_an_impact_on_a_compliant_tip_takes_half_a_period() -> None:
    """The tip stops at once, the foot above it in its spring: it leaves after pi sqrt(M / k), as fast as it came."""
    speed, gap = 0.02, 1e-5
    scene = with_body(block(friction=None), tips=("block",))
    walker = scene.robot.structure
    foot = {"block": scene.robot.feet["block"].model_copy(update={"gap": gap})}
    tip = TIP.model_copy(update={"damping_v": 0.0})
    legs = {"block": walker.legs["block"].model_copy(update={"tip": tip})}
    speeds = -speed * (walker.row("block") + walker.row("block_ankle"))
    scene = scene.model_copy(
        update={
            "initial": Initial(velocity=tuple(speeds)),
            "ground": ts.Ground(),
            "robot": scene.robot.model_copy(
                update={"feet": foot, "structure": walker.model_copy(update={"legs": legs})}
            ),
        }
    )
    run = ts.simulate(scene, 0.01)
    assert run.ok, run.code
    assert run.events["kind"][:2].tolist() == [EventKind.CAPTURE, EventKind.RELEASE]
    mass = walker.legs["block"].mass
    assert run.events["time"][0] == pytest.approx(gap / speed, rel=1e-12)
    lasts = run.events["time"][1] - run.events["time"][0]
    assert lasts == pytest.approx(math.pi * math.sqrt(mass / tip.stiffness_v), rel=1e-10)
    assert run.events["energy"][0] == pytest.approx(0.5 * tip.mass * speed**2, rel=1e-10)
    assert run.ledger.closure < 1e-10


def upright(scene: Scene) -> Scene:
    """The scene with drives that act upward alone."""
    drives = {
        name: drive.model_copy(
            update={
                "load": drive.load.model_copy(
                    update={"weights": {p: w for p, w in drive.load.weights.items() if not p.endswith("_x")}}
                )
            }
        )
        for name, drive in scene.robot.drives.items()
    }
    return scene.model_copy(update={"robot": scene.robot.model_copy(update={"drives": drives})})


def test_modes_of_matrices_are_the_payload_that_they_were_made_of() -> None:
    """A body and a payload as two masses, as modes of their free-free motion: the same walk."""
    bag = BAG.model_copy(update={"x": 0.0, "y": 0.0, "z": 0.0, "damping_v": 0.0})
    plain = upright(trotter(3, turning=False, ground=sticky(friction=None)))
    carried = with_body(plain, payloads={"bag": bag})
    body = plain.robot.structure.body
    k = bag.stiffness_v
    free = Lumped(coordinates=("trunk", "top"), mass=(body.mass, bag.mass), stiffness=((k, -k), (-k, k)))
    modes = body_modes(free, 1.0, {leg: "trunk" for leg in plain.robot.structure.legs})
    ((name, mode),) = modes.items()
    assert name == "mode1"
    assert 2.0 * math.pi * mode.frequency == pytest.approx(math.sqrt(k * (1.0 / body.mass + 1.0 / bag.mass)), rel=1e-12)
    heavy = plain.model_copy(
        update={
            "robot": plain.robot.model_copy(
                update={
                    "structure": plain.robot.structure.model_copy(
                        update={"body": body.model_copy(update={"mass": body.mass + bag.mass})}
                    )
                }
            )
        }
    )
    tight = ts.Accuracy(gap=1e-11, drive=1e-11)
    one, other = (ts.simulate(scene, 0.01, tight) for scene in (carried, with_body(heavy, modes=modes)))
    assert len(one.events) > 5
    np.testing.assert_array_equal(one.events["kind"], other.events["kind"])
    np.testing.assert_allclose(one.events["time"], other.events["time"], rtol=0.0, atol=1e-11)


def test_what_a_body_cannot_have_is_said() -> None:
    scene = trotter(3)
    with pytest.raises(InputError, match=r"body.modes.bends.upward.tail: the walker has no leg or payload 'tail'"):
        with_body(scene, modes={"bends": WalkerMode(frequency=1.0, mass=1.0, upward={"tail": 1.0})})
    with pytest.raises(InputError, match="rename the payload"):
        with_body(scene, payloads={"leg0": BAG})
    with pytest.raises(InputError, match="make 18 coordinates above the feet: expected 16 at most"):
        with_body(scene, payloads={f"bag{i}": BAG for i in range(7)})
    coupled = Lumped(
        coordinates=("a", "b", "c"),
        mass=(1.0, 1.0, 1.0),
        stiffness=((1, -1, 0), (-1, 2, -1), (0, -1, 1)),
        damping=((0.1, 0, 0), (0, 0, 0), (0, 0, 0)),
    )
    with pytest.raises(InputError, match="damping couples the modes"):
        body_modes(coupled, 1e-3, {"leg0": "a"})
    with pytest.raises(InputError, match="no mode above"):
        body_modes(coupled, 1e3, {"leg0": "a"})


def test_tools_that_do_not_know_such_robots_say_so(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="mjcf: modes of a walker's body, payloads on springs and compliant tips"):
        ts.export(with_body(trotter(2), payloads={"bag": BAG}), "mjcf", tmp_path, duration=1e-3)
    pads = {"electro_adhesion": ElectroAdhesion(initial=0.0, coefficient=5e-9)}
    scene = by_modes(trotter(2, ground=sticky(adhesion=None, friction=None, laws=pads)))
    feet = {name: foot.model_copy(update={"along": None}) for name, foot in scene.robot.feet.items()}
    scene = scene.model_copy(update={"robot": scene.robot.model_copy(update={"feet": feet})})
    lost = ts.export(scene, "matlab", tmp_path, duration=1e-3).to_dict()["lost"]
    assert any("what holds its feet goes by their volts" in one for one in lost)
