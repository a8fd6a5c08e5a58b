"""Walkers: initial velocities, laws that end at the ground, where slip begins, and the table of a foot's states."""

from __future__ import annotations

import math

import numpy as np
import pytest

import tarsus as ts
from tarsus.base.events import EVENT_WORDS, TRANSITIONS, EventKind, FootState
from tarsus.model.laws import Friction, SmoothLaw
from tarsus.model.structure import Walker
from tarsus.solve.codes import ResultCode
from walking_devices import creeping_millipede
from walking_scenes import GRAVITY, block, sticky, trotter

RELEASE, SLIP, STICK = 3, 7, 8
MASS, MU = 1e-6, 0.3


class Rooted(SmoothLaw):
    """Finite on the ground and above, as a law must be, and nothing below."""

    uses_rate = False

    @staticmethod
    def force(gap, gap_rate, volts, time):
        return -1e-9 * math.sqrt(gap)


class Logarithm(SmoothLaw):
    """Infinite on the ground."""

    uses_rate = False

    @staticmethod
    def force(gap, gap_rate, volts, time):
        return 1e-12 * math.log(gap / 1e-6)


def landing(law: SmoothLaw) -> ts.Scene:
    """A foot that falls from 1 um under a law of its own."""
    scene = block(friction=None)
    scene = ts.with_values(scene, {"robot.feet.block.gap": 1e-6, "ground.laws": {"own": law}})
    return ts.with_values(scene, {"ground.adhesion": ts.Adhesion(initial=1e-5, rate=0.0)})


def test_every_coordinate_starts_with_the_velocity_it_is_given() -> None:
    scene = trotter(ground=ts.Ground())
    scene = ts.with_values(scene, {f"robot.feet.{foot}.gap": 1.0 for foot in scene.robot.feet})
    scene = scene.model_copy(update={"signals": {}})
    walker = scene.robot.structure
    assert isinstance(walker, Walker)
    given = 0.01 * np.arange(1, walker.size + 1)
    run = ts.simulate(ts.with_values(scene, {"initial.velocity": tuple(given)}), duration=1e-3)
    start = run.at(np.array([0.0])).state
    np.testing.assert_array_equal(start.v[:, 0], given)
    assert run.ledger.closure < 1e-8


def test_a_law_that_ends_at_the_ground_lets_a_foot_land() -> None:
    run = ts.simulate(landing(Rooted()), duration=1e-3)
    assert run.ok and run.ledger.closure < 1e-10
    assert [int(kind) for kind in run.events["kind"]] == [2]
    fall = math.sqrt(2e-6 / GRAVITY)
    assert run.events["time"][0] == pytest.approx(fall, rel=1e-6)  # the law adds 1e-7 of the weight
    assert run.events["time"][0] < fall


def test_a_law_that_is_infinite_on_the_ground_ends_the_run_in_its_sentence() -> None:
    run = ts.simulate(landing(Logarithm()), duration=1e-3)
    assert run.code is ResultCode.NOT_FINITE
    assert run.end_time == pytest.approx(math.sqrt(2e-6 / GRAVITY), rel=1e-3)


def lifted(push: float, friction: float = MU) -> ts.Run:
    """A block pushed along and pulled up ever harder, off the ground after 10 ms."""
    signals = {"along": ts.Constant(level=push), "upward": ts.waveforms.Ramp(stop=2.0 * MASS * GRAVITY, duration=0.02)}
    return ts.simulate(block(friction=friction, signals=signals), duration=0.011)


@pytest.mark.parametrize("share", [0.5, 1e-3, 1e-6])
def test_a_slip_just_before_the_pull_off_is_found_and_stands_alone(share: float) -> None:
    run = lifted(share * MU * MASS * GRAVITY)
    events = run.events[run.events["time"] > 0.0]
    assert events["kind"].tolist() == [SLIP, RELEASE]
    assert events["time"] == pytest.approx([0.01 * (1.0 - share), 0.01], rel=1e-10)


@pytest.mark.parametrize("friction", [0.3, 3.0])
def test_a_foot_that_nothing_pushes_along_does_not_slip_before_it_leaves(friction: float) -> None:
    run = lifted(0.0, friction)
    assert run.events["kind"][run.events["time"] > 0.0].tolist() == [RELEASE]


def test_a_millipede_leg_slips_once_before_it_leaves() -> None:
    """The first contact of a millipede that creeps: its raised foot slips once, then lets go."""
    run = ts.simulate(creeping_millipede(), duration=5e-7)
    raised = run.events[(run.events["foot"] == 1) & (run.events["time"] > 0.0)]
    assert raised["kind"].tolist() == [SLIP, RELEASE]
    # 86.1000087 ns: the same contact as an equation of motion with 2 bodies held, by an implicit Runge-Kutta to 1e-12
    assert raised["time"][0] == pytest.approx(8.61000087e-8, rel=1e-8)
    assert raised["pull"][0] == pytest.approx(raised["strength"][0], rel=1e-6)


def changes(run, foot):
    """(state before, state after, event) of every event of a foot, the states sampled halfway to its neighbours."""
    own = run.events[run.events["foot"] == foot]
    edges = np.concatenate([[0.0], own["time"], [run.duration]])
    series = run.at(0.5 * (edges[1:] + edges[:-1]))
    held = np.where(series.slipping[foot], FootState.SLIPPING, FootState.STUCK)
    state = np.where(series.state.held[foot], held, FootState.AIR)
    apart = np.diff(edges) > 1e-12
    # a rest is logged with the end of its accumulation, and held from its last bounce on
    resting = np.concatenate([own["kind"] == EventKind.REST, [False]])
    for n, event in enumerate(own):
        if apart[n] and apart[n + 1] and not resting[n] and not resting[n + 1]:
            yield int(state[n]), int(state[n + 1]), EVENT_WORDS[event["kind"]]


def runs():
    for friction in (0.02, 0.1, 0.6):
        ground = sticky(friction=Friction(coefficient=friction), adhesion=ts.Adhesion(initial=2e-7, rate=1e-4))
        yield ts.simulate(trotter(legs=4, ground=ground), duration=0.02)
    yield ts.simulate(trotter(legs=4, ground=sticky(adhesion=None)), duration=0.005)
    # friction ends with the contact's last newton: a foot is stuck until it leaves only where the drive jumps
    yield ts.simulate(creeping_millipede(), duration=0.1)


def test_every_change_is_in_the_table_and_every_one_of_the_table_occurs():
    seen = {change for run in runs() for foot in range(len(run.foot_names)) for change in changes(run, foot)}
    words = {"turns round": "slip begins"}
    assert seen == {(before, after, words.get(name, name)) for before, after, name, _ in TRANSITIONS}
