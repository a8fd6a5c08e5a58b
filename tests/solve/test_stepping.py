"""Robots that are stepped: in steps they are what they are in one run; copies, files and threads."""

from __future__ import annotations

import copy
import pickle

import numpy as np
import pytest

import tarsus as ts
from scene_files import creeping
from scene_files import scene as scene_of
from scene_kinds import KINDS, over
from tarsus.model.laws.ageing_adhesion import AgeingAdhesion
from tarsus.solve.codes import ResultCode

STEPS = 24


def _commands(scene, steps=STEPS, seed=3):
    """Volts of every drive, one a step: of legs' in a gait from 0 V on, of others up and down."""
    rng, ends = np.random.default_rng(seed), (0.0, 14.0) if scene.gait else (-8.0, 8.0)
    return {name: rng.uniform(*ends, steps) for name in scene.robot.drives}


def _whole(scene, levels, dt):
    """The scene driven by the same volts, one plateau a step."""
    waves = {
        name: {"kind": "on_off", "levels": own.tolist(), "durations": [dt] * len(own)} for name, own in levels.items()
    }
    return ts.with_values(scene, {f"signals.{name}": wave for name, wave in waves.items()})


def _same_events(parts, whole, scale):
    events = np.concatenate(parts)
    assert len(events) == len(whole)
    for name in ("foot", "kind"):
        assert events[name].tolist() == whole[name].tolist()
    assert np.abs(events["time"] - whole["time"]).max(initial=0.0) < 1e-9 * scale
    for name in ("speed_before", "energy", "apex"):
        assert events[name] == pytest.approx(whole[name], rel=1e-5, abs=1e-8 * np.abs(whole[name]).max(initial=1e-30))


AGEING = {"ageing": AgeingAdhesion(initial=1e-7, gain=1e-5, ageing=2e-3, fading=3e-3)}
SCENES = {
    "cantilever": lambda: ts.load_scene("cantilever"),
    "millipede": lambda: ts.load_scene("millipede"),
    "hexapod-walker": lambda: ts.load_scene("hexapod-walker"),
    "sticky feet": lambda: scene_of("sticky_feet"),
    "contacts that remember": lambda: ts.with_values(
        ts.load_scene("millipede"), {"ground.adhesion": None, "ground.laws": AGEING}
    ),
    "a drive that creeps": lambda: ts.with_values(creeping(), {"robot.drives.pzt.history": (9.0, -2.0)}),
}


def _in_steps(scene, dt):
    """Every event, and where the energy went, under volts that change at every step."""
    levels = _commands(scene)
    whole = ts.simulate(_whole(scene, levels, dt), STEPS * dt)
    sim = ts.Session(scene, account=True)
    sim.reset()
    parts = [sim.step({drive: own[k] for drive, own in levels.items()}, dt).events_of(0) for k in range(STEPS)]
    assert whole.ok and len(whole.events) > 8
    _same_events(parts, whole.events, STEPS * dt)
    ledger, wanted = sim.ledger(), whole.ledger
    largest = max(abs(wanted.work_in + wanted.ground), abs(wanted.kinetic), abs(wanted.elastic))
    assert abs(ledger.work_in - wanted.work_in - wanted.ground) < 1e-6 * largest
    for term in ("damping", "friction", "impacts", "adhesion", "kinetic", "elastic"):
        assert abs(getattr(ledger, term) - getattr(wanted, term)) < 1e-6 * largest
    assert ledger.closure < 1e-7
    assert sim.state.x == pytest.approx(whole.states([STEPS * dt]).x[:, 0], rel=1e-6, abs=1e-12)
    if (body := whole.at(np.array([STEPS * dt])).body) is not None:
        assert list(sim.state.body.values()) == pytest.approx(body[:, 0], rel=1e-6, abs=1e-10)


@pytest.mark.parametrize("name", ["millipede", "hexapod-walker", "contacts that remember"])
def test_steps_are_the_run_in_one_piece(name):
    _in_steps(SCENES[name](), 1e-3)


@over(
    modal=(0, 3, 6),
    legged=range(8),
    branched=(3, 5, 6, 7),
    creeping=(0, 5),
    moving=(0, 1, 3, 4, 5, 6),
    sliding=(3, 5),
    turning=(0, 3, 4, 5),
    uneven=range(5),
)
def test_steps_of_random_scenes_are_the_run_in_one_piece(kind, seed):
    scene = KINDS[kind](seed)
    _in_steps(scene, scene.duration / STEPS)


def test_a_gait_is_told_phases_frequency_and_duty():
    """As the square waves that it stands for, which run on with their clock."""
    scene = ts.load_scene("hexapod-walker")
    sim = ts.Session(scene)
    sim.reset()
    sim.step(dt="13 ms")
    state = sim.step(gait={"duty": 0.3}, dt="9 ms")
    wave = ts.with_values(scene, {"gait.duty": 0.3}).waveforms
    times = np.array([float(state.time)])
    assert state.volts == pytest.approx([float(wave[name].volts(times)[0]) for name in scene.robot.drives])
    told = ts.Session(scene)
    told.reset()
    first = told.step(gait={"duty": 0.3}, dt="20 ms").events_of(0)
    whole = ts.simulate(ts.with_values(scene, {"gait.duty": 0.3}), 0.02).events
    _same_events([first], whole, 0.02)


