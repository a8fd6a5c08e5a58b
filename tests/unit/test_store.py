"""A run on disk: complete, readable by others, whole or absent."""

from __future__ import annotations

import csv
import dataclasses
import errno
import json
import math
import os
import re
from pathlib import Path

import h5py
import numpy as np
import pytest
import xarray
from scipy.io import loadmat

from tarsus.base.errors import InputError
from tarsus.files import store
from tarsus.files.store import read_run, write_run, write_text
from unit.sample_run import SampleRun, make_run


@pytest.fixture(scope="module")
def run() -> SampleRun:
    return make_run(duration=0.045, step=1e-5)


@pytest.fixture(scope="module")
def folder(run: SampleRun, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("store") / "out"
    write_run(run, path, mat=True)
    return path


def contents(folder: Path) -> set[str]:
    return {path.name for path in folder.iterdir()}


def test_writes_every_file_and_reports_them(run: SampleRun, tmp_path: Path) -> None:
    written = write_run(run, tmp_path / "a" / "b")
    expected = {
        "scene.toml",
        "series.nc",
        "events.csv",
        "measures.json",
        "provenance.json",
        "citations.txt",
        "summary.json",
    }
    assert {path.name for path in written} == expected
    assert contents(tmp_path / "a" / "b") == expected


def test_series_opens_in_xarray_with_units_and_names(run: SampleRun, folder: Path) -> None:
    with xarray.open_dataset(folder / "series.nc") as stored:
        for name, variable in stored.variables.items():
            assert variable.attrs["long_name"]
            if variable.dtype.kind in "fib":
                assert "units" in variable.attrs, name
        assert stored["gap"].attrs["units"] == "m"
        assert stored["contact"].dtype == np.int8
        assert stored["contact"].attrs["flag_meanings"] == "open contact"
        assert list(stored["point"].values) == ["tip", "center"]
        np.testing.assert_array_equal(stored["gap"].values, run.dataset["gap"].values)
        np.testing.assert_array_equal(stored["time"].values, run.dataset["time"].values)
        assert stored.attrs["result"] == run.code.value
    with h5py.File(folder / "series.nc") as plain:
        for name in plain:
            node = plain[name]
            assert isinstance(node, h5py.Dataset)
            assert node.dtype.kind in "fiS", f"{name} has a type that older readers lack"


def test_read_run_gives_back_what_was_written(run: SampleRun, folder: Path) -> None:
    back = read_run(folder)
    assert back.scene == run.scene
    assert back.foot_names == run.foot_names
    assert (back.code.name, back.code.value, back.ok) == (run.code.name, run.code.value, True)
    assert back.duration == run.duration
    for name in run.events.dtype.names or ():
        np.testing.assert_array_equal(back.events[name], run.events[name])
    assert dataclasses.asdict(back.ledger) == dataclasses.asdict(run.ledger)
    assert list(back.measures) == list(run.measures)
    assert back.measures["peak"].value == run.measures["peak"].value
    assert back.measures["peak"].per_foot == dict(run.measures["peak"].per_foot)
    for name in ("scope", "height", "dwell"):
        assert getattr(back.measures["bounces"], name) == getattr(run.measures["bounces"], name)
    assert math.isnan(back.measures["impact_speed"].value)
    dataset = back.to_dataset()
    assert dataset["contact"].dtype == bool
    for name, variable in run.dataset.variables.items():
        np.testing.assert_array_equal(dataset[name].values, variable.values)


def test_writing_a_stored_run_again_gives_equal_files(folder: Path, tmp_path: Path) -> None:
    write_run(read_run(folder), tmp_path)
    for name in ("scene.toml", "events.csv", "measures.json", "provenance.json", "summary.json"):
        assert (tmp_path / name).read_bytes() == (folder / name).read_bytes(), name


def test_json_is_strict_and_free_of_the_machine(run: SampleRun, folder: Path) -> None:
    def refuse(word: str) -> None:
        raise AssertionError(f"{word} is no JSON")

    for name in ("measures.json", "provenance.json", "summary.json"):
        json.loads((folder / name).read_text(), parse_constant=refuse)
    summary = json.loads((folder / "summary.json").read_text())
    assert summary["code"] == "FINISHED"
    assert summary["tarsus"] == store.package_version()
    assert "wall" not in (folder / "summary.json").read_text()
    measures = json.loads((folder / "measures.json").read_text())
    assert measures["measures"]["impact_speed"]["value"] is None
    assert measures["ledger"]["work_in"] == run.ledger.work_in


def test_events_csv_has_units_words_and_full_precision(run: SampleRun, folder: Path) -> None:
    with (folder / "events.csv").open(newline="") as stream:
        header, *rows = list(csv.reader(stream))
    assert header[:4] == ["time [s]", "foot", "kind", "speed_before [m/s]"]
    assert len(rows) == len(run.events) > 2
    assert [float(row[0]) for row in rows] == run.events["time"].tolist()
    assert {row[2] for row in rows} == {"bounce", "capture", "release"}
    released = next(row for row in rows if row[2] == "release")
    assert released[header.index("speed_before [m/s]")] == ""


def test_provenance_carries_values_and_notes(folder: Path) -> None:
    table = json.loads((folder / "provenance.json").read_text())
    assert table["robot.structure.frequencies"]["source"] == "printed"
    assert "vibrometer" in table["robot.structure.frequencies"]["note"]
    assert "Oldham" in (folder / "citations.txt").read_text()


def test_matlab_file_has_short_names_and_units(run: SampleRun, folder: Path) -> None:
    content = loadmat(folder / "series.mat", squeeze_me=True, simplify_cells=True)
    names = [name for name in content if not name.startswith("__")]
    assert all(re.fullmatch(r"[A-Za-z]\w{0,30}", name) for name in names)
    assert content["units"]["film_force"] == "N"
    assert list(content["point_names"]) == ["tip", "center"]
    np.testing.assert_array_equal(content["gap"], run.dataset["gap"].values[0])
    np.testing.assert_array_equal(content["events"]["time"], run.events["time"])


def test_rerun_replaces_own_files_and_keeps_others(run: SampleRun, tmp_path: Path) -> None:
    write_run(run, tmp_path, mat=True)
    (tmp_path / "report.html").write_text("of the run before")
    (tmp_path / "notes.txt").write_text("mine")
    write_run(dataclasses.replace(run, ok=False), tmp_path)
    assert not read_run(tmp_path).ok
    assert (tmp_path / "notes.txt").read_text() == "mine"
    assert {"series.mat", "report.html"}.isdisjoint(contents(tmp_path))


def test_refuses_a_file_and_a_place_that_cannot_be_made(run: SampleRun, tmp_path: Path) -> None:
    taken = tmp_path / "taken"
    taken.write_text("a file")
    with pytest.raises(InputError, match="is a file"):
        write_run(run, taken)
    with pytest.raises(InputError, match="cannot write"):
        write_run(run, taken / "below")
    assert taken.read_text() == "a file"


def test_refuses_a_folder_without_permission(
    run: SampleRun, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def closed(*args: object, **kwargs: object) -> str:
        raise PermissionError(errno.EACCES, os.strerror(errno.EACCES))

    monkeypatch.setattr(store.tempfile, "mkdtemp", closed)
    with pytest.raises(InputError, match="permission denied"):
        write_run(run, tmp_path / "new")
    assert not (tmp_path / "new").exists()


@pytest.mark.parametrize("when", ["_write_netcdf", "_citations", "_summary"])
def test_interrupt_leaves_nothing_half_done(
    run: SampleRun, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, when: str
) -> None:
    def interrupted(*args: object) -> None:
        raise KeyboardInterrupt

    fresh, old = tmp_path / "fresh", tmp_path / "old"
    write_run(run, old)
    before = {path.name: path.read_bytes() for path in old.iterdir()}
    monkeypatch.setattr(store, when, interrupted)
    for folder in (fresh, old):
        with pytest.raises(KeyboardInterrupt):
            write_run(run, folder)
    assert not fresh.exists()
    assert {path.name: path.read_bytes() for path in old.iterdir()} == before


def test_interrupt_while_moving_is_seen_when_reading(
    run: SampleRun, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    write_run(run, tmp_path)
    moved = []
    replace = os.replace

    def some(source: Path, target: Path) -> None:
        if len(moved) == 3:
            raise KeyboardInterrupt
        moved.append(target)
        replace(source, target)

    monkeypatch.setattr(os, "replace", some)
    with pytest.raises(KeyboardInterrupt):
        write_run(run, tmp_path)
    assert not any(name.startswith(".") for name in contents(tmp_path))
    with pytest.raises(InputError, match="no whole run"):
        read_run(tmp_path)


def test_read_run_refuses_what_is_no_run(run: SampleRun, tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no whole run"):
        read_run(tmp_path)
    write_run(run, tmp_path)
    summary = json.loads((tmp_path / "summary.json").read_text())
    (tmp_path / "summary.json").write_text(json.dumps(summary | {"format": 99}))
    with pytest.raises(InputError, match="format 99"):
        read_run(tmp_path)
    (tmp_path / "summary.json").write_text("{")
    with pytest.raises(InputError, match=r"summary\.json"):
        read_run(tmp_path)


def test_write_text_is_whole_or_absent(tmp_path: Path) -> None:
    write_text(tmp_path / "deep" / "page.html", "µ")
    assert (tmp_path / "deep" / "page.html").read_text(encoding="utf-8") == "µ"
    assert contents(tmp_path / "deep") == {"page.html"}
    with pytest.raises(InputError, match="folder"):
        write_text(tmp_path / "deep", "x")
    with pytest.raises(InputError, match="cannot write"):
        write_text(tmp_path / "deep" / "page.html" / "x", "x")


def test_run_without_events_feet_or_drives_is_stored(run: SampleRun, tmp_path: Path) -> None:
    none = {name: [] for name in ("foot", "drive")}
    bare = dataclasses.replace(run, events=run.events[:0], dataset=run.dataset.isel(none), foot_names=())
    write_run(bare, tmp_path, mat=True)
    back = read_run(tmp_path)
    assert len(back.events) == 0
    assert back.to_dataset()["gap"].shape == (0, run.dataset.sizes["time"])


def test_writers_of_one_process_number_do_not_meet(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """As in two containers on one disk: the second writes between the first one's writing and moving."""
    replace, second = os.replace, []

    def meanwhile(part: Path, target: Path) -> None:
        if not second:
            second.append(target)
            write_text(target, "second")
        replace(part, target)

    monkeypatch.setattr(os, "replace", meanwhile)
    write_text(tmp_path / "page.html", "first")
    assert (tmp_path / "page.html").read_text() == "first" and contents(tmp_path) == {"page.html"}
