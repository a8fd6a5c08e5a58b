"""The documented table of a foot's states is what the engine does."""

from __future__ import annotations

import numpy as np
import pytest

import tarsus as ts
from tarsus.base.events import EVENT_WORDS, TRANSITIONS, EventKind, FootState
from tarsus.model.laws import Friction
from walking_devices import creeping_millipede
from walking_scenes import sticky, trotter


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


@pytest.fixture(scope="module")
def seen():
    return {change for run in runs() for foot in range(len(run.foot_names)) for change in changes(run, foot)}


def test_every_change_is_in_the_table(seen):
    found = {
        (before, after, "slip begins" if name == "turns round" else name) for before, after, name, _ in TRANSITIONS
    }
    assert seen <= found


def test_every_change_of_the_table_occurs(seen):
    for before, after, name, _ in TRANSITIONS:
        assert (before, after, "slip begins" if name == "turns round" else name) in seen, name
