"""How far an orbit's events are from others: slopes against differences, and what follows for a step."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import tarsus as ts
from scene_files import scene
from tarsus.orbits.follow import Follower, Point
from tarsus.orbits.margins import Coordinate, Margins


def along(of: ts.Scene, path: str, at: float, span: float) -> tuple[Follower, Point]:
    orbit = ts.periodic(of, values={path: at})
    follower = Follower.of(replace(orbit, scene=of), path, span)
    place = follower.place(at, orbit.state, follower.map(at))
    upward = np.append(np.zeros(len(place) - 1), 1.0)
    found = follower.solve(place, upward, at / span)
    assert found is not None
    return follower, found


@pytest.mark.parametrize(
    ("of", "path", "at", "span", "step"),
    [
        (ts.load_scene("cantilever"), "signals.pzt.amplitude", 8.0, 1.0, 1e-5),
        (ts.load_scene("cantilever"), "robot.feet.tip.gap", 65e-6, 1e-5, 1e-5),
        (scene("impact_oscillator"), "signals.shaker.frequency", 0.159, 0.01, 1e-5),
    ],
    ids=["drive", "gap", "period"],
)
def test_slopes_of_margins_are_those_of_differences(of, path, at, span, step):
    follower, here = along(of, path, at, span)
    own, levels = here.margins(), float(here.tangent @ here.place)
    assert own is not None

    def moved(part: float) -> np.ndarray:
        level = levels + part * step
        near = follower.solve(here.place + part * step * here.tangent, here.tangent, level, here)
        assert near is not None and near.sequence == here.sequence
        margins = near.margins(own.looks)
        assert margins is not None
        return margins.values

    slopes = (moved(1.0) - moved(-1.0)) / (2.0 * step)
    rounding = 1e-6 * np.abs(own.values) / step
    off = np.abs(slopes - own.slopes) / (np.abs(slopes) + rounding)
    seen = sum(own.looks)
    assert np.quantile(off[:, :seen], 0.95) < 1e-3  # the rest are least where a parabola hardly says it
    assert off[:, seen:].max() < 1e-3


def test_a_margin_that_dips_below_zero_between_two_points_leaves_no_room():
    def at(place: float) -> Margins:  # (x - 0.4)^2 - 0.01 beside one that stays
        values = np.array([(place - 0.4) ** 2 - 0.01, 1.0 + place])
        slopes = np.array([2.0 * (place - 0.4), 1.0])
        return Margins(np.array([values, values]), np.array([slopes, slopes]), (2,))

    assert at(0.0).room(at(1.0), [Coordinate.plain(1.0)]) < 1.0
    assert at(0.0).room(at(0.05), [Coordinate.plain(0.05)]) > 1.0
    assert at(0.7).room(at(1.0), [Coordinate.plain(0.3)]) > 1.0


def test_a_margin_that_goes_with_the_root_of_the_distance_to_a_change_has_room_up_to_it():
    def at(left: float) -> Margins:  # 1 - sqrt(left) / 2
        values, slopes = np.full((2, 1), 1.0 - 0.5 * np.sqrt(left)), np.full((2, 1), 0.25 / np.sqrt(left))
        return Margins(values, slopes, (1,))

    near, far = at(1e-6), at(1.0)
    assert far.room(near, [Coordinate.plain(1.0 - 1e-6)]) < 1.0 < far.room(near, [Coordinate.root(1.0, 1e-6)])
