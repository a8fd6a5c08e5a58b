"""Numbers that are data of a plan: runs that differ in them are the changed scenes', with one set of tables."""

from __future__ import annotations

import numpy as np
import pytest

import tarsus as ts
from example_laws import OWN
from scene_files import balls
from scene_files import scene as scene_of
from scene_kinds import KINDS, over
from tarsus.base.spec import quantity
from tarsus.model.drive.signal import Signal
from tarsus.model.laws import AdhesiveFriction
from tarsus.model.laws.ageing_adhesion import AgeingAdhesion
from tarsus.model.scene import Scene
from tarsus.plan.lowering import lower_scene
from tarsus.plan.slots import slot, slots
from tarsus.solve import Accuracy
from tarsus.solve.run import Shared
from tarsus.study import bench
from walking_devices import creeping_millipede
from walking_scenes import sticky, trotter


def chain(**ground) -> Scene:
    return ts.with_values(bench.chain(2), {f"ground.{name}": law for name, law in ground.items()})


def heavy() -> Scene:
    """Of weight, and let go from where it is told."""
    robot = ts.with_values(bench.chain(2).robot, {"structure.upward": (1.0, 1.0)})
    start = ts.Initial(displacement=(0.0, 0.0), velocity=(0.0, 0.0))
    return ts.with_values(chain(gravity=ts.Gravity(acceleration=0.5)), {"robot": robot, "initial": start})


def sticky_feet() -> Scene:
    return scene_of("sticky_feet", {"ground.laws": {"drag": OWN["drag"](coefficient=1e-5, height=1e-6)}})


CASES = {
    "chain": (
        heavy,
        {
            "robot.feet.tip.gap": [0.0, 3e-5, 7e-5, 8e-5],
            "ground.gravity.acceleration": [0.0, 0.5, 0.5, 9.81],
            "initial.displacement.0": [0.0, 1e-6, 1e-5, 0.0],
            "initial.velocity.1": [0.0, 1e-3, 2e-3, 1e-3],
            "signals.pull.amplitude": [8.0, 5.0, 9.0, 0.0],
            "robot.drives.pull.law.gain": [-8e-4, -9e-4, -8e-4, 0.0],
        },
        0.08,
    ),
    "gap, pull as printed": (
        lambda: chain(landing=ts.laws.PullAsPrinted()),
        {"robot.feet.tip.gap": [3e-5, 7e-5, 8e-5]},
        0.08,
    ),
    "every law": (
        sticky_feet,
        {
            "ground.film.coefficient": [5e-21, 8e-21, 0.0],
            "ground.film.thickness": [4e-6, 5e-6, 6e-6],
            "ground.adhesion.initial": [15e-6, 0.0, 40e-6],
            "ground.restitution.coefficient": [0.3, 0.0, 0.6],
            "ground.electrostatic.coefficient": [1e-17, 0.0, 2e-17],
            "ground.laws.drag.coefficient": [1e-5, 0.0, 1e-4],
            "ground.gravity.acceleration": [9.81, 1.62, 20.0],
            "robot.drives.pzt.law.gain": [1.2e-4, 9e-5, 1.5e-4],
        },
        0.02,
    ),
    "speed of a landing rule": (
        lambda: ts.load_scene("cantilever", **{"ground.landing": {"kind": "restitute_first", "speed": 0.1}}),
        {"ground.landing.speed": [0.01, 0.05, 0.2, 5.0]},
        0.02,
    ),
    "incline": (
        lambda: ts.with_values(trotter(3), {"ground.incline": 0.0}),
        {"ground.incline": [0.0, 0.17, 1.3]},
        0.01,
    ),
    "friction that adheres": (
        lambda: trotter(3, ground=sticky(friction=AdhesiveFriction(coefficient=0.8))),
        {"ground.friction.coefficient": [0.2, 0.7], "ground.adhesion.rate": [1e-5, 1e-4]},
        0.01,
    ),
    "a walker that turns": (
        lambda: ts.load_scene("turning-hexapod"),
        {
            "gait.turn": [0.0, 1.0],
            "gait.low": [0.0, 1.0],
            "ground.friction.coefficient": [0.5, 0.4],
            "robot.drives.LM_lift.capacitance": [1e-9, 2e-9],
        },
        0.05,
    ),
    "pads": (lambda: ts.load_scene("climber"), {"signals.LF_pad.levels.0": [150.0, 200.0]}, 0.05),
    "grounds by foot": (
        lambda: balls(duration=1.0),
        {"ground.restitution.coefficient": [0.7, 0.6], "grounds.soft.restitution.coefficient": [0.2, 0.4]},
        1.0,
    ),
}


@pytest.mark.parametrize("case", CASES)
def test_runs_are_those_of_the_changed_scenes(case):
    make, vary, duration = CASES[case]
    assert compared(make(), vary, duration) > 0


@over(
    modal=(0, 2, 3, 5, 6, 7, 11, 12, 13),
    legged=(0, 2, 3, 5, 6, 7, 11, 12, 13),
    creeping=(0, 5),
    moving=range(6),
    turning=range(3),
    uneven=range(6),
)
def test_so_are_those_of_random_scenes_in_all_their_slots(kind, seed):
    """Each of their numbers is moved by up to a thousandth."""
    made, rng = KINDS[kind](seed), np.random.default_rng(seed)
    own = {path: float(ts.get_value(made, path)) for path in slots(made)}
    vary = {path: [value * (1.0 + 1e-3 * rng.random() * k) for k in (-1, 1)] for path, value in own.items()}
    assert len(vary) > 8 and compared(made, vary, made.duration) > 0


