"""A ground that rises: closed forms of feet that slide, stick and hang, and of walkers that stand on it."""

from __future__ import annotations

import math

import numpy as np
import pytest

import tarsus as ts
from sliding_scenes import MASS, slider
from tarsus.base.errors import InputError
from tarsus.base.events import EventKind
from tarsus.base.spec import with_values
from tarsus.model.laws import Friction
from tarsus.model.scene import Initial, Scene, Standing
from tarsus.model.structure import Walker
from walking_scenes import GRAVITY, block, sticky, trotter

MU = 0.3
BARELY = 1e-9
"""Part of a force by which it passes its threshold: a run counts 1e-13 of the largest force as none."""


def inclined(scene: Scene, angle: float, **laws: object) -> Scene:
    ground = scene.ground.model_copy(update={"incline": angle, **laws})
    return scene.model_copy(update={"ground": ground})


def kinds(run: ts.Run) -> list[EventKind]:
    assert run.ok, run.code
    return [EventKind(kind) for kind in run.events["kind"]]


@pytest.mark.parametrize("scene", [block(), slider(friction=Friction(coefficient=MU))], ids=["legged", "modal"])
@pytest.mark.parametrize("up", [1.0, -1.0])
def test_a_foot_slips_where_the_tangent_passes_friction(scene: Scene, up: float) -> None:
    critical = math.atan(MU)
    held = ts.simulate(inclined(scene, up * (critical - BARELY)), 0.1)
    assert EventKind.SLIP_BEGINS not in kinds(held)
    assert held.at(np.array([0.1])).foot_x[0, 0] == 0.0
    slips = ts.simulate(inclined(scene, up * (critical + BARELY)), 0.1)
    assert kinds(slips)[-1] is EventKind.SLIP_BEGINS
    angle = 2.0 * critical
    run = ts.simulate(inclined(scene, up * angle), 0.1)
    down = 0.5 * GRAVITY * (math.sin(angle) - MU * math.cos(angle)) * 0.1**2
    assert run.at(np.array([0.1])).foot_x[0, 0] == pytest.approx(-up * down, rel=1e-10)
    assert run.ledger.closure < 1e-12
    path = MU * MASS * GRAVITY * math.cos(angle) * down
    assert run.ledger.friction == pytest.approx(path, rel=1e-10)


@pytest.mark.parametrize("scene", [block(), slider()], ids=["legged", "modal"])
@pytest.mark.parametrize(("degrees", "share"), [(90.0, MU), (135.0, None), (180.0, 1.0), (-90.0, MU)])
def test_a_wall_holds_while_adhesion_bears_the_weight(scene: Scene, degrees: float, share: float | None) -> None:
    """On a wall mu f_a >= m g, under a ceiling f_a >= m g, between them m g |sin a| <= mu (f_a + m g cos a)."""
    angle = math.radians(degrees)
    needed = MASS * GRAVITY / (share or 1.0)
    if share is None:
        needed = MASS * GRAVITY * (abs(math.sin(angle)) / MU - math.cos(angle))
    friction = Friction(coefficient=MU)
    for by, stays in ((1.0 + BARELY, True), (1.0 - BARELY, False)):
        hold = ts.Adhesion(initial=needed * by, rate=0.0)
        run = ts.simulate(inclined(scene, angle, adhesion=hold, friction=friction), 0.01)
        moved = run.motion.last - run.motion.acting.rows.initial[0]
        if scene.name == "block":  # its body hangs on nothing
            moved = moved[[2, 3, 6, 7]]
        assert np.any(moved != 0.0) != stays
        assert run.ledger.closure < 1e-8


@pytest.mark.parametrize("degrees", [0.0, 20.0, -30.0])
def test_a_walker_stands_on_an_incline(degrees: float) -> None:
    """The body hangs back by its weight along the ground over the springs along, and nothing moves for good."""
    angle = math.radians(degrees)
    scene = inclined(trotter(4, ground=sticky(friction=Friction(coefficient=0.8))), angle)
    run = ts.simulate(scene.model_copy(update={"initial": Initial(standing=Standing()), "signals": {}}))
    assert set(kinds(run)) == {EventKind.CONTACT_AT_START}
    walker = run.scene.robot.structure
    assert isinstance(walker, Walker)
    start = run.motion.acting.rows.initial[0]
    forces = run.plan.system.stiffness @ start[: walker.size] - run.plan.system.constant
    free = [i for i in range(walker.size) if i < walker.body_size]
    assert np.abs(forces[free]).max() < 1e-12 * np.abs(run.plan.system.constant).max()
    scale = np.abs(start).max()
    assert np.abs(run.motion.last[: walker.size] - start[: walker.size]).max() < 1e-9 * scale
    springs = sum(leg.stiffness_l for leg in walker.legs.values())
    if degrees == 0.0:
        assert start[0] == 0.0
    else:  # the pitch of the body moves its hips as well
        lift = start[0] - 1e-4 * start[3]
        assert lift == pytest.approx(-walker.body.mass * GRAVITY * math.sin(angle) / springs, rel=0.05)


def test_degrees_are_read_and_what_is_missing_is_said() -> None:
    assert ts.Ground(gravity=ts.Gravity(), incline="30 deg").incline == pytest.approx(math.pi / 6.0)
    with pytest.raises(InputError, match=r"ground.incline: .*give ground.gravity"):
        with_values(slider(gravity=None), {"ground.incline": 0.1})
    bare = slider().robot.structure.model_copy(update={"forward": None})
    with pytest.raises(InputError, match=r"robot.structure.forward: gravity on an incline"):
        with_values(inclined(slider(), 0.1), {"robot.structure": bare})
