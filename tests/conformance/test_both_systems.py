"""One set of grounds under contact modes and legs: the same laws, rules, events, codes and accounts."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cache

import numpy as np
import pytest

import tarsus as ts
from example_laws import OWN
from sliding_scenes import by_modes
from tarsus.base.events import CONTACT_BEGINS, SLIDING, EventKind
from tarsus.design import standing
from tarsus.model.scene import Drive, Foot, Ground, PointLoad, Robot, Scene
from walking_scenes import block, moving, sticky, trotter

FILM = {"coefficient": 1e-23, "thickness": 1e-6}
PULL = {"coefficient": 1e-19, "offset": 1e-6}
HOLD = {"initial": 2e-7, "rate": 1e-5}
REBOUND = {"coefficient": 0.4}
MAGNET = OWN["magnet"](strength=1e-30, depth=1e-6)
DRAG = OWN["drag"](coefficient=1e-6, height=1e-6)
NONE = {"adhesion": None}
GROUNDS: dict[str, dict] = {
    "bare": NONE,
    "adhesion": {},
    "own latch": {"adhesion": None, "laws": {"latch": OWN["own_latch"](**HOLD)}},
    "no rebound": {"restitution": ts.Restitution(coefficient=0.0)},
    "rebound": {"restitution": ts.Restitution(**REBOUND)},
    "own rebound": {"restitution": None, "laws": {"rebound": OWN["own_rebound"](**REBOUND)}},
    "film": {"film": ts.Film(**FILM)},
    "own film": {"laws": {"own": OWN["own_film"](**FILM)}},
    "two films": {"film": ts.Film(**FILM), "laws": {"own": OWN["own_film"](coefficient=5e-24, thickness=2e-6)}},
    "electrostatic": {"electrostatic": ts.Electrostatic(**PULL)},
    "own electrostatic": {"laws": {"own": OWN["own_electrostatic"](**PULL)}},
    "along the leg": {"leg_electrostatic": ts.laws.LegElectrostatic(**PULL, rest=1e-6)},
    "magnet": {"laws": {"magnet": MAGNET}},
    "drag": {"laws": {"drag": DRAG}},
    "magnet and drag": NONE | {"laws": {"magnet": MAGNET, "drag": DRAG}},
    "electrostatic, magnet": {"electrostatic": ts.Electrostatic(**PULL), "laws": {"magnet": MAGNET}},
    "film, electrostatic": NONE | {"film": ts.Film(**FILM), "electrostatic": ts.Electrostatic(**PULL)},
    "all": {
        "film": ts.Film(**FILM),
        "electrostatic": ts.Electrostatic(**PULL),
        "laws": {"magnet": MAGNET, "drag": DRAG},
    },
    "restitute first": {"landing": ts.laws.RestituteFirst(speed=2e-3)},
    "pull as printed": {"landing": ts.laws.PullAsPrinted()},
    "weightless": {"gravity": None, "film": ts.Film(**FILM)},
}
TWINS = {"own latch": "adhesion", "own rebound": "rebound", "own film": "film", "own electrostatic": "electrostatic"}


def pair(ground: Ground) -> Scene:
    """Two masses on springs that know of each other, each with a foot and a drive: what `trotter` is by legs."""
    names = ("a", "b")
    return Scene(
        name="pair",
        robot=Robot(
            structure=ts.Lumped(
                coordinates=names,
                mass=(2e-9, 3e-9),
                stiffness=((2.0, -0.3), (-0.3, 1.6)),
                damping=((4e-6, -1e-6), (-1e-6, 3e-6)),
            ),
            drives={n: Drive(load=PointLoad(weights={n: -1.0}), law=ts.LinearForce(gain=5e-7)) for n in names},
            feet={n: Foot(point=n, gap=1e-6, electrode=n) for n in names},
        ),
        ground=ground,
        signals={
            n: ts.Sine(amplitude=7.0, offset=2.0, frequency=200.0, phase=math.pi * i) for i, n in enumerate(names)
        },
        duration=0.02,
    )


def scene(system: str, ground: str) -> Scene:
    laws = GROUNDS[ground]
    return trotter(ground=sticky(**laws)) if system == "legged" else pair(sticky(**({"friction": None} | laws)))


@cache
def run_of(system: str, ground: str) -> ts.Run:
    return ts.simulate(scene(system, ground), 0.01)


@pytest.fixture(params=["modal", "legged"])
def system(request: pytest.FixtureRequest) -> str:
    return request.param


@pytest.fixture(params=GROUNDS)
def run(request: pytest.FixtureRequest, system: str) -> ts.Run:
    return run_of(system, request.param)


def between_events(run: ts.Run) -> tuple[np.ndarray, np.ndarray]:
    """Gauss points and weights of short stretches of a run, shorter behind its events: a leg settles in 0.2 us."""
    x, weights = np.polynomial.legendre.leggauss(16)
    behind = run.events["time"][:, None] + np.array([0.0, 1e-8, 1e-7, 3e-7, 1e-6, 3e-6, 1e-5])
    ends = np.unique(np.concatenate([np.linspace(0.0, run.duration, 401), behind.ravel()]).clip(0.0, run.duration))
    half = 0.5 * np.diff(ends)
    return (ends[:-1, None] + half[:, None] * (x + 1.0)).ravel(), (half[:, None] * weights).ravel()


def works(ground: str) -> bool:
    """Whether a law on this ground does work on feet in the air."""
    acting = scene("legged", ground).ground.acting_laws
    return any(law.hook in ("momentum", "force") for law in acting.values())


@pytest.mark.parametrize("ground", [ground for ground in GROUNDS if works(ground)])
def test_the_work_of_a_law_is_its_force_along_the_way(system: str, ground: str) -> None:
    run = run_of(system, ground)
    assert run.ledger.laws
    times, weights = between_events(run)
    series = run.at(times)
    for name, work in run.ledger.laws.items():
        power = (series.laws[name] * series.state.rate).sum(axis=0)
        size = np.abs(power) @ weights
        assert size > 0.0
        assert power @ weights == pytest.approx(work, abs=1e-5 * size)


def test_a_run_on_every_ground_keeps_its_account_its_forces_and_the_order_of_its_events(run: ts.Run) -> None:
    """The ground pushes back what structure and laws leave, users' among them; no contact is pulled harder than it
    holds. A foot that is held leaves before it lands again; none departs faster than it came, or gains by an impact."""
    assert run.ok, run.code
    assert run.ledger.closure < 1e-8
    acting = {name for name, law in run.scene.ground.acting_laws.items() if law.hook in ("momentum", "force")}
    assert set(run.ledger.laws) == acting
    series = run.at(np.linspace(0.0, run.duration, 2001))
    held, state = series.state.held, series.state
    assert held.any()
    smooth = sum(
        (force for name, force in series.laws.items() if run.scene.ground.acting_laws[name].hook == "force"),
        np.zeros_like(series.contact),
    )
    np.testing.assert_allclose(series.contact, np.where(held, -(state.pull + smooth), 0.0), rtol=1e-12, atol=1e-20)
    largest = np.abs(series.contact).max()
    assert np.all((series.contact + series.strength)[held] > -1e-6 * largest)
    assert state.gap.min() > -1e-10 * run.plan.length
    events = run.events
    assert len(events) > 3 and np.all(np.diff(events["time"]) >= 0.0)
    assert np.all(events["speed_after"] <= events["speed_before"])
    assert np.all(events["energy"] >= 0.0)
    for foot in range(len(run.foot_names)):
        on_ground = False
        for kind in events["kind"][events["foot"] == foot]:
            assert on_ground == (kind in (*SLIDING, EventKind.RELEASE)), kind
            on_ground = kind in CONTACT_BEGINS or (on_ground and kind != EventKind.RELEASE)


@pytest.mark.parametrize("own", TWINS)
def test_a_users_law_is_the_built_in_one(system: str, own: str) -> None:
    mine, built_in = run_of(system, own), run_of(system, TWINS[own])
    assert len(mine.events) > 3
    for field in ("foot", "kind"):
        np.testing.assert_array_equal(mine.events[field], built_in.events[field])
    np.testing.assert_allclose(mine.events["time"], built_in.events["time"], rtol=1e-9)
    if own not in ("own latch", "own rebound"):
        assert mine.ledger.laws["own"] == pytest.approx(built_in.ledger.laws[TWINS[own]], rel=1e-7)


RUBBING = {
    "adhesive friction": {"friction": {"kind": "adhesive", "coefficient": 0.5}},
    "stribeck": {"friction": {"kind": "stribeck", "static": 0.5, "dynamic": 0.2, "speed": 0.01}},
    "frictionless": {"friction": {"kind": "coulomb", "coefficient": 0.0}},
} | GROUNDS


def slewed() -> Scene:
    """A square of the trotter's drives behind amplifiers that lag and slew."""
    scene = trotter(ground=sticky())
    amplifier = ts.Amplifier(slew_rate=4e4, bandwidth=5e3)
    drives = {f"robot.drives.{name}.amplifier": amplifier for name in scene.robot.drives}
    square = ts.Square(amplitude=7.0, offset=7.0, frequency=200.0)
    return ts.with_values(scene, drives | {f"signals.{name}": square for name in scene.signals})


