"""Windows: runs from any moment and state, with outputs at any times, and their derivatives."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

import tarsus as ts
from differences import AROUND, slope
from scene_files import creeping
from scene_files import scene as scene_of
from scene_kinds import KINDS, over
from sliding_scenes import cantilever as sliding
from tarsus.base.spec import get_value, with_values
from tarsus.plan.lowering import lower_scene
from tarsus.solve.contacts import Contacts
from tarsus.solve.engine import Accuracy
from tarsus.solve.window import WindowBatch, WindowGradients, WindowStart, simulate_windows
from walking_scenes import sticky, trotter


def contacts_at(run: ts.Run, held: np.ndarray, time: float) -> Contacts:
    """What the feet of a run do at a time."""
    begun = run.events[np.isin(run.events["kind"], (2, 4, 5)) & (run.events["time"] <= time)]
    numbers = [int(i) for i in np.flatnonzero(held)]
    return Contacts(numbers, [float(begun["time"][begun["foot"] == i][-1]) for i in numbers])


@over(
    modal=(0, 2, 3),
    legged=range(6),
    creeping=(0, 3),
    moving=(1, 2, 4),
    sliding=(1, 2, 5),
    turning=(0, 2, 4),
    uneven=range(4),
)
def test_a_window_from_the_middle_of_a_run_goes_on_as_the_run(kind, seed):
    scene = KINDS[kind](seed)
    duration = scene.duration
    run, plan = ts.simulate(scene), lower_scene(scene)
    times = np.linspace(0.0, duration, 301)
    series = run.at(times)
    states = series.state
    assert states.held.any()
    for k in (0, 97, 200):
        start = np.concatenate([states.x[:, k], states.v[:, k]])
        given = WindowStart(start, times[k], times[k:], contacts_at(run, states.held[:, k], times[k]))
        window = simulate_windows(plan, [given])[0]
        later = run.events[run.events["time"] > times[k]]
        assert list(window.events["kind"]) == list(later["kind"])
        np.testing.assert_allclose(window.events["time"], later["time"], rtol=0, atol=1e-9 * duration)
        pairs = [(getattr(window.states, one), getattr(states, one), 1e-7) for one in ("x", "v", "pull")]
        pairs += [(force, series.laws[law], 1e-6) for law, force in window.forces.items()]
        for got, wanted, within in pairs:
            np.testing.assert_allclose(got, wanted[:, k:], rtol=0, atol=within * np.abs(wanted).max())
        assert np.array_equal(window.states.held, states.held[:, k:])


def test_a_foot_that_is_leaving_flies_though_its_contact_would_hold_it():
    scene = scene_of("p1_n2")
    plan = lower_scene(scene)
    run = ts.simulate(scene, 0.02)
    release = float(run.events["time"][run.events["kind"] == 3][-2])
    at = release - 1e-7
    states = run.states(np.array([at]))
    assert states.held[0, 0] and states.pull[0, 0] > 0.0
    start = np.concatenate([states.x[:, 0], states.v[:, 0]])
    times = at + np.linspace(0.0, 5e-8, 5)
    stays = simulate_windows(plan, [WindowStart(start, at, times)])[0]
    leaves = simulate_windows(plan, [WindowStart(start, at, times, Contacts(leaving=(0,)))])[0]
    assert stays.states.held.all() and stays.events["kind"][0] == 5
    assert not leaves.states.held.any()


FINE = Accuracy(gap=1e-13, drive=1e-13)
FIELDS = ("x", "v", "gap", "rate", "resistive", "smooth", "pull")


def starts_in(run: ts.Run, count: int, span: float, seed: int) -> list[WindowStart]:
    """Windows of so long that begin at random times of a run, as the run has it there."""
    random, out = np.random.default_rng(seed), []
    for t0 in random.uniform(0.02 * run.duration, run.duration - span, count).tolist():
        at = run.states(np.array([t0]))
        times = t0 + span * np.sort(random.uniform(0.05, 1.0, 6))
        state, contacts = np.concatenate([at.x[:, 0], at.v[:, 0]]), contacts_at(run, at.held[:, 0], t0)
        out.append(WindowStart(state, t0, times, contacts))
    return out


def difference(of: Callable[[float], WindowBatch], step: float) -> dict[str, np.ndarray]:
    """Fourth-order difference of the states of windows."""
    there = [of(k * step).states for k in AROUND]
    return {name: slope([getattr(one, name) for one in there], step) for name in FIELDS}


def moved(starts: list[WindowStart], name: str, by: float) -> list[WindowStart]:
    """The same windows with a number of their start otherwise."""
    if name == "t0":
        return [replace(one, t0=one.t0 + by) for one in starts]
    unit = np.eye(len(np.asarray(starts[0].state)))[int(name.removeprefix("state."))]
    return [replace(one, state=np.asarray(one.state) + by * unit) for one in starts]


ROUGH = {"kind": "random", "seed": 3, "rms": 2e-7, "correlation_length": 3e-5, "spacing": 1e-5, "facets": 256}
MU, LATE = "ground.friction.coefficient", {"bandwidth": 3000.0, "slew_rate": 2e5}
CASES = {
    "chain": (lambda: scene_of("p1_n2"), ("ground.film.coefficient", "signals.pull.amplitude"), 0.1, 0.008, 16, True),
    "rough ground": (
        lambda: with_values(trotter(3, ground=sticky()), {"ground.profile": ROUGH}),
        ("ground.profile.rms", MU),
        0.02,
        0.002,
        12,
        True,
    ),
    "legs that move across": (
        lambda: ts.load_scene("turning-hexapod"),
        (MU, "robot.structure.body.mass"),
        0.03,
        0.004,
        4,
        False,
    ),
    "feet that slide": (sliding, (MU, "robot.structure.modal_masses.0"), 0.03, 0.004, 4, False),
    "a drive that creeps": (
        creeping,
        ("signals.pzt.amplitude", "robot.structure.frequencies.0"),
        0.03,
        0.004,
        4,
        False,
    ),
    "a slow amplifier": (
        lambda: with_values(ts.load_scene("cantilever", wave="square"), {"robot.drives.pzt.amplifier": LATE}),
        ("signals.pzt.amplitude", "robot.drives.pzt.amplifier.bandwidth"),
        0.03,
        0.004,
        4,
        False,
    ),
}
"""Scene, numbers, seconds of its run and of a window, windows, and whether their starts are varied as well."""


@pytest.mark.parametrize("name", [pytest.param(n, marks=[pytest.mark.slow] * (n == "rough ground")) for n in CASES])
def test_windows_move_as_their_derivatives_say(name: str) -> None:
    """By differences of windows that start otherwise, or of scenes that are lowered anew."""
    make, paths, duration, span, count, begins = CASES[name]
    scene = make()
    run, plan = ts.simulate(scene, duration), lower_scene(scene)
    starts = starts_in(run, count, span, 1 if begins else 2)
    by = WindowGradients.of(scene, plan, paths, state=begins, t0=begins)
    found = simulate_windows(plan, starts, gradients=by, accuracy=FINE)
    assert found.slopes is not None and len(found.rows) > 1
    assert not begins or sum(len(one.events) for one in found) >= count // 4
    size = {name: np.abs(getattr(found.states, name)).max() for name in FIELDS}
    speeds = np.abs(np.array([one.state for one in starts])).max(axis=0)
    for p, name in enumerate(found.slopes.names):
        own = float(get_value(scene, name)) if name in paths else 0.0

        def of(step: float, name: str = name, own: float = own) -> WindowBatch:
            if name not in paths:
                return simulate_windows(plan, moved(starts, name, step), accuracy=FINE)
            other = lower_scene(with_values(scene, {name: own + step}))
            return simulate_windows(replace(other, length=plan.length, force=plan.force), starts, accuracy=FINE)

        scale = own or (span if name == "t0" else speeds[int(name.removeprefix("state."))])
        off, beyond = {}, {}
        for part in (1e-4, 1e-5, 1e-6):  # the best of several steps: far ones cross events, near ones round
            for field, value_ in difference(of, part * scale).items():
                got, told = (getattr(of, field)[..., p] for of in (found.slopes.states, found.slopes.state_errors))
                error = np.abs(value_ - got) * scale / size[field] if size[field] else np.abs(value_ - got)
                more = np.abs(value_ - got) > 10.0 * told + 1e-5 * size[field] / scale
                beyond[field] = beyond.get(field, True) & more
                most = np.array(
                    [error[:, a:b].max(initial=0.0) for a, b in zip(found.first, found.first[1:], strict=False)]
                )
                off[field] = np.minimum(off.get(field, np.inf), most)
        for field, most in off.items():
            assert np.nanmedian(most) < 1e-5, (name, field, most)
            assert np.mean(most > 1e-4) <= 0.1, (name, field, most)
            assert np.mean(beyond[field]) <= 5e-3, (name, field)  # where differences cross an event


def test_one_window_is_that_of_many() -> None:
    scene = scene_of("p1_n2")
    plan, run = lower_scene(scene), ts.simulate(scene, 0.05)
    starts = starts_in(run, 5, 0.004, 3)
    by = WindowGradients.of(scene, plan, ["ground.film.coefficient"])
    many = simulate_windows(plan, starts, gradients=by)
    for one, start in zip(many, starts, strict=True):
        alone = simulate_windows(plan, [WindowStart(start.state, start.t0, start.times, start.contacts)], gradients=by)[
            0
        ]
        assert one.slopes is not None and alone.slopes is not None
        np.testing.assert_allclose(one.states.x, alone.states.x, rtol=0, atol=1e-9 * plan.length)
        off = 10.0 * (one.slopes.state_errors.x + alone.slopes.state_errors.x)
        assert np.all(np.abs(one.slopes.states.x - alone.slopes.states.x) <= off)
        assert len(one.events) == len(alone.events)


def test_a_ball_lands_later_by_its_start_as_in_closed_form() -> None:
    """t = t0 + (v + sqrt(v^2 + 2 a h)) / a: by v (1 + v / s) / a, by h 1 / s, by the start 1."""
    scene = scene_of("ball")
    plan = lower_scene(scene)
    assert plan.initial.size == 2
    start = simulate_windows(plan, [WindowStart(plan.initial, 0.25, [3.0])], gradients=WindowGradients())[0]
    assert start.slopes is not None and start.slopes.names == ("state.0", "state.1", "t0")
    event, slopes = start.events[0], start.event_slopes("time")[0]
    fall = float(event["time"]) - 0.25
    speed = float(event["speed_before"])
    acceleration = (speed + float(plan.initial[1])) / fall
    assert slopes == pytest.approx([1.0 / speed, (1.0 + plan.initial[1] / speed) / acceleration, 1.0], rel=1e-8)


def test_a_window_has_its_own_flags_whatever_windows_lie_beside_it() -> None:
    """An edge of the drive lies at the very start of some: with a larger phase it is there, with a smaller one not."""
    scene = scene_of("p1_n2", {"signals.pull.phase": 0.0})
    plan = lower_scene(scene)
    paths = ("ground.film.coefficient", "signals.pull.phase")
    gradients = WindowGradients.of(scene, plan, paths, state=False, t0=False)
    state = np.zeros(2 * len(plan.system.mass))
    starts = [WindowStart(state, t0, t0 + np.linspace(1e-4, 4e-4, 4), Contacts()) for t0 in (0.0, 0.0013, 0.0)]
    every = simulate_windows(plan, starts, gradients=gradients)
    alone = [simulate_windows(plan, [one], gradients=gradients)[0] for one in starts]
    assert [dict(one.flags) for one in every] == [dict(one.flags) for one in alone]
    assert [list(one.flags) for one in every] == [["signals.pull.phase"], [], ["signals.pull.phase"]]
    assert [np.isnan(one.slopes.states.x[..., 1]).all() for one in every] == [True, False, True]
