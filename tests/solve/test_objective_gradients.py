"""Derivatives of one number of a run, against closed forms and against those of its events and states."""

from __future__ import annotations

import pytest

import tarsus as ts
from scene_files import scene as scene_of


def test_two_equal_balls_in_elastic_collision():
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
            pytest.approx(1.0, abs=1e-9),
            pytest.approx(0.0, abs=1e-9),
        )


def test_states_at_times():
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
        assert found[path] == pytest.approx(wanted, rel=1e-6)
