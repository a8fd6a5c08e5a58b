"""Ground that moves: closed forms, and motions that are integrated in the laboratory."""

from __future__ import annotations

import itertools
import math
from typing import Any

import numpy as np
import pytest
from scipy.optimize import brentq

import tarsus as ts
from scene_files import scene

G = 9.81


def shaken(shift: dict[str, Any], values: dict[str, Any] | None = None) -> ts.Scene:
    """The ball of the tests above ground that moves along its normal."""
    return scene("ball", {"ground.motion": {"normal": shift}, **(values or {})})


# --- balls ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("e", [0.3, 0.5, 0.8])
def test_a_ball_on_a_shaker_comes_back_every_period(e: float) -> None:
    """Period one: A w^2 cos(phase) = pi g (1 - e) / (1 + e), and the ball approaches at g T / (1 + e)."""
    f = 25.0
    rate, least = 2.0 * math.pi * f, math.pi * (1.0 - e) / (1.0 + e) * G
    amplitude = 1.1 * least / rate**2
    phase = math.acos(least / (amplitude * rate**2))
    moves = {"displacement": {"kind": "sine", "amplitude": amplitude, "frequency": f, "phase": phase}}
    start = {"initial.velocity": [e / (1.0 + e) * G / f], "robot.feet.ball.gap": 0.0}
    run = ts.simulate(shaken(moves, {"ground.restitution.coefficient": e, **start}), 10.0 / f)
    assert run.ok and len(run.events) in (9, 10)
    np.testing.assert_allclose(run.events["speed_before"], G / f / (1.0 + e), rtol=1e-12)
    np.testing.assert_allclose(np.diff(run.events["time"]), 1.0 / f, rtol=1e-12)


SINKING = {
    "displacement": {"kind": "sampled", "times": [0.0, 12.0], "levels": [0.0, -36.0]},
    "velocity": {"kind": "ramp", "start": 0.0, "stop": -80.0, "duration": 20.0},
    "acceleration": {"kind": "constant", "level": -4.0},
}
"""Steadily, ever faster, and ever faster as told by its acceleration."""


@pytest.mark.parametrize("e", [0.2, 0.5, 0.9])
@pytest.mark.parametrize("told", SINKING)
def test_chatter_on_a_sinking_table_ends_when_geometry_says(told: str, e: float) -> None:
    """Falls of t and flights of 2 t e^n, under the part of gravity that the table leaves."""
    values = {"ground.restitution.coefficient": e}
    fall = math.sqrt(2.0 / (G if told == "displacement" else G - 4.0))
    over = fall * (1.0 + e) / (1.0 - e)
    run = ts.simulate(shaken({told: SINKING[told]}, values), 1.05 * over)
    assert run.ok
    assert run.events["time"][-1] == pytest.approx(over, rel=1e-12)


def test_a_table_that_passes_below_is_met_where_the_laboratory_says() -> None:
    """A ball at rest in the laboratory meets a table that rises steadily; without the switch it rises as well."""
    rising = {"displacement": {"kind": "sampled", "times": [0.0, 9.0], "levels": [0.0, 18.0]}}
    alone = ts.simulate(shaken(rising, {"initial.in_laboratory": True}), 0.4)
    meet = (-2.0 + math.sqrt(4.0 + 2.0 * G)) / G  # 1 m = 2 t + g t^2 / 2
    assert alone.events["time"][0] == pytest.approx(meet, rel=1e-13)
    assert alone.events["speed_before"][0] == pytest.approx(2.0 + G * meet, rel=1e-13)
    along = ts.simulate(shaken(rising), 0.5)
    assert along.events["time"][0] == pytest.approx(math.sqrt(2.0 / G), rel=1e-13)


# --- a structure, whose base moves or stays ------------------------------------------------------------------

MASS, STIFF = np.diag([2e-3, 1e-3]), np.array([[50.0, -20.0], [-20.0, 20.0]])
DAMP = np.array([[0.05, -0.02], [-0.02, 0.02]])
AMPLITUDE, FREQUENCY, PHASE, GAP, E = 3e-4, 31.0, 0.4, 1e-4, 0.6


def two_masses(base: str) -> ts.Scene:
    """Two masses on springs above ground that swings, at rest in the laboratory."""
    structure = ts.Lumped(
        coordinates=("low", "high"), mass=MASS.tolist(), stiffness=STIFF.tolist(), damping=DAMP.tolist()
    )
    wave = {"kind": "sine", "amplitude": AMPLITUDE, "frequency": FREQUENCY, "phase": PHASE}
    return ts.Scene(
        name="two masses",
        robot=ts.Robot(structure=structure, feet={"low": ts.Foot(point="low", gap=GAP)}),
        ground=ts.Ground(
            restitution=ts.Restitution(coefficient=E), motion={"normal": {"displacement": wave}, "base": base}
        ),
        initial=ts.Initial(in_laboratory=True),
        duration=0.3,
    )


