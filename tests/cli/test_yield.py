"""`tarsus yield`: from a drawing to the share of robots that are good enough."""

from __future__ import annotations

import json

import numpy as np
import pytest
import xarray as xr

from walking_devices import CREEPING

WORDS = (
    "--scatter", "robot.drives.*.law.gain=10%", "--over", "ground.friction.coefficient=0.3:0.5", "--dead", "legs=0:1",
    "--measure", "mean_speed", "--measure", "foot_slip", "--count", "24", "--draws", "4", "--chunk", "8",
)  # fmt: skip


@pytest.fixture(scope="module")
def creeping(tmp_path_factory) -> str:
    """The creeping millipede for a tenth of its time."""
    file = tmp_path_factory.mktemp("scene") / "creeping.toml"
    text = CREEPING.read_text(encoding="utf-8")
    file.write_text(text, encoding="utf-8")
    return str(file)


def test_robots_become_curves_and_a_page(tarsus, creeping, tmp_path):
    result = tarsus(
        "yield",
        creeping,
        *WORDS,
        "--set",
        "duration=60 ms",
        "--require",
        "mean_speed=0 m/s",
        "-o",
        tmp_path / "out",
    )
    assert result.code == 0, result.err
    (told,) = (one for one in result.sentences if "further runs" in one)
    assert (
        "after the 24 robots, 20 further runs (4 draws times 3 groups and 2)" in told and "--draws 0" in told
    )
    assert any("the 20 runs about legs follow, about " in one for one in result.sentences)
    assert "24 robots" in result.out and "mean_speed=0 m/s: " in result.out and "matters most" in result.out
    found = json.loads((tmp_path / "out" / "yield.json").read_text(encoding="utf-8"))
    with xr.open_dataset(tmp_path / "out" / "robots" / "sweep.nc") as robots:
        speed = robots["mean_speed"].values
        gains = np.column_stack([robots[name].values for name in robots.coords if "gain" in str(name)])
    dead = (gains == 0.0).sum(axis=1)
    assert [(one["dead"], one["robots"]) for one in found["by_dead"]] == [
        (n, int((dead == n).sum())) for n in (0, 1)
    ]
    curve = found["curves"]["mean_speed"]
    assert curve["requirement"][0] == pytest.approx(speed.min()) and curve["share"][0] == 1.0
    assert set(found["indices"]["mean_speed"]) == {"L1", "R1", "ground.friction.coefficient"}
    with xr.open_dataset(tmp_path / "out" / "legs" / "sweep.nc") as legs:
        assert legs.sizes["run"] == 4 * 5
    page = (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    assert "Yield against requirement" in page and "Whose scatter matters" in page and "Dead legs" in page
    before = (tmp_path / "out" / "yield.json").read_bytes()
    again = tarsus(
        "yield", creeping, *WORDS, "--set", "duration=60 ms", "-o", tmp_path / "out", "--resume", "--json"
    )
    assert again.code == 0 and json.loads(again.out)["robots"] == 24
    assert (tmp_path / "out" / "yield.json").read_bytes() == before


def test_runs_about_legs_can_be_left_out(tarsus, creeping, tmp_path):
    words = [*WORDS[: WORDS.index("--draws")], "--draws", "0", "--chunk", "8", "--set", "duration=20 ms"]
    result = tarsus("yield", creeping, *words, "--no-report", "-o", tmp_path / "out")
    assert result.code == 0 and "runs" not in result.err.replace("runs/s", "")
    assert not (tmp_path / "out" / "legs").exists()


def test_a_requirement_on_nothing_is_told(tarsus, creeping, tmp_path):
    result = tarsus("yield", creeping, *WORDS, "--require", "stride=1", "-o", tmp_path / "out")
    assert (
        result.code == 2
        and "--require takes measure=value, one of mean_speed, foot_slip" in result.sentences[0]
    )
    assert not (tmp_path / "out").exists()