def hopping() -> Scene:
    """A block thrown up that comes to rest and is thrown again."""
    up, along = ts.Sine(amplitude=1.5e-5, frequency=60.0), ts.Sine(amplitude=3e-6, frequency=23.0)
    return moving(block(signals={"upward": up, "along": along}), block_x=0.02)


WALKS: dict[str, Callable[[], Scene]] = {
    **{
        ground: lambda ground=ground: trotter(ground=sticky(**RUBBING[ground]))
        for ground in RUBBING
        if ground not in ("pull as printed", "along the leg")
    },
    "undamped": lambda: trotter(damping=0.0),
    "no turning": lambda: trotter(turning=False, legs=5),
    "standing": lambda: standing(trotter(ground=sticky())),
    "behind amplifiers": slewed,
    "hopping": hopping,
}


@pytest.mark.parametrize("walk", WALKS)
def test_a_walker_by_contact_modes_is_the_walker(walk: str) -> None:
    """Its body and legs as matrices, with rows for its feet upward and along: the same events, account and motion."""
    legged = WALKS[walk]()
    duration = 0.1 if walk == "hopping" else 0.01
    one, other = ts.simulate(legged, duration), ts.simulate(by_modes(legged), duration)
    assert one.ok and other.ok, (one.code, other.code)
    assert len(one.events) > 3
    for field in ("foot", "kind"):
        np.testing.assert_array_equal(other.events[field], one.events[field])
    np.testing.assert_allclose(other.events["time"], one.events["time"], rtol=1e-9)
    for field in ("energy", "adhesion_energy", "speed_before", "speed_after"):
        size = np.abs(one.events[field]).max()
        np.testing.assert_allclose(other.events[field], one.events[field], atol=1e-8 * size)
    largest = max(one.ledger.work_in, one.ledger.friction)
    for name in ("work_in", "kinetic", "elastic", "damping", "friction", "impacts", "adhesion"):
        assert getattr(other.ledger, name) == pytest.approx(getattr(one.ledger, name), abs=1e-8 * largest)
    times = np.linspace(0.0, duration, 201)
    walked, slid = one.at(times), other.at(times)
    for name, size in (("foot_x", 1e-6), ("friction", 1e-6), ("contact", 1e-6)):
        np.testing.assert_allclose(getattr(slid, name), getattr(walked, name), atol=1e-6 * size)
    np.testing.assert_array_equal(slid.slipping, walked.slipping)


def test_both_end_with_the_same_codes(system: str) -> None:
    """A law without a value at any gap, and one step too few."""
    made = scene(system, "bare")
    short = ts.simulate(made, 0.01, ts.Accuracy(steps=30))
    assert short.code.name == "STEP_LIMIT" and not short.ok and 0.0 < short.end_time < 0.01
    broken = OWN["magnet"](strength=1e60, depth=1e-60)
    undefined = made.model_copy(update={"ground": made.ground.model_copy(update={"laws": {"broken": broken}})})
    assert ts.simulate(undefined, 0.01).code.name in ("NOT_FINITE", "TOO_STIFF")
