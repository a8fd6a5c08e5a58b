"""What verbs write: the folder holds what is printed as JSON, `show` and `check` know it, and its page says it."""

from __future__ import annotations

import shlex

import pytest

from scene_files import SCENES
from validation.folders import drop_folder

FREE = "millipede-printed --free gait.duty,gait.frequency=100Hz:200Hz --request from_rest=10ms --threads 1"
TABLE = "--set ground.restitution.coefficient=0.8 --set signals.table.amplitude=0.5 --over height=0:0.2"
WRITTEN = [
    (
        f"branch {SCENES}/impact_oscillator.toml --along signals.shaker.amplitude=1V:0.95V --starts 4",
        "branch",
        "branch.nc branch.json",
        ("the scene's own motion", "end of the range", "its page, report.html"),
        "Several stable motions",
    ),
    (
        f"attractors {SCENES}/vibrating_table.toml {TABLE} --starts 12 --over speed=-0.5:0.5",
        "set of attractors",
        "attractors.json attractor-1.toml attractor-2.toml attractor-1.html attractor-2.html",
        ("device files: attractor-1.toml",),
        "Edges of basins",
    ),
    (
        "atlas cantilever --x robot.feet.tip.gap=80um:90um --y signals.pzt.amplitude=4V:6.5V --depth 4",
        "atlas",
        "atlas.json atlas.nc cells.csv scene.toml",
        ("period 2, held",),
        "A run of each class",
    ),
    (
        "design landing cantilever --foot tip --request effort=0.012 --request risk=nominal --request pairs=1",
        "landing design",
        "landing.h landing.json scenarios.csv scene.toml signal.toml",
        ("`tarsus design landing` wrote it",),
        "LANDING_DIGEST",
    ),
    (
        f"design adapt {FREE} --request candidates=64 --over ground.friction.coefficient=4:12"
        " --request sense=nothing --request hidden=4 --request training=4",
        "adaptive gait",
        "adapt.json hidden.csv",
        ("always",),
        "What is lost",
    ),
    ("validate {drop}", "validation", "validation.json validation.csv", (), "Rows outside the bands"),
]


@pytest.mark.parametrize(("line", "word", "files", "shown", "page"), WRITTEN, ids=[row[1] for row in WRITTEN])
def test_what_a_verb_writes_is_what_it_prints(tarsus, opened, tmp_path, line, word, files, shown, page):
    out = tmp_path / "out"
    done = tarsus(*shlex.split(line.format(drop=drop_folder(tmp_path / "drop"))), "-o", out, "--json")
    assert done.code == 0, done.err
    assert {one.name for one in out.iterdir()} >= {*files.split(), "report.html"}
    printed, stored = done.json(), opened(out, word, *shown)
    common = printed.keys() & stored.keys()
    assert len(common) > 3 and all(printed[key] == stored[key] for key in common)
    assert page in (out / "report.html").read_text(encoding="utf-8")
    for file in out.glob("*.nc"):
        assert opened(file, "series")["series"]


def test_several_experiments_have_a_folder_each_and_an_index(tarsus, tmp_path, monkeypatch):
    monkeypatch.setattr("tarsus.validation.experiment.experiment_names", lambda: ["mems-switch"])
    monkeypatch.setattr("tarsus.validation.verb.experiment_names", lambda: ["mems-switch"], raising=False)
    assert tarsus("validate", "--all", "-o", tmp_path / "out").code == 0
    names = {str(one.relative_to(tmp_path / "out")) for one in (tmp_path / "out").rglob("*.*")}
    assert {"index.html", "validation.json", "mems-switch/report.html", "mems-switch/validation.csv"} <= names