def compared(made, vary, duration):
    """How many events the runs have, each held against the run of its scene alone."""
    shared = Shared()
    known = {path for path in vary if slot(made, path) is not None or path.endswith("capacitance")}
    assert known == set(vary)
    batch = ts.simulate_batch(made, vary, duration, threads=1, shared=shared)
    assert len([key for key in shared.keys if not isinstance(key[0], Signal)]) == 1  # one set of tables
    events = 0
    for i in range(len(batch)):
        run = batch.run(i)
        alone = ts.simulate(run.scene, duration, Accuracy())
        ours, theirs = run.all_events, alone.all_events
        np.testing.assert_array_equal(ours["kind"], theirs["kind"])
        np.testing.assert_array_equal(ours["foot"], theirs["foot"])
        np.testing.assert_allclose(ours["time"], theirs["time"], rtol=0.0, atol=1e-10 * duration)
        assert run.period == pytest.approx(alone.period, rel=1e-12)
        assert run.code is batch.codes[i] and run.ledger.closure < 1e-6
        np.testing.assert_array_equal(run.motion.log.events, run.log.events)  # made once more, step for step
        there, wanted = (one.at(np.linspace(0.0, duration, 31)) for one in (run, alone))
        for found, exact in ((there.state.x, wanted.state.x), (there.force, wanted.force)):
            np.testing.assert_allclose(found, exact, rtol=0.0, atol=1e-6 * np.abs(exact).max(initial=0.0))
        events += len(run.events)
    return events


RNG = np.random.default_rng(3)
MIXED = {
    "modes": (
        chain,
        {
            "robot.feet.tip.gap": RNG.uniform(3e-5, 8e-5, 24),
            "signals.pull.phase": RNG.uniform(0.0, 6.0, 24),
            "signals.pull.amplitude": RNG.uniform(7.0, 9.0, 24),
            "signals.pull.duty": RNG.choice([0.4, 0.5, 1.0], 24),
            "ground.restitution.coefficient": RNG.uniform(0.2, 0.5, 24),
            "robot.structure.stiffness.1.1": np.repeat([420.0, 425.0], 12),
        },
    ),
    "legs": (creeping_millipede, {"ground.friction.coefficient": np.linspace(0.1, 0.6, 12)}),
}


@pytest.mark.parametrize("of", MIXED)
def test_bits_do_not_depend_on_neighbours_order_chunks_or_threads(of, monkeypatch):
    make, vary = MIXED[of]
    whole = ts.simulate_batch(make(), vary, 0.04, threads=2)
    order = RNG.permutation(len(whole))
    monkeypatch.setattr("tarsus.solve.simulation._CHUNK", 5)
    mixed = ts.simulate_batch(make(), {path: v[order] for path, v in vary.items()}, 0.04, threads=1)
    for k, i in enumerate(order):
        np.testing.assert_array_equal(mixed.run(k).all_events, whole.run(int(i)).all_events)
    for i in (0, 7, len(whole) - 1):
        alone = ts.simulate_batch(make(), {path: v[i : i + 1] for path, v in vary.items()}, 0.04)
        np.testing.assert_array_equal(alone.run(0).all_events, whole.run(i).all_events)


def test_a_session_keeps_its_tables():
    session = ts.Session(chain())
    first = session.run(duration=0.05)
    second = session.run({"robot.feet.tip.gap": 5e-5, "signals.pull.amplitude": 9.0}, 0.05)
    assert second.motion.engine.tables.native is first.motion.engine.tables.native
    alone = ts.simulate(second.scene, 0.05)
    assert second.ok and alone.ok
    np.testing.assert_array_equal(second.all_events, alone.all_events)
    times = np.linspace(0.0, 0.05, 40)
    np.testing.assert_allclose(second.at(times).state.gap, alone.at(times).state.gap, rtol=0.0, atol=1e-15)
    assert second.at(times).state.gap[0, 0] == pytest.approx(5e-5)
    assert second.ledger.closure < 1e-8
    other = session.run({"robot.structure.stiffness.1.1": 425.0}, 0.05)
    assert other.motion.engine.tables.native is not first.motion.engine.tables.native
    batch = session.batch({"signals.pull.phase": [0.0, 1.0]}, 0.05, threads=1)
    np.testing.assert_array_equal(batch.run(0).events, ts.simulate(chain(), 0.05, Accuracy()).events)
    assert repr(session) == f"Session({chain().name!r})" and "robot.feet.tip.gap" in session.slots


def test_scales_of_a_law_are_sums_of_its_fields():
    ageing = AgeingAdhesion(initial=2.0, gain=3.0, ageing=1.0, fading=1.0)
    scene = ts.with_values(chain(), {"ground.adhesion": None, "ground.laws": {"ageing": ageing}})
    assert lower_scene(scene).force == 5.0
    with pytest.raises(TypeError, match="its scales name 'depth', which is no field of it"):

        class Deep(ts.laws.SmoothLaw):
            length_scale = ("depth",)
            strength: float = quantity("N", "of the force")
