"""Derivatives of one number backwards over a run, against closed forms and against derivatives carried forwards."""

from __future__ import annotations

import numpy as np
import pytest

import tarsus as ts
from random_scenes import plain_scene
from scene_files import scene as scene_of
from scene_files import with_gradients
from tarsus.base.spec import float_paths, get_value
from tarsus.measure.periods import PER_WINDOW
from tarsus.measure.whole import WHOLE_RUN
from tarsus.plan.slots import slots
from tarsus.solve import objective as module
from tarsus.solve.adjoint import Seeds, swept
from tarsus.solve.engine import settings_of
from tarsus.solve.simulate import RECORDED


@pytest.fixture
def backwards_alone(monkeypatch):
    """Nothing is followed forwards."""

    def none(*_):
        raise AssertionError("followed forwards")

    monkeypatch.setattr(module, "_forwards", none)


def test_two_equal_balls_in_elastic_collision(backwards_alone):
    """They change places: what the second one does in the end is what the first one began, (1, 0, 1, 0)."""
    structure = ts.Lumped(  # their centre, and how far apart they are less 1 m: 2 m c'^2 / 2 + m / 2 r'^2 / 2 of energy
        coordinates=("centre", "apart"), mass=((2.0, 0.0), (0.0, 0.5)), stiffness=((0.0, 0.0), (0.0, 0.0))
    )
    scene = ts.Scene(
        name="balls",
        robot=ts.Robot(structure=structure, feet={"between": ts.Foot(point="apart", gap=1.0)}),
        ground=ts.Ground(restitution=ts.Restitution(coefficient=1.0)),
        initial=ts.Initial(
            displacement=(0.0, 0.0), velocity=(1.0, -2.0)
        ),  # the first at 2 m/s, the second at rest
        duration=2.0,
    )
    for field, state in (("displacement", "x"), ("velocity", "v")):
        paths = [f"initial.{field}.{k}" for k in range(2)]

        def second(events, states, state=state):
            return float(getattr(states, state)[0, 0] + 0.5 * getattr(states, state)[1, 0])

        centre, apart = ts.gradient(second, scene, paths, times=[1.5]).values()
        assert (0.5 * centre - apart, 0.5 * centre + apart) == (
            pytest.approx(1.0, abs=1e-12),
            pytest.approx(0.0, abs=1e-12),
        )


def numbers_of(run: ts.solve.GradientRun, kinds: dict[str, list[int]]):
    """What single numbers of events, and states, come to along the tangents, and backwards: name, both, their size."""
    times = np.linspace(0.0, run.end_time, 9)[1:-1] * 0.997
    rows, tangents = run.log.events, run._tangents(times)
    recorded, settings = (
        run.raw,
        settings_of(run.plan, run.duration, run.accuracy or RECORDED, record=True),
    )
    rng = np.random.default_rng(1)
    for name, columns in kinds.items():
        seeds = Seeds(np.zeros_like(rows), times, np.zeros(tangents.samples.shape[:2]))
        for column in columns:
            largest = np.abs(rows[:, column]).max(initial=0.0)
            seeds.events[:, column] = rng.normal(size=len(rows)) / largest if largest > 1e-12 else 0.0
        if not columns:
            sizes = np.abs(tangents.samples).max(axis=(0, 2))
            seeds.samples[:] = rng.normal(size=seeds.samples.shape) / np.where(sizes > 0.0, sizes, 1.0)
        found = swept(run.plan, run.raw.book, run.entered, recorded, settings, seeds)
        assert found is not None
        parts = [seeds.events[..., None] * tangents.events, seeds.samples[..., None] * tangents.samples]
        wanted = np.sum([part.sum(axis=(0, 1)) for part in parts], axis=0)
        size = np.sum([np.abs(part).sum(axis=(0, 1)) for part in parts], axis=0)
        yield name, found, wanted, size, tangents.flags


KINDS = {"time": [0], "impact": [3, 4, 5, 6, 7, 8], "apex": [9], "integral": [11], "states": []}


def assert_as_forwards(scene: ts.Scene, duration: float | None) -> None:
    run, paths = with_gradients(scene, duration)
    values = np.array([abs(float(get_value(scene, path))) or 1.0 for path in paths])
    for name, (got, flags), wanted, size, forwards in numbers_of(run, KINDS):
        scale = np.maximum(size, 1e-4 * size.max() / values)
        known = np.isfinite(wanted)
        np.testing.assert_array_less(np.abs(got - wanted)[known], 1e-9 * scale[known] + 1e-300, err_msg=name)
        # what concerns energies alone, 6, is not asked for
        assert {flag for flag in flags if flag[1] != 6} == {
            tuple(flag) for flag in forwards.tolist() if flag[1] != 6
        }


