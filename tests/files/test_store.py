"""A run on disk: complete, readable by others, whole or absent."""

from __future__ import annotations

import csv
import dataclasses
import json
import math
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from scipy.io import loadmat

import tarsus as ts
from tarsus.base.errors import InputError
from tarsus.files import store
from tarsus.files.series import Variable, blank, read_netcdf, write_netcdf
from tarsus.files.steady import SteadyFile
from tarsus.files.store import write_run
from tarsus.files.summary import account, deviation
from tarsus.files.whole import write_text
from tarsus.measure import Measure
from tarsus.solve import Run, load_run


@pytest.fixture(scope="module")
def run() -> Run:
    """The cantilever with too few steps to reach its end, and to have a mean height."""
    made = ts.simulate("cantilever", 0.045, ts.Accuracy(steps=60))
    assert not made.ok and math.isnan(made.measures["mean_height"].value)
    return made


@pytest.fixture(scope="module")
def folder(run: Run, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("store") / "out"
    write_run(run.arrays(), path, mat=True)
    return path


def contents(folder: Path) -> set[str]:
    return {path.name for path in folder.iterdir()}


def test_read_run_gives_back_what_was_written(run: Run, folder: Path) -> None:
    back = load_run(folder)
    assert back.scene == run.scene
    assert back.foot_names == run.foot_names
    assert (back.code.name, back.code.value, back.ok) == (run.code.name, run.code.value, False)
    assert back.duration == run.duration
    for name in run.events.dtype.names or ():
        np.testing.assert_array_equal(back.events[name], run.events[name])
    assert dataclasses.asdict(back.ledger) == dataclasses.asdict(run.ledger)
    assert list(back.measures) == list(run.measures)
    assert back.measures["peak"].value == run.measures["peak"].value
    assert back.measures["peak"].per_foot == dict(run.measures["peak"].per_foot)
    assert [one.kind.name for one in back.measures.warnings] == [one.kind.name for one in run.measures.warnings] != []
    assert [*map(str, back.measures.warnings)] == [*map(str, run.measures.warnings)]
    for name in ("scope", "height", "dwell"):
        one, other = (made.measures["bounces"] for made in (back, run))
        assert str(getattr(one, name)) == str(getattr(other, name))
    assert math.isnan(back.measures["mean_height"].value)
    dataset = back.to_dataset()
    assert dataset["contact"].dtype == bool
    for name, variable in run.to_dataset().variables.items():
        np.testing.assert_array_equal(dataset[name].values, variable.values)


def test_a_run_that_was_read_answers_as_the_one_that_was_written(run: Run, folder: Path) -> None:
    back = load_run(folder)
    assert str(back.table()) == str(run.table()) and back.remarks == run.remarks
    assert (back.period, back.end_time, back.ended) == (run.period, run.end_time, run.ended)
    np.testing.assert_equal(back.electrical_energy, run.electrical_energy)
    times = np.linspace(0.0, run.end_time, 37)
    np.testing.assert_array_equal(back.states(times).gap, run.states(times).gap)
    np.testing.assert_array_equal(back.to_dataset(times)["velocity"], run.to_dataset(times)["velocity"])


def test_a_run_of_earlier_versions_is_read(folder: Path, tmp_path: Path) -> None:
    """Their folders have neither accuracy nor the energy of the electrodes, and may warn of what there is no more."""
    shutil.copytree(folder, tmp_path / "run")
    for name, changes in (
        ("summary.json", {"accuracy": None}),
        ("measures.json", {"electrical_energy": None, "warnings": [{"kind": "GONE", "sentence": "No more."}]}),
    ):
        content = json.loads((tmp_path / "run" / name).read_text()) | changes
        kept = {key: value for key, value in content.items() if value is not None}
        (tmp_path / "run" / name).write_text(json.dumps(kept))
    back = load_run(tmp_path / "run")
    assert math.isnan(back.electrical_energy) and back.measures.warnings == () and "peak" in back.measures
    assert "electrodes" not in str(back.table())
    with pytest.raises(InputError, match="has other events than were kept"):  # those of its own accuracy
        back.states([0.0, 0.01])


def test_writing_a_stored_run_again_gives_equal_files(folder: Path, tmp_path: Path) -> None:
    load_run(folder).write(tmp_path)
    for name in ("scene.toml", "events.csv", "measures.json", "provenance.json", "summary.json"):
        assert (tmp_path / name).read_bytes() == (folder / name).read_bytes(), name


def test_json_is_strict_and_free_of_the_machine(run: Run, folder: Path) -> None:
    def refuse(word: str) -> None:
        raise AssertionError(f"{word} is no JSON")

    for name in ("measures.json", "provenance.json", "summary.json"):
        json.loads((folder / name).read_text(), parse_constant=refuse)
    summary = json.loads((folder / "summary.json").read_text())
    assert summary["code"] == run.code.name == "STEP_LIMIT"
    assert summary["tarsus"] == store.package_version()
    assert "wall" not in (folder / "summary.json").read_text()
    measures = json.loads((folder / "measures.json").read_text())
    assert measures["measures"]["mean_height"]["value"] is None
    assert measures["ledger"]["work_in"] == run.ledger.work_in


def test_events_csv_has_units_words_and_full_precision(run: Run, folder: Path) -> None:
    with (folder / "events.csv").open(newline="") as stream:
        header, *rows = list(csv.reader(stream))
    assert header[:4] == ["time [s]", "foot", "kind", "speed_before [m/s]"]
    assert len(rows) == len(run.events) > 2
    assert [float(row[0]) for row in rows] == run.events["time"].tolist()
    assert {row[2] for row in rows} == {"bounce", "capture", "release"}


def test_matlab_file_has_short_names_and_units(run: Run, folder: Path) -> None:
    content = loadmat(folder / "series.mat", squeeze_me=True, simplify_cells=True)
    names = [name for name in content if not name.startswith("__")]
    assert all(re.fullmatch(r"[A-Za-z]\w{0,30}", name) for name in names)
    assert content["units"]["film_force"] == "N"
    assert list(content["point_names"]) == ["tip", "center"]
    np.testing.assert_array_equal(content["gap"], run.to_dataset()["gap"].values[0])
    np.testing.assert_array_equal(content["events"]["time"], run.events["time"])


def test_refuses_a_file_and_a_place_that_cannot_be_made(run: Run, tmp_path: Path) -> None:
    taken = tmp_path / "taken"
    taken.write_text("a file")
    with pytest.raises(InputError, match="is a file"):
        write_run(run.arrays(), taken)
    with pytest.raises(InputError, match="cannot write"):
        write_run(run.arrays(), taken / "below")
    assert taken.read_text() == "a file"


def test_interrupt_leaves_nothing_half_done(run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupted(*args: object) -> None:
        raise KeyboardInterrupt

    fresh, old = tmp_path / "fresh", tmp_path / "old"
    write_run(run.arrays(), old)
    before = {path.name: path.read_bytes() for path in old.iterdir()}
    monkeypatch.setattr(store, "_summary", interrupted)
    for folder in (fresh, old):
        with pytest.raises(KeyboardInterrupt):
            write_run(run.arrays(), folder)
    assert not fresh.exists()
    assert {path.name: path.read_bytes() for path in old.iterdir()} == before


def test_interrupt_while_moving_is_seen_when_reading(run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    write_run(run.arrays(), tmp_path)
    moved = []
    replace = os.replace

    def some(source: Path, target: Path) -> None:
        if len(moved) == 3:
            raise KeyboardInterrupt
        moved.append(target)
        replace(source, target)

    monkeypatch.setattr(os, "replace", some)
    with pytest.raises(KeyboardInterrupt):
        write_run(run.arrays(), tmp_path)
    assert not any(name.startswith(".") for name in contents(tmp_path))
    with pytest.raises(InputError, match="no whole run"):
        load_run(tmp_path)


@pytest.mark.parametrize(
    ("file", "damage", "said"),
    [
        (store.EVENTS_FILE, lambda text: text[:100], "events.csv is damaged"),
        (store.EVENTS_FILE, lambda text: text[: text.rindex("\n", 0, -1) + 1], "events.csv is damaged"),
        (store.EVENTS_FILE, lambda text: text[:-9], "events.csv is damaged"),
        (store.EVENTS_FILE, lambda text: text.replace("bounce", "bonuce"), "is no event"),
        (store.EVENTS_FILE, lambda text: "", "events.csv is damaged"),
        (store.MEASURES_FILE, lambda text: "{}", "lacks 'ledger'"),
        (store.SUMMARY_FILE, lambda text: json.dumps(json.loads(text) | {"format": 99}), "format 99"),
        (store.SUMMARY_FILE, lambda text: "{", r"summary\.json"),
        (store.SUMMARY_FILE, None, "no whole run"),
        (store.SUMMARY_FILE, lambda text: text.replace("STEP_LIMIT", "STEPS"), "no run ends as 'STEPS'"),
    ],
)
def test_damaged_files_are_not_read_as_another_run(folder: Path, tmp_path: Path, file, damage, said) -> None:
    shutil.copytree(folder, tmp_path / "run")
    damaged = tmp_path / "run" / file
    if damage is None:
        damaged.unlink()
    else:
        damaged.write_text(damage(damaged.read_text(encoding="utf-8")), encoding="utf-8")
    with pytest.raises(InputError, match=said):
        load_run(tmp_path / "run")


def test_write_text_is_whole_or_absent(tmp_path: Path) -> None:
    write_text(tmp_path / "deep" / "page.html", "µ")
    assert (tmp_path / "deep" / "page.html").read_text(encoding="utf-8") == "µ"
    assert contents(tmp_path / "deep") == {"page.html"}
    with pytest.raises(InputError, match="folder"):
        write_text(tmp_path / "deep", "x")
    with pytest.raises(InputError, match="cannot write"):
        write_text(tmp_path / "deep" / "page.html" / "x", "x")


def test_run_without_events_feet_or_drives_is_stored(tmp_path: Path) -> None:
    structure = ts.Modal(frequencies=(100.0,), damping_ratios=(0.1,), modal_masses=(1e-6,), shapes={"tip": (1.0,)})
    start = ts.Initial(displacement=(1e-6,))
    bare = ts.simulate(ts.Scene(name="bare", robot=ts.Robot(structure=structure), initial=start, duration=1e-2))
    write_run(bare.arrays(), tmp_path, mat=True)
    back = load_run(tmp_path)
    assert len(back.events) == 0
    assert back.to_dataset()["gap"].shape == (0, len(bare.series.time))


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


# a file may be so long and no longer: what a quota does, and a disk that somebody else fills
FULL = """
import resource, sys
from pathlib import Path
import numpy as np
from tarsus.files.series import Variable, blank, write_netcdf
resource.setrlimit(resource.RLIMIT_FSIZE, (int(sys.argv[2]), int(sys.argv[2])))
puts = []
def fill(put):
    for first in range(0, 8000, 1000):
        put("x", first, np.arange(1000.0))
        puts.append(first)
series = {"x": Variable(("run",), blank((8000,)), {}), "y": Variable(("run",), np.ones(8000), {})}
try:
    write_netcdf(series, {}, Path(sys.argv[1]), fill)
except OSError as error:
    print(error.errno, len(puts))
"""


@pytest.mark.parametrize("room", [100, 20_000, 100_000])
def test_a_disk_that_fills_is_an_error_and_no_crash(tmp_path, room):
    words = [sys.executable, "-c", FULL, str(tmp_path / "x.nc"), str(room)]
    done = subprocess.run(words, capture_output=True, text=True)
    number, puts = done.stdout.split()
    assert (done.returncode, number) == (0, "27")  # EFBIG
    assert int(puts) < 8 and "rror" not in done.stderr, done.stderr


def test_what_is_read_beyond_the_end_of_a_file_is_zero(tmp_path):
    with SteadyFile(tmp_path / "x") as file:
        file.write(b"ab")
        file.seek(0)
        assert file.readinto(read := bytearray(b"xxxx")) == 4 and read == b"ab\0\0"


def test_an_account_has_the_share_of_each_term_in_the_largest(run: Run) -> None:
    rows = account(run).rows
    assert rows[-2][:2] == ("lost to the squeeze film", -run.ledger.laws["film"]) and rows[-2][1] > 0.0
    largest = max(abs(value) for _, value, _ in rows[:-1])
    assert [share for *_, share in rows[:-1]] == pytest.approx([value / largest for _, value, _ in rows[:-1]], abs=5e-6)


def test_a_spread_that_rounding_makes_is_none():
    """Below 1 pm of a length, or a twenty-thousandth of a value; of a time there is no such size."""
    spreads = {"m": (5e-13, 2e-12), "s": (5e-13,)}
    found = {unit: [deviation(Measure(0.0, unit, one, 3, "")) for one in some] for unit, some in spreads.items()}
    assert found == {"m": [0.0, 2e-12], "s": [5e-13]}
    assert deviation(Measure(1.0, "s", 4e-5, 3, "")) == 0.0


def test_values_that_come_in_blocks_fill_a_grid_row_by_row(tmp_path):
    whole, file = np.arange(24.0), tmp_path / "x.nc"
    variables = {"x": Variable(("a", "b", "c"), blank((2, 3, 4)), {})}
    write_netcdf(variables, {}, file, lambda put: [put("x", k, whole[k : k + 5]) for k in range(0, 24, 5)])
    assert np.array_equal(read_netcdf(file)["x"], whole.reshape(2, 3, 4))
