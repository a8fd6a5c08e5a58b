"""Friction borne by adhesion alone: |F_t| <= mu_a f_a(t - t_c), whatever the push."""

from __future__ import annotations

import numpy as np
import pytest

import tarsus as ts
from tarsus.base.errors import InputError
from tarsus.files.toml import parse_scene, scene_text
from tarsus.model.laws import AdhesiveFriction
from walking_scenes import GRAVITY, block, sticky, trotter

RELEASE, SLIP = 3, 7
MASS, MU_A = 1e-6, 0.4
INITIAL, RATE = 2e-6, 3e-5
PUSH = 4e-4  # [N/s] along the ground


def held(gravity: float = GRAVITY, **signals) -> ts.Scene:
    ground = ts.Ground(
        gravity=ts.Gravity(acceleration=gravity),
        adhesion=ts.Adhesion(initial=INITIAL, rate=RATE),
        friction=AdhesiveFriction(coefficient=MU_A),
    )
    return block(ground=ground, signals=signals)


@pytest.mark.parametrize("gravity", [0.1, GRAVITY])
def test_a_foot_pushed_ever_harder_slips_when_adhesion_carries_no_more(gravity: float) -> None:
    """r t = mu_a (C_a0 + C_a t); from there on m v' = (r - mu_a C_a)(t - t_slip)."""
    scene = held(gravity, along=ts.waveforms.Ramp(stop=0.02 * PUSH, duration=0.02))
    onset = MU_A * INITIAL / (PUSH - MU_A * RATE)
    run = ts.simulate(scene, duration=2.0 * onset)
    slip = run.events[run.events["kind"] == SLIP]
    assert slip["time"] == pytest.approx([onset], rel=1e-12)
    assert slip["strength"] == pytest.approx([MU_A * (INITIAL + RATE * onset)], rel=1e-12)
    path = (PUSH - MU_A * RATE) * onset**3 / (6.0 * MASS)
    assert run.marks["slipped"][-1, 0] == pytest.approx(path, rel=1e-9)
    times = np.linspace(onset, 2.0 * onset, 40001)
    speed = (PUSH - MU_A * RATE) * (times - onset) ** 2 / (2.0 * MASS)
    lost = np.trapezoid(MU_A * (INITIAL + RATE * times) * speed, times)
    assert run.ledger.friction == pytest.approx(lost, rel=1e-7)
    assert run.ledger.closure < 1e-12
    series = run.at(np.array([0.5 * onset, 1.5 * onset]))
    assert series.friction[0] == pytest.approx([-0.5 * PUSH * onset, -MU_A * (INITIAL + RATE * 1.5 * onset)])


@pytest.mark.parametrize("share", [0.5, 1.01])
def test_friction_lasts_until_the_foot_is_pulled_off(share: float) -> None:
    """The bound does not know how close the pull is to the strength."""
    lift = ts.waveforms.Ramp(stop=2.0 * MASS * GRAVITY, duration=0.02)
    scene = held(along=ts.Constant(level=share * MU_A * INITIAL), upward=lift)
    run = ts.simulate(scene, duration=0.015)
    off = (MASS * GRAVITY + INITIAL) / (MASS * GRAVITY / 0.01 - RATE)
    later = run.events[run.events["time"] > 0.0]
    assert later["time"][later["kind"] == RELEASE] == pytest.approx([off], rel=1e-10)
    assert (SLIP in run.events["kind"]) == (share > 1.0)


def test_adhesive_friction_needs_adhesion() -> None:
    scene = trotter(ground=sticky(friction=AdhesiveFriction(coefficient=0.7)))
    with pytest.raises(InputError) as caught:
        ts.with_values(scene, {"ground.adhesion": None})
    assert caught.value.problems == [
        "ground.friction: adhesive friction needs adhesion: give ground.adhesion or an adhesion law of your own"
    ]
    with pytest.raises(InputError, match=r"^ground\.friction.*'glue'"):
        parse_scene(scene_text(scene).replace('"adhesive"', '"glue"'))
    bare = scene.ground.without_adhesion
    assert bare.adhesion is None and bare.friction is None
    assert sticky().without_adhesion.friction == sticky().friction
