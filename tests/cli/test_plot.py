"""Figures of what was saved: the file is what its ending says, and holds what was asked for."""

from __future__ import annotations

import re
import shutil

import numpy as np
import pytest
import xarray

from tarsus.cli import main
from tarsus.report.saved import figure_of, offered


@pytest.fixture
def run(simulated, tmp_path):
    return shutil.copytree(simulated, tmp_path / "run")


@pytest.fixture(scope="module")
def sweep(tmp_path_factory):
    folder = tmp_path_factory.mktemp("grid")
    study = folder / "grid.toml"
    study.write_text(
        'scene = "cantilever"\nduration = "20 ms"\nmeasures = ["bounces", "impact_speed"]\n[vary]\n'
        'robot.feet.tip.gap = ["50 um", "60 um", "70 um"]\n'
        'ground.film.coefficient = ["1e-22 N m^2 s", "1e-20 N m^2 s"]\n'
    )
    assert main(["sweep", str(study), "-q", "-o", str(folder / "sweep")]) == 0
    return folder / "sweep"


def test_a_figure_is_what_its_ending_says_and_a_file_stays_unless_it_may_be_replaced(tarsus, run, tmp_path):
    file = tmp_path / "a.svg"
    file.write_text("mine")
    said = tarsus("plot", run, "-o", file)
    assert said.code == 2 and "is there already" in said.sentences[0] and file.read_text() == "mine"
    found = tarsus("plot", run, "-o", tmp_path / "A.PNG", "--json").json()
    drawn = (tmp_path / "A.PNG").read_bytes()
    assert found == {"file": str(tmp_path / "A.PNG"), "bytes": len(drawn)} and drawn.startswith(b"\x89PNG")
    for name in ("impacts", "ledger"):
        assert tarsus("plot", run, name, "-o", file, "--overwrite").code == 0
        assert len(re.findall("<path", file.read_text())) > 3


def test_series_are_drawn_as_they_are_stored(run):
    with xarray.open_dataset(run / "series.nc") as data:
        (line,) = figure_of(data, "gap").get_lines()
        time, gap = line.get_data()
        assert np.allclose(time, data["time"]) and line.get_label() == "tip"
        assert np.ptp(gap) == pytest.approx(np.ptp(data["gap"].values))
        assert len(figure_of(data, "displacement", only=["center"]).get_lines()) == 1


def test_a_map_over_decades_has_a_cell_of_one_width_for_every_value():
    rates, gaps = np.geomspace(1e-9, 1e-4, 6), np.array([50e-6, 60e-6])
    values = np.arange(12.0).reshape(6, 2)
    path = "ground.adhesion.rate"
    coords = {path: (path, rates, {"units": "N/s"}), "gap": ("gap", gaps, {"units": "m"})}
    one = xarray.DataArray(values, dims=(path, "gap"), coords=coords, attrs={"units": "1"})
    axes = figure_of(xarray.Dataset({"bounces": one}), "bounces")
    (drawn,) = axes.collections
    corners = np.asarray(drawn.get_coordinates())
    edges = corners[:, 0, 1]
    assert axes.get_yscale() == "log" and axes.get_xscale() == "linear"
    assert np.diff(np.log10(edges)) == pytest.approx(np.ones(6), rel=1e-9)
    middles = np.sqrt(edges[1:] * edges[:-1])
    assert middles / middles[0] == pytest.approx(rates / rates[0]) and axes.get_ylim()[0] == pytest.approx(edges[0])
    assert corners[0, :, 0] == pytest.approx([45e-6, 55e-6, 65e-6])
    assert np.asarray(drawn.get_array()).ravel() == pytest.approx(values.ravel())


def test_a_grid_of_two_is_a_map_or_lines_over_one(tarsus, sweep, tmp_path):
    with xarray.open_dataset(sweep / "sweep.nc") as data:
        assert offered(data) == ["bounces", "impact_speed"]
        (drawn,) = figure_of(data, "impact_speed").collections
        shown, stored = np.asarray(drawn.get_array()).ravel(), data["impact_speed"].values.ravel()
        assert np.sort(shown) / shown.max() == pytest.approx(np.sort(stored) / stored.max())
        lines = figure_of(data, "impact_speed", over="ground.film.coefficient").get_lines()
        assert [line.get_label() for line in lines] == ["gap 50 µm", "gap 60 µm", "gap 70 µm"]
    file = tmp_path / "a.png"
    assert tarsus("plot", sweep, "bounces", "-o", file).code == 0 and file.stat().st_size > 5000
