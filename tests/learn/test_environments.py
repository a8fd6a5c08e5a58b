"""Robots as environments of Gymnasium: what it checks, seeds, actions, grounds, rewards, one and many."""

from __future__ import annotations

import re

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

import tarsus as ts
from tarsus import learn
from tarsus.files.draws import write_draws

GROUND = learn.GroundBox({"ground.friction.coefficient": (0.2, 0.6), "ground.adhesion.initial": (1e-7, 1e-6)})
ACTIONS = {
    "volts": learn.VoltageAction("0 V", 14.0),
    "ramps": learn.VoltageAction(0.0, 14.0, ramp=True),
    "switching": learn.SwitchingAction(0.0, 14.0),
    "phases": learn.PhaseAction(frequency=("60 Hz", 120.0), duty=(0.3, 0.7)),
}


def _make(**options):
    learn.register()
    options = {"scene": "millipede", "ground": GROUND, "dt": "2 ms", "steps": 5} | options
    return gymnasium.make("tarsus/Walker-v0", **options)


@pytest.mark.parametrize("actions", ACTIONS)
@pytest.mark.filterwarnings("ignore:.*(symmetric and normalized|infinity).*:UserWarning")
def test_gymnasium_finds_no_fault(actions):
    world = _make(actions=ACTIONS[actions], sensors=learn.Sensors(points=("body",)))
    check_env(world.unwrapped, skip_render_check=True)


def test_by_its_entry_point_gymnasium_registers_it():
    registration = gymnasium.envs.registration
    kept = registration.registry.pop(learn.ID, None)
    try:
        with registration.namespace("tarsus"):
            learn.register()
        assert registration.registry[learn.ID].entry_point == "tarsus.learn.walkers:WalkerEnv"
        learn.register()
    finally:
        if kept is not None:
            registration.registry[learn.ID] = kept


def test_seeds_draw_the_same_ground_and_actions_have_the_same_events():
    ways = []
    for seed in (7, 7, 8):
        world = _make()
        _, info = world.reset(seed=seed)
        assert set(info["ground"]) == set(GROUND.bounds)
        world.action_space.seed(1)
        rows = [world.step(world.action_space.sample()) for _ in range(5)]
        assert [row[3] for row in rows] == [False] * 4 + [True]
        ways.append((info["ground"], np.concatenate([row[0] for row in rows]), [row[1] for row in rows]))
    assert ways[0][0] == ways[1][0] != ways[2][0]
    assert ways[0][1].tobytes() == ways[1][1].tobytes() and ways[0][2] == ways[1][2] != ways[2][2]


def test_many_are_each_what_one_is():
    learn.register()
    worlds = gymnasium.make_vec(
        "tarsus/Walker-v0",
        num_envs=4,
        vectorization_mode="vector_entry_point",
        scene="millipede",
        ground=GROUND,
        dt="2 ms",
        steps=3,
    )
    seen, info = worlds.reset(seed=3)
    assert seen.shape == (4, 7) and worlds.observation_space.contains(seen)
    grounds = {path: of.copy() for path, of in info["ground"].items()}
    actions = np.random.default_rng(0).uniform(-1.0, 1.0, (3, 4, 2)).astype(np.float32)
    found = [worlds.step(one) for one in actions]
    assert found[1][3].tolist() == [False] * 4 and found[2][3].tolist() == [True] * 4
    assert (found[2][0] == seen).all() and found[2][4]["_final_obs"].all()
    for r in range(4):
        values = {path: float(of[r]) for path, of in grounds.items()}
        sim = ts.Session("millipede", robots=1, vary={path: [value] for path, value in values.items()})
        sim.reset()
        for step, action in zip(found, actions, strict=True):
            volts = 7.0 * (action[r].astype(float) + 1.0)
            state = sim.step({"L1": volts[0], "R1": volts[1]}, "2 ms")
            assert step[1][r] == pytest.approx(1e6 * float(state.measures["progress"][0]), rel=1e-9)


def test_sensors_see_what_there_is():
    sensors = learn.Sensors(points=("body",))
    scene = ts.load_scene("hexapod-walker")
    sim = ts.Session(scene, robots=1)
    sim.reset()
    state = sim.step(dt="7 ms")
    names, seen = sensors.names(scene), sensors.seen(state)[0].tolist()
    told = dict(zip(names, seen, strict=True))
    assert names[:3] == ["heave", "roll", "pitch"] and len(names) == len(set(names)) == len(seen)
    assert told["heave"] == pytest.approx(1e6 * float(state.body["heave"][0]), rel=1e-5)
    assert told["body"] == pytest.approx(told["heave"], rel=1e-5)
    assert sum(told[f"{name} contact"] for name in scene.robot.feet) == (state.contacts[0] > 0).sum()
    gain = scene.robot.drives["L1"].law.small_signal_gain()[0]
    leg = gain * float((state.v @ state.system.loads)[0, 0])
    assert told["L1 current"] == pytest.approx(1e9 * leg, rel=1e-5)


