"""`tarsus branch` from the command line."""

from __future__ import annotations

import json

import pytest

from scene_files import SCENES
from tarsus.cli import main

OSCILLATOR = str(SCENES / "impact_oscillator.toml")
ALONG = "signals.shaker.amplitude"


def test_a_branch_is_printed_and_written(tmp_path, capsys, opened):
    out = tmp_path / "out"
    assert (
        main(["branch", OSCILLATOR, "--along", f"{ALONG}=1 V:0.95 V", "-o", str(out), "--starts", "4", "--json"]) == 0
    )
    everything = json.loads(capsys.readouterr().out)
    (found,) = everything["branches"]
    assert everything["starts"] == 4 and everything["coexisting"] == []
    assert {point["kind"] for point in found["points"]} == {"orbit"}
    assert found["points"][0]["at"] == 1.0 and found["points"][0]["impacts"] == 1
    assert found["points"][-1]["at"] == 0.95
    assert {one.name for one in out.iterdir()} >= {"branch.nc", "branch.json", "report.html"}
    import xarray

    with xarray.open_dataset(out / "branch.nc", engine="h5netcdf") as stored:
        assert stored["at"].values[0] == 1.0 and stored["stable"].values.all()
        assert stored["hardest_impact"].values[0] == pytest.approx(1.6957329376, abs=1e-8)
    found = opened(out, "branch", "`tarsus branch` wrote it", "the scene's own motion", "end of the range")
    assert found["branches"] == everything["branches"]
    series = {one["name"]: one for one in opened(out / "branch.nc", "series", ALONG)["series"]}
    assert (series["at"]["smallest"], series["at"]["unit"]) == (0.95, "V")
