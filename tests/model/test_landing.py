"""Landing rules as descriptions: files, paths, what is refused, where they are shown."""

from __future__ import annotations

import numpy as np

import tarsus as ts
from scene_files import scene
from tarsus.base.spec import float_paths
from tarsus.report.run_page import report_html

RULES = [ts.laws.CaptureUnlessPulled(), ts.laws.RestituteFirst(speed=0.02), ts.laws.PullAsPrinted()]


def test_a_table_is_a_rule_and_its_speed_has_a_path():
    device = ts.load_scene("hexapod")
    assert device.ground.landing is None and device.ground.landing_rule == ts.laws.CaptureUnlessPulled()
    slow = ts.with_values(device, {"ground.landing": {"kind": "restitute_first", "speed": "20 mm/s"}})
    assert ts.get_value(slow, "ground.landing.speed") == 0.02
    assert float_paths(slow)["ground.landing.speed"].unit == "m/s"
    assert ts.with_values(slow, {"ground.landing.speed": 0.03}).ground.landing.speed == 0.03


def test_coordinates_that_are_points_stand_for_themselves():
    bar = ts.Lumped(coordinates=("left", "right"), mass=(1.0, 1.0), stiffness=(1.0, 2.0), weights={"mid": (0.5, 0.5)})
    np.testing.assert_array_equal(bar.alone("right"), [0.0, 1.0])
    walker = ts.load_scene("millipede").robot.structure
    leg = next(iter(walker.legs))
    np.testing.assert_array_equal(walker.alone(leg), walker.row(leg))


def test_a_rule_that_is_given_is_named_in_reports():
    ball = ts.with_values(scene("ball"), {"ground.landing": RULES[1]})
    page = report_html(ts.simulate(ball, duration=1.0))
    assert "A foot that lands: restitution first, held when slow, speed 20 mm/s" in page.replace("\u00a0", " ")
    assert "A foot that lands" not in report_html(ts.simulate(scene("ball"), duration=1.0))