def test_switching_times_are_volts_within_the_step():
    world = _make(actions=ACTIONS["switching"], dt="4 ms")
    world.reset(seed=1)
    world.step(np.array([-0.5, 0.5, 1.0, -1.0], dtype=np.float32))
    commands = world.unwrapped.robots.session._robots().commands
    volts = [commands[name].volts(np.array([t]))[0] for name in ("L1", "R1") for t in (0.5e-3, 2e-3, 3.5e-3)]
    assert volts == [0.0, 14.0, 0.0, 14.0, 14.0, 14.0]


def test_actions_beyond_their_range_are_its_ends_and_every_number_is_its_own():
    scene = ts.load_scene("millipede")
    volts = ACTIONS["volts"].commands(scene, np.array([[2.0, -3.0]]), 1e-3)["drive"]
    gait = ACTIONS["phases"].commands(scene, np.array([[-1.0, 1.0, 0.5, -1.0]]), 1e-3)["gait"]
    assert [*volts.values()] == [14.0, 0.0]
    assert gait == {"phases.L1": 0.0, "phases.R1": 1.0, "frequency": 105.0, "duty": pytest.approx(0.3)}


def test_grounds_come_from_an_identification(tmp_path):
    draws = np.random.default_rng(2).uniform(0.2, 0.6, (50, 1))
    write_draws(tmp_path / "draws.npz", ["ground.friction.coefficient"], draws[0], draws)
    world = _make(ground=learn.Draws.of(tmp_path / "draws.npz"))
    seen = [world.reset(seed=k)[1]["ground"]["ground.friction.coefficient"] for k in range(8)]
    assert all(one in draws for one in seen) and len(set(seen)) > 4


def test_what_does_not_fit_is_said_in_a_sentence():
    with pytest.raises(ts.InputError, match=r"reward: 'progres': there is no 'progres'; did you mean 'progress'"):
        _make(reward="progres")
    with pytest.raises(ts.InputError, match="only numbers, names"):
        _make(reward="__import__('os').name")
    with pytest.raises(ts.InputError, match=r"give VoltageAction\(low, high\)"):
        _make(scene="cantilever")
    with pytest.raises(ts.InputError, match="the scene has no gait"):
        _make(scene="cantilever", actions=learn.PhaseAction())
    with pytest.raises(ts.InputError, match="two bounds in order"):
        learn.GroundBox({"ground.friction.coefficient": (0.6, 0.2)})
    with pytest.raises(ts.InputError, match="low: expected a voltage"):
        learn.VoltageAction("0 Hz", "14 V")
    for name, given in (("actions", "phases"), ("sensors", "body"), ("ground", "draws.npz"), ("reward", 3)):
        with pytest.raises(ts.InputError, match=f"{name}: expected .*, got {given!r}"):
            _make(**{name: given})
    with pytest.raises(ts.InputError, match="makes a plan of its own"):
        _make(ground=learn.GroundBox({"robot.structure.body.mass": (1e-7, 2e-7)})).reset()


@pytest.mark.parametrize("actions", ["volts", "switching", "phases"])
def test_an_action_that_does_not_fit_is_said_in_a_sentence(actions):
    one = learn.WalkerEnv("millipede", ACTIONS[actions], dt="1 ms")
    many = learn.WalkerVectorEnv(3, "millipede", ACTIONS[actions], dt="1 ms")
    size = one.action_space.shape[0]
    for world in (one, many):
        world.reset(seed=1)
    cases = [
        (one, np.zeros(size + 1), f"action: expected {size} numbers from -1 to 1, got {size + 1}"),
        (one, np.zeros(size - 1), f"got {size - 1}"),
        (one, 0.5, "got one number"),
        (one, "fast", "got 'fast'"),
        (one, np.full(size, np.nan), "action: every number must be finite"),
        (many, np.zeros(size), f"action: expected 3 rows of {size} numbers, one a robot, from -1 to 1, got {size}"),
        (many, np.zeros((2, size)), f"got 2 x {size}"),
    ]
    for world, action, said in cases:
        with pytest.raises(ts.InputError, match=re.escape(said)):
            world.step(action)
    assert one.robots.session.state.time == 0.0