def test_ramps_and_waveforms_begin_with_the_step():
    scene = ts.load_scene("cantilever")
    sim = ts.Session(scene)
    sim.reset()
    sim.step({"pzt": 2.0}, "1 ms")
    state = sim.step({"pzt": 6.0}, "2 ms", ramp=True)
    assert state.volts[0] == 6.0
    sim.step({"pzt": ts.Sine(amplitude=4.0, frequency=100.0)}, "1.25 ms")
    assert sim.state.volts[0] == pytest.approx(4.0 * np.sin(2.0 * np.pi * 0.125), rel=1e-12)
    levels, times = [2.0, 2.0, 6.0, 6.0], [0.0, 1e-3, 3e-3, 4e-3]
    wave = {"kind": "sampled", "times": times, "levels": levels}
    whole = ts.simulate(ts.with_values(scene, {"signals.pzt": wave}), 0.003)
    other = ts.Session(scene)
    other.reset()
    parts = [other.step({"pzt": 2.0}, "1 ms"), other.step({"pzt": 6.0}, "2 ms", ramp=True)]
    _same_events([one.events_of(0) for one in parts], whole.events, 0.003)
    assert parts[1].x == pytest.approx(whole.states([0.003]).x[:, 0], rel=1e-7)


@pytest.mark.parametrize("name", ["cantilever", "hexapod-walker", "sticky feet"])
def test_copies_go_their_own_way_and_files_go_on_to_the_last_bit(name, tmp_path):
    scene = SCENES[name]()
    sim = ts.Session(scene, account=True)
    sim.reset(seed=2)
    levels = _commands(scene, 6)
    for k in range(3):
        sim.step({drive: own[k] for drive, own in levels.items()}, "1.5 ms")
    sim.save(tmp_path / "there.npz")
    fork, copied, pickled = sim.fork(), copy.copy(sim), pickle.loads(pickle.dumps(sim))
    restored = ts.Session(scene, account=True)
    restored.restore(tmp_path / "there.npz")
    ways = []
    for one in (sim, fork, copied, pickled, restored):
        states = [
            one.step({drive: own[k] for drive, own in levels.items()}, "1.5 ms", ramp=k == 4) for k in range(3, 6)
        ]
        ways.append(np.concatenate([*(state.x for state in states), *(s.all_events["time"] for s in states)]))
    for way in ways[1:]:
        assert way.tobytes() == ways[0].tobytes()
    assert restored.ledger().work_in == sim.ledger().work_in
    fork.step({drive: 1.0 for drive in levels}, "1 ms")
    sim.step({drive: 2.0 for drive in levels}, "1 ms")
    assert not np.array_equal(fork.state.x, sim.state.x)
    assert (tmp_path / "there.npz").stat().st_size < 60_000


def test_many_robots_are_each_what_it_is_alone():
    scene, count, dt = ts.load_scene("millipede"), 5, 2e-3
    gaps = np.linspace(0.3e-6, 1e-6, count)
    vary = {"ground.adhesion.initial": gaps}
    many = ts.Session(scene, robots=count, vary=vary, accuracy=ts.Accuracy())
    many.reset()
    volts = np.random.default_rng(1).uniform(0.0, 14.0, (12, count))
    states = [many.step({"L1": volts[k], "R1": 14.0 - volts[k]}, dt) for k in range(12)]
    for r in range(count):
        alone = ts.Session(ts.with_values(scene, {"ground.adhesion.initial": float(gaps[r])}), accuracy=ts.Accuracy())
        alone.reset()
        parts = [alone.step({"L1": volts[k, r], "R1": 14.0 - volts[k, r]}, dt) for k in range(12)]
        assert alone.state.x == pytest.approx(states[-1].x[r], rel=1e-7, abs=1e-13)
        own = [one.events_of(r) for one in states]
        assert [len(one) for one in own] == [len(part.events_of(0)) for part in parts]
        assert states[3].measures["impacts"][r] == parts[3].measures["impacts"]


def test_resets_draw_anew_and_seeds_draw_the_same():
    vary = {"ground.adhesion.initial": ("0.1 uN", "1 uN"), "ground.friction.coefficient": 0.3}
    sim = ts.Session("millipede", robots=6, vary=vary)
    sim.reset(seed=4)
    first = sim.values["ground.adhesion.initial"]
    assert (first >= 1e-7).all() and (first <= 1e-6).all() and len(set(first)) == 6
    for k in range(4):
        sim.step({"L1": 14.0 * (k % 2)}, "2 ms")
    before = sim.state.x.copy()
    state = sim.reset(robots=[1, 4])
    again = sim.values["ground.adhesion.initial"]
    assert (again == first).tolist() == [True, False, True, True, False, True]
    assert state.time[[1, 4]].tolist() == [0.0, 0.0] and (state.x[[0, 2, 3, 5]] == before[[0, 2, 3, 5]]).all()
    fresh = ts.Session(
        "millipede", robots=6, vary={"ground.adhesion.initial": again, "ground.friction.coefficient": 0.3}
    )
    fresh.reset()
    mixed, own = sim.step({"L1": 9.0}, "3 ms"), fresh.step({"L1": 9.0}, "3 ms")
    assert mixed.x[[1, 4]].tobytes() == own.x[[1, 4]].tobytes()
    assert sim.reset(seed=4).time.max() == 0.0 and (sim.values["ground.adhesion.initial"] == first).all()


