"""Landing rules as descriptions: files, paths, what is refused, where they are shown."""

from __future__ import annotations

import numpy as np
import pytest

import tarsus as ts
from scene_files import scene
from tarsus.base.spec import float_paths
from tarsus.files.toml import parse_scene, scene_text
from tarsus.report.run_page import report_html

RULES = [ts.laws.CaptureUnlessPulled(), ts.laws.RestituteFirst(speed=0.02), ts.laws.PullAsPrinted()]


@pytest.mark.parametrize("rule", RULES, ids=lambda rule: rule.kind)
def test_a_rule_survives_its_file(rule):
    device = ts.with_values(ts.load_scene("cantilever"), {"ground.landing": rule})
    assert parse_scene(scene_text(device)).ground.landing == rule


def test_a_table_is_a_rule_and_its_speed_has_a_path():
    device = ts.load_scene("hexapod")
    assert device.ground.landing is None and device.ground.landing_rule == ts.laws.CaptureUnlessPulled()
    slow = ts.with_values(device, {"ground.landing": {"kind": "restitute_first", "speed": "20 mm/s"}})
    assert ts.get_value(slow, "ground.landing.speed") == 0.02
    assert float_paths(slow)["ground.landing.speed"].unit == "m/s"
    assert ts.with_values(slow, {"ground.landing.speed": 0.03}).ground.landing.speed == 0.03


def two_modes(**shapes) -> ts.Scene:
    """A foot on a structure of two modes with the given shapes."""
    return ts.Scene(
        name="two modes",
        robot=ts.Robot(
            structure=ts.Modal(
                frequencies=(10.0, 20.0), damping_ratios=(0.0, 0.0), modal_masses=(1.0, 1.0), shapes=shapes
            ),
            feet={"foot": ts.Foot(point="foot", gap=1e-3)},
        ),
        duration=1.0,
    )


@pytest.mark.parametrize(
    "shapes",
    [
        {"foot": (1.0, 1.0)},
        {"foot": (1.0, 1.0), "hip": (2.0, 2.0)},
        {"foot": (1.0, 1.0), "hip": (2.0, 1.0), "knee": (1.0, 0.0)},
    ],
    ids=["too few points", "alike", "too many"],
)
def test_the_pull_as_printed_needs_points_that_are_coordinates(shapes):
    other = two_modes(**shapes)
    for rule in RULES[:2]:
        ts.with_values(other, {"ground": ts.Ground(landing=rule)})
    with pytest.raises(ts.InputError, match=r"ground\.landing: .*K_pp.*2 coordinates"):
        ts.with_values(other, {"ground": ts.Ground(landing=RULES[2])})
    right = ts.with_values(two_modes(foot=(1.0, 1.0), hip=(2.0, 1.0)), {"ground": ts.Ground(landing=RULES[2])})
    np.testing.assert_allclose(right.robot.structure.alone("foot"), [-1.0, 2.0], rtol=1e-12)


def test_coordinates_that_are_points_stand_for_themselves():
    bar = ts.Lumped(coordinates=("left", "right"), mass=(1.0, 1.0), stiffness=(1.0, 2.0), weights={"mid": (0.5, 0.5)})
    np.testing.assert_array_equal(bar.alone("right"), [0.0, 1.0])
    with pytest.raises(ts.InputError, match="'mid' is a combination"):
        bar.alone("mid")
    walker = ts.load_scene("millipede").robot.structure
    leg = next(iter(walker.legs))
    np.testing.assert_array_equal(walker.alone(leg), walker.row(leg))
    with pytest.raises(ts.InputError, match="no coordinate of a walker"):
        walker.alone(f"{leg}_hip")


def test_a_rule_that_is_given_is_named_in_reports():
    ball = ts.with_values(scene("ball"), {"ground.landing": RULES[1]})
    page = report_html(ts.simulate(ball, duration=1.0))
    assert "A foot that lands: restitution first, held when slow, speed 20 mm/s" in page.replace("\u00a0", " ")
    assert "A foot that lands" not in report_html(ts.simulate(scene("ball"), duration=1.0))
