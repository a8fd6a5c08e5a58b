"""`tarsus atlas` from the command line."""

from __future__ import annotations

import csv
import json
import shlex

import numpy as np

from tarsus.cli import main

WORDS = shlex.split("atlas cantilever --x robot.feet.tip.gap=80um:90um --y signals.pzt.amplitude=4V:6.5V --depth 4")


def test_the_run_of_a_cell_is_that_of_its_command_line(tmp_path, capsys):
    out = tmp_path / "out"
    assert main([*WORDS[:-1], "3", "-o", str(out), "-q"]) == 0
    assert "period" in capsys.readouterr().out
    rows = list(csv.DictReader((out / "cells.csv").open(encoding="utf-8")))
    row = next(one for one in rows if one["class"] == "period 2, held")
    sets = [f"--set={name.partition(' ')[0]}={row[name]}" for name in list(row)[:2]]
    assert main(["simulate", str(out / "scene.toml"), *sets, "--duration", "2s", "--json"]) == 0
    run = json.loads(capsys.readouterr().out)
    assert run["settled"]["multiple"] == 2
    impacts = run["measures"]["impacts"]["value"]
    assert np.isclose(impacts, float(row["impacts"]), rtol=0.02)


def test_a_packaged_study_is_a_map(tmp_path, capsys):
    out = tmp_path / "out"
    words = shlex.split("atlas cantilever-gap-map --set robot.drives.pzt.capacitance=2nF --depth 2 --json --no-report")
    assert main([*words, "-o", str(out)]) == 0
    found = json.loads(capsys.readouterr().out)
    assert (out / "atlas.nc").exists() and not (out / "report.html").exists()
    assert found["x"]["path"] == "robot.feet.tip.gap" and found["points"] == [5, 5]
