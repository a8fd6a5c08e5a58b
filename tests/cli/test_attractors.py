"""`tarsus attractors` from the command line."""

from __future__ import annotations

import json

import numpy as np
import pytest

import tarsus as ts
from tarsus.cli import main


@pytest.mark.slow
def test_a_start_leads_to_its_motion_from_a_file_and_through_changed_values(tmp_path, capsys):
    """A walker that stands in its description: the written start, and the same values set in the description, run
    alike to the last digit, and to the attractor that they are said to lead to."""
    assert main(["attractors", "millipede", "--starts", "12", "--no-edges", "-o", str(tmp_path / "out"), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)["attractors"]
    assert len(found) > 1
    for i, one in enumerate(found, start=1):
        assert main(["simulate", str(tmp_path / "out" / f"attractor-{i}.toml"), "--json"]) == 0
        read = json.loads(capsys.readouterr().out)
        drop = {"initial.standing": None, **{f"initial.{name}": one["initial"][name] for name in one["initial"]}}
        run = ts.simulate(ts.load_scene("millipede", **drop), read["duration_s"])
        stride = read["measures"]["stride"]["value"]
        assert run.measures["stride"].value == stride and read["settled"]["multiple"] == one["multiple"]
        assert np.diff(run.marks["body"][:, 0])[-1] == pytest.approx(one["travel_m"], rel=1e-5)
