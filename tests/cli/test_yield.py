"""`tarsus yield`: from a drawing to the share of robots that are good enough."""

from __future__ import annotations

import json
import shlex

import numpy as np
import pytest
import xarray as xr

from walking_devices import CREEPING

WORDS = shlex.split(
    f"yield {CREEPING} --scatter robot.drives.*.law.gain=10% --over ground.friction.coefficient=0.3:0.5 --dead 0:1"
    " --require mean_speed=0m/s --require foot_slip"
)
FEW = shlex.split("--robots 24 --draws 4 --from-rest 20ms")


def test_robots_become_curves_and_a_page(tarsus, tmp_path, opened):
    result = tarsus(*WORDS, *FEW, "-o", tmp_path / "out")
    assert result.code == 0, result.err
    assert "24 robots, from rest, 20 ms" in result.out and "%" in result.out and "matters most" in result.out
    found = json.loads((tmp_path / "out" / "yield.json").read_text(encoding="utf-8"))
    with xr.open_dataset(tmp_path / "out" / "robots" / "sweep.nc") as robots:
        speed = robots["mean_speed"].values
        gains = np.column_stack([robots[name].values for name in robots.coords if "gain" in str(name)])
    dead = (gains == 0.0).sum(axis=1)
    assert [(one["dead"], one["robots"]) for one in found["by_dead"]] == [(n, int((dead == n).sum())) for n in (0, 1)]
    curve = found["curves"]["mean_speed"]
    assert curve["requirement"][0] == pytest.approx(speed.min()) and curve["share"][0] == 1.0
    assert set(found["indices"]["mean_speed"]) == {"L1", "R1", "ground.friction.coefficient"}
    with xr.open_dataset(tmp_path / "out" / "legs" / "sweep.nc") as legs:
        assert legs.sizes["run"] == 4 * 5
    assert opened(tmp_path / "out", "yield", "matters most")["robots"] == 24
    collected = opened(tmp_path / "out" / "robots" / "sweep.nc", "series", "mean_speed")["series"]
    assert next(one["smallest"] for one in collected if one["name"] == "mean_speed") == speed.min()
    before = (tmp_path / "out" / "yield.json").read_bytes()
    again = tarsus(*WORDS, *FEW, "-o", tmp_path / "out", "--resume", "--json")
    said = json.loads(again.out)
    assert again.code == 0 and said["robots"] == 24 and list(said["shares"]) == ["mean_speed"]
    assert said["shares"]["mean_speed"][0] == pytest.approx((speed >= 0.0).mean())
    assert (tmp_path / "out" / "yield.json").read_bytes() == before


def test_runs_about_legs_can_be_left_out(tarsus, tmp_path):
    result = tarsus(*WORDS, "--robots", "6", "--starts", "2", "-o", tmp_path / "out")
    assert result.code == 0 and "6 robots, settled motion, runs of 1 s from 2 starts" in result.out
    found = json.loads((tmp_path / "out" / "yield.json").read_text(encoding="utf-8"))
    with xr.open_dataset(tmp_path / "out" / "robots" / "sweep.nc") as robots:
        assert found["settled"] == robots["settled"].values.mean() and set(2 * robots["settled"].values) <= {0, 1, 2}
    assert found["motion"] in (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    assert result.code == 0 and "runs" not in result.err.replace("runs/s", "")
    assert not (tmp_path / "out" / "legs").exists()