def test_what_is_no_command_moves_nothing():
    sim = ts.Session("millipede")
    sim.reset()
    sim.step({"L1": 3.0}, "1 ms")
    before = sim._bytes()
    wrong = [
        ({"drive": {"L2": 1.0}}, "there is no drive 'L2'; valid names are"),
        ({"drive": {"L1": np.nan}}, "finite volts"),
        ({"drive": {"L1": [1.0, 2.0]}}, "expected volts"),
        ({"dt": 0.0}, "dt: expected a time above 0 s"),
        ({"dt": "1 m"}, "dt: "),
        ({"gait": {"frequenzy": 3.0}}, "frequenzy"),
        ({"gait": {"frequency": -3.0}}, "frequency"),
        ({"gait": {"high": np.inf}}, "finite"),
        ({"gait": {"duty": [0.3, 0.4]}}, "gait.duty: expected one or 1 finite numbers"),
        ({"drive": {"L1": 1.0}, "gradients": ["signals.L1.amplitude"]}, "no"),
    ]
    for asked, said in wrong:
        with pytest.raises(ts.InputError, match=said):
            sim.step(**asked)
        assert sim._bytes() == before, asked


def test_a_robot_that_has_stopped_waits_for_a_reset():
    """Too many steps: the robot stays where it came to, and says why."""
    sim = ts.Session("millipede", accuracy=ts.Accuracy(steps=30))
    sim.reset()
    state = sim.step(dt="50 ms")
    assert not state.ok and state.code is ResultCode.STEP_LIMIT and 0.0 < state.time < 0.05
    with pytest.raises(ts.InputError, match="waits for a reset: The run stopped"):
        sim.step(dt="1 ms")
    assert sim.reset().ok


# ---- derivatives of a step


def _moved(sim, scene, dt, command, by, *, state=None, volts=0.0, value=None):
    """The end of the step where one of its numbers is moved a little."""
    other = sim.fork()
    if value is not None:
        moved = ts.with_values(scene, {value: float(ts.get_value(scene, value)) + by})
        other = ts.Session(moved, accuracy=sim.accuracy)
        other.reset()
        now, own = sim.fork()._robots(), other._robots()
        own.runs.time, own.runs.state, own.runs.feet = now.runs.time, now.runs.state, now.runs.feet
        own.commands = now.commands
    if state is not None:
        other._robots().runs.state[0, state] += by
    after = other.step({name: one + volts * by for name, one in command.items()}, dt)
    return np.concatenate([after.x, after.v])


@pytest.mark.parametrize(
    ("name", "path"),
    [
        ("cantilever", "ground.restitution.coefficient"),
        ("millipede", "robot.structure.legs.L1.stiffness_v"),
        ("hexapod-walker", "ground.restitution.coefficient"),
        ("a drive that creeps", "robot.structure.frequencies.0"),
    ],
)
def test_a_step_has_derivatives_by_state_command_and_ground(name, path):
    scene = SCENES[name]()
    sim = ts.Session(scene)
    sim.reset()
    drive = next(iter(scene.robot.drives))
    for k in range(4):
        sim.step({drive: 14.0 * (k % 2) - (7.0 if scene.gait is None else 0.0)}, "3 ms")
    command, dt = {drive: 8.5 if "creeps" in name else 9.0}, 6e-3  # a rise of 2 V begins to move one of its plays
    ahead = sim.fork()
    state, slopes = ahead.step(command, dt, gradients=[path])
    n = len(state.x)
    assert slopes.names == (path, f"drive.{drive}", *(f"state.{i}" for i in range(2 * n)))
    assert len(state.all_events) or "structure" in path
    assert np.isfinite(slopes.state).all() and slopes.by_state.shape == (2 * n, 2 * n) and not slopes.flags

    moved = {f"drive.{drive}": (1e-5, {"volts": 1.0}), path: (1e-4 * float(ts.get_value(scene, path)), {"value": path})}
    moved |= {f"state.{i}": (1e-10 if i < n else 1e-7, {"state": i}) for i in (0, n)}
    for number, (size, what) in moved.items():
        ends = [_moved(sim, scene, dt, command, sign * size, **what) for sign in (1.0, -1.0)]
        expected, found = (ends[0] - ends[1]) / (2.0 * size), slopes.by(number)
        there = np.concatenate([state.x, state.v])
        for part in (slice(n), slice(n, None)):
            noise = 1e-9 * np.abs(there[part]).max() / size  # what a step errs by
            off = slopes.error[part, slopes.names.index(number)].max()
            near = 1e-3 * np.abs(found[part]).max() + noise + 10.0 * off
            assert found[part] == pytest.approx(expected[part], rel=1e-3, abs=near), number
