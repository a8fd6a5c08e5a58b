"""`tarsus show` prints how sure a value is."""

from __future__ import annotations

import json
from pathlib import Path

import tarsus as ts

BALL = Path(__file__).parents[1] / "scenes" / "ball.toml"


def test_show_prints_the_rounding_of_the_printed_hexapod(tarsus):
    result = tarsus("show", "hexapod")
    assert result.code == 0
    line = next(line for line in result.out.splitlines() if line.startswith("robot.structure.frequencies"))
    assert "117.2396 Hz" in line and "2680 Hz to 3130 Hz" in line and "±" in line
    column = next(line for line in result.out.splitlines() if line.startswith("robot.structure.shapes.foot2"))
    assert "0.95 (0.86 to 1.04 over the rounding) here and 0.59 printed" in column


def test_show_gives_intervals_as_numbers(tarsus):
    by_path = {one["path"]: one for one in tarsus("show", "hexapod", "--json").json()["values"]}
    low, high = by_path["robot.structure.frequencies.5"]["interval"]
    assert 2600.0 < low < by_path["robot.structure.frequencies.5"]["value"] < high < 3200.0
    assert by_path["robot.feet.foot1.gap"]["interval"] is None


def test_show_without_intervals_has_no_column_for_them(tarsus):
    assert "95 % interval" not in tarsus("show", str(BALL)).out


def test_show_names_the_impact_map(tarsus):
    assert "impact map: dominant mode, made passive" in tarsus("show", "hexapod").out
    found = json.loads(tarsus("show", "hexapod", "--json").out)["impact_map"]
    assert found["map"] == "dominant mode" and found["passive"] is True
    assert abs(found["worst_gain"] - 1.0) < 1e-9


def test_show_names_the_landing_rule(tarsus, tmp_path):
    file = tmp_path / "slow.toml"
    ts.write_scene(
        ts.load_scene("cantilever", **{"ground.landing": ts.laws.RestituteFirst(speed=0.02)}), file
    )
    out = tarsus("show", str(file)).out
    assert "landing: restitution first, held when slow" in out
    assert "ground.landing.speed" in out
    assert json.loads(tarsus("show", str(file), "--json").out)["landing"] == "restitute_first"
    assert json.loads(tarsus("show", "hexapod", "--json").out)["landing"] == "capture_unless_pulled"