@pytest.mark.parametrize(
    ("name", "duration"),
    [("p1_n2", 0.06), ("sticky_feet", 0.043), ("three_feet", 0.012), ("damped_chain", 0.02), ("mems_switch", None),
     ("impact_oscillator", 20.0)],
)  # fmt: skip
def test_backwards_as_forwards(name, duration):
    """Contact, film, adhesion, electrostatics and moving edges of drives, events and states."""
    assert_as_forwards(scene_of(name), duration)


@pytest.mark.parametrize("seed", [2, 3, 6, 10, 18, 26, 36])
def test_backwards_as_forwards_of_random_scenes(seed):
    assert_as_forwards(plain_scene(seed, legged=False), None)


def test_feet_that_hand_impacts_on_at_one_moment_go_forwards():
    """A foot that lands lets two others go, and one of them strikes the ground at that very moment."""
    scene = plain_scene(165, legged=False)
    run, paths = with_gradients(scene, None)
    assert np.diff(run.events["time"])[2:5].tolist() == [0.0, 0.0, 0.0]
    got, wanted = ts.gradient("hardest_impact", scene, paths), run.gradient("hardest_impact")
    assert list(got) == paths and any(wanted[path] for path in paths)
    for path in paths:
        assert got[path] == pytest.approx(wanted[path], rel=1e-12), path


@pytest.mark.parametrize(("name", "duration"), [("sticky_feet", 0.05), ("three_feet", 0.015)])
def test_measures_backwards_as_forwards(name, duration):
    scene = scene_of(name)
    paths = list(slots(scene))
    run = ts.simulate(scene, duration, gradients=paths)
    for measure in (*PER_WINDOW, *WHOLE_RUN):
        wanted, got = run.gradient(measure), ts.gradient(measure, scene, paths, duration)
        assert list(got) == paths and set(got.flags) == set(wanted.flags)
        if measure.removeprefix("total_") in (
            "bounces",
            "rebounds",
            "rebounds_any_height",
            "impacts",
        ):  # counts
            assert all(got[path] == 0.0 for path in paths if path not in got.flags)
            continue
        for path in paths:
            size = abs(run.measures[measure].value) / (abs(float(get_value(scene, path))) or 1.0)
            assert got[path] == pytest.approx(wanted[path], rel=1e-6, abs=1e-9 * size, nan_ok=True), (
                measure,
                path,
            )


def test_states_at_times(backwards_alone):
    scene, times = scene_of("p1_n2"), [0.011, 0.0305]
    paths = ["ground.film.coefficient", "signals.pull.duty", "robot.feet.tip.gap"]

    def squares(events, states):
        return float((states.x**2).sum() + states.v[0, 1] + events["time"][3])

    found = ts.gradient(squares, scene, paths, 0.04, times=times)
    run = ts.simulate(scene, 0.04, gradients=paths)
    states, moved = run.states(times), run.state_gradients(times)
    for path in paths:
        wanted = (
            2.0 * (states.x * moved[path].x).sum()
            + moved[path].v[0, 1]
            + run.event_gradients[path]["time"][3]
        )
        assert found[path] == pytest.approx(wanted, rel=1e-8)


def test_numbers_of_the_structure_and_energies_are_followed_forwards():
    scene, paths = scene_of("p1_n2"), ["robot.structure.stiffness.0.0", "ground.film.coefficient"]
    run = ts.simulate(scene, 0.03, gradients=paths)
    for name in ("contact_duration", "ledger.film"):
        found, wanted = ts.gradient(name, scene, paths, 0.03), run.gradient(name)
        assert list(found) == paths
        for path in paths:
            assert found[path] == pytest.approx(wanted[path], rel=1e-6)


def test_a_walker_is_followed_forwards():
    scene, path = ts.load_scene("millipede"), "ground.friction.coefficient"
    found = ts.gradient(lambda events: events["time"][2], scene, [path], 0.004)
    run = ts.simulate(scene, 0.004, gradients=[path])
    assert found[path] == run.gradient_of(lambda events: events["time"][2])[path]


def test_each_of_many_numbers_of_a_drive(backwards_alone):
    scene = scene_of("p1_n2")
    times = np.linspace(0.0, 0.04, 41)[:-1]
    wave = ts.Sampled(times=tuple(times), levels=tuple(250.0 * np.random.default_rng(3).uniform(size=40)))
    scene = scene.model_copy(update={"signals": {"pull": wave}})
    paths = [path for path in float_paths(scene) if path.startswith("signals.pull.levels")]
    found = ts.gradient("impact_speed", scene, paths, 0.04)
    wanted = ts.simulate(scene, 0.04, gradients=paths).gradient("impact_speed")
    largest = max(abs(value) for value in wanted.values())
    assert largest > 0.0
    np.testing.assert_allclose([*found.values()], [*wanted.values()], rtol=0.0, atol=1e-9 * largest)