def laboratory_impacts(base: str, until: float) -> list[float]:
    """The same in the laboratory: z by its eigenvectors about what the base forces on it, met by the ground's sine."""
    rate, up, inverse = 2.0 * math.pi * FREQUENCY, np.ones(2), np.linalg.inv(MASS)
    flow = np.block([[np.zeros((2, 2)), np.eye(2)], [-inverse @ STIFF, -inverse @ DAMP]])
    values, shapes = np.linalg.eig(flow)
    swing = np.zeros(2, dtype=complex)
    if base == "moves":
        force = (STIFF + 1j * rate * DAMP) @ up * AMPLITUDE
        swing = np.linalg.solve(STIFF - rate**2 * MASS + 1j * rate * DAMP, force)

    def forced(t: float) -> np.ndarray:
        turned = swing * np.exp(1j * (rate * t + PHASE))
        return np.concatenate([turned.imag, (1j * rate * turned).imag])

    def ground(t: float) -> tuple[float, float]:
        return AMPLITUDE * math.sin(rate * t + PHASE), AMPLITUDE * rate * math.cos(rate * t + PHASE)

    now, state, out = 0.0, np.array([ground(0.0)[0]] * 2 + [0.0, 0.0]), []
    while True:
        free = np.linalg.solve(shapes, state - forced(now))

        def at(t: float) -> np.ndarray:
            return (shapes @ (np.exp(values * (t - now)) * free)).real + forced(t)  # noqa: B023

        def gap(t: float) -> float:
            return GAP + at(t)[0] - ground(t)[0]

        looks = now + np.geomspace(1e-8, until, 6000)
        first = next((k for k, t in enumerate(looks) if gap(t) < 0.0), None)
        if first is None or looks[first] > until:
            return out
        now_then = brentq(gap, looks[first - 1], looks[first], xtol=1e-18, rtol=1e-15)
        state, now = at(now_then), now_then
        state[2] -= (1.0 + E) * (state[2] - ground(now)[1])  # the impulse moves the mass that is struck alone
        out.append(now)


@pytest.mark.parametrize("base", ["moves", "stays"])
def test_two_masses_meet_moving_ground_as_in_the_laboratory(base: str) -> None:
    run = ts.simulate(two_masses(base))
    wanted = laboratory_impacts(base, 0.3)
    assert run.ok and len(wanted) > 6
    np.testing.assert_allclose(run.events["time"], wanted, rtol=1e-12)
    assert run.ledger.closure < 1e-8


def test_the_work_in_the_laboratory_is_that_of_what_touches() -> None:
    """In the laboratory the ground works by its speed times what the base and the foot carry: integrated between
    impacts by Gauss, and with the impulses at them."""
    run = ts.simulate(two_masses("moves"))
    rate, edges = 2.0 * math.pi * FREQUENCY, [0.0, *run.events["time"], run.end_time]
    nodes, weights = np.polynomial.legendre.leggauss(60)
    work = 0.0
    for a, b in itertools.pairwise(edges):
        t = 0.5 * (a + b) + 0.5 * (b - a) * nodes
        states = run.states(t)
        carried = -(STIFF @ states.x + DAMP @ states.v).sum(axis=0)
        work += 0.5 * (b - a) * weights @ (carried * AMPLITUDE * rate * np.cos(rate * t + PHASE))
    for event in run.events:
        impulse = MASS[0, 0] * (event["speed_before"] + event["speed_after"])
        work += impulse * AMPLITUDE * rate * math.cos(rate * event["time"] + PHASE)
    assert run.laboratory_work == pytest.approx(work, rel=1e-9)


def test_a_session_goes_on_where_the_ground_is() -> None:
    own = two_masses("moves")
    session, run = ts.Session(own), ts.simulate(own)
    session.reset()
    times = np.concatenate([session.step(0.1).events["time"] for _ in range(3)])
    np.testing.assert_allclose(times, run.events["time"], rtol=1e-9)


# --- walkers ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("gait", [True, False])
def test_a_walker_on_a_plate_that_is_pushed_up_is_as_heavy(gait: bool) -> None:
    """Under a plate's steady acceleration it walks as under so much more gravity."""
    walker = ts.with_values(ts.load_scene("millipede"), {"initial.standing": None})
    if not gait:  # let fall, so that its feet bounce
        values = {f"robot.feet.{foot}.gap": gap for foot, gap in zip(walker.robot.feet, (2e-6, 3e-6), strict=True)}
        walker = ts.with_values(walker, {"gait": None, **values})
    g = walker.ground.gravity.acceleration
    pushed = {"normal": {"acceleration": {"kind": "constant", "level": 2.0}}}
    runs = [
        ts.simulate(ts.with_values(walker, values), "30 ms")
        for values in ({"ground.motion": pushed}, {"ground.gravity.acceleration": g + 2.0})
    ]
    first, second = (run.events[run.events["time"] < 0.01] for run in runs)
    assert len(first) > 4
    np.testing.assert_array_equal(first["kind"], second["kind"])
    np.testing.assert_allclose(first["time"], second["time"], rtol=1e-9)
    assert runs[0].ledger.closure < 1e-8
