"""Where walks are cut: never within a contact, and by the body's half period on a leg."""

from __future__ import annotations

import numpy as np
import pytest

import tarsus as ts
from tarsus.base.events import EventKind
from tarsus.identify.walk_edges import QUIET, contact_time, edge_after
from tarsus.model.structure import Walker


def events_at(*found: tuple[float, int]) -> np.ndarray:
    return np.array(list(found), dtype=[("time", float), ("kind", int)])


LANDS, OTHER = EventKind.CAPTURE, EventKind.RELEASE


def test_a_body_stands_on_a_leg_for_half_a_period() -> None:
    walker = ts.load_scene("millipede").robot.structure
    assert isinstance(walker, Walker)
    leg = min(one.stiffness_v for one in walker.legs.values())
    assert contact_time(walker) == pytest.approx(np.pi / np.sqrt(leg / walker.body.mass), rel=1e-12)


def test_edges_are_in_the_middle_of_the_first_quiet_stretch_after_a_contact() -> None:
    # a release at 1, bounces at 5 to 5.2, released at 6, then nothing until 12
    seen = events_at((1.0, OTHER), (5.0, LANDS), (5.1, LANDS), (5.2, LANDS), (6.0, OTHER), (12.0, LANDS))
    assert edge_after(seen, 0.0, 20.0, 1.0) == pytest.approx(9.0)
    # before the first contact there is as much quiet, and no edge
    assert edge_after(seen[1:], 0.0, 20.0, 1.0) == pytest.approx(9.0)
    # where no stretch is that quiet the longest one soon after the first contact is cut
    assert edge_after(seen[1:], 0.0, 7.5, 1.0) == pytest.approx(6.75)
    assert edge_after(seen[1:-1], 0.0, 6.05, 1.0) == pytest.approx(5.6)
    # a release alone is no contact
    assert edge_after(seen[:1], 0.0, 7.0, 1.0) == 7.0
    assert edge_after(seen[:0], 0.0, 7.0, 1.0) == 7.0


@pytest.mark.parametrize("hz", [50.0, 102.0])
def test_no_edge_of_a_walk_lies_near_an_event(hz: float) -> None:
    scene = ts.load_scene("millipede", hz=hz, volts=14)
    assert isinstance(scene.robot.structure, Walker)
    events = ts.simulate(scene, 0.1).events
    contact, edge, edges = contact_time(scene.robot.structure), 3e-3, []
    while edge < 0.075:
        edge = edge_after(events, edge, edge + 20.0 * contact, contact)
        edges.append(edge)
    nearest = np.abs(events["time"][:, None] - np.array(edges)).min(axis=0)
    assert np.median(nearest) > 0.5 * QUIET * contact  # half of a quiet stretch, most of them in flight
    assert nearest.min() > 0.1 * contact  # a bounce is over within a hundredth of it
