"""`tarsus sweep`: from a study to its store, through interruptions; kills are in cluster/test_disasters.py."""

from __future__ import annotations

import itertools
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from study.sweep_case import files
from tarsus.cli.task import task

EXAMPLES = Path(__file__).parents[2] / "examples" / "studies"

STUDY = """
scene = "cantilever"
duration = "20 ms"
measures = ["peak"]
chunk = {chunk}
[set]
wave = "sine"
hz = 200
[vary]
ground.restitution.coefficient = {{ kind = "linspace", start = 0.1, stop = {last}, count = {count} }}
ground.adhesion.rate = {{ kind = "logspace", start = "1 uN/s", stop = "100 uN/s", count = 10 }}
"""


@pytest.fixture
def study(tmp_path):
    """`study(count=2, chunk=5)`: a study file of 10 * count runs."""

    def write(count: int = 2, chunk: int = 5) -> Path:
        file = tmp_path / "small.toml"
        file.write_text(STUDY.format(count=count, chunk=chunk, last=0.6 if count > 1 else 0.1), encoding="utf-8")
        return file

    return write


def test_a_study_becomes_one_file_and_its_folder_is_refused_resumed_and_replaced(tarsus, study, tmp_path):
    words = ("sweep", study(), "-o", tmp_path / "out")
    result = tarsus(*words)
    assert result.code == 0 and result.sentences == []
    assert "small: 20 runs, from rest, 20 ms" in result.out and "20   The run reached its end." in result.out
    with xr.open_dataset(tmp_path / "out" / "sweep.nc") as dataset:
        assert dataset["peak"].shape == (2, 10) and np.isfinite(dataset["peak"].values).all()
        assert dataset["ground.adhesion.rate"].attrs["units"] == "N/s"
    before = files(tmp_path / "out")
    again = tarsus(*words)
    assert again.code == 2 and "--resume" in again.sentences[0]
    resumed = tarsus(*words, "--resume")
    assert resumed.code == 0 and "20 of them done before" in resumed.out
    continued = tarsus("sweep", tmp_path / "out")
    assert continued.code == 0 and "20 of them done before" in continued.out
    assert files(tmp_path / "out") == before
    study(count=3)
    other = tarsus(*words, "--resume")
    assert other.code == 2 and "another sweep (its study.toml differs)" in other.sentences[0]
    assert files(tmp_path / "out") == before
    (tmp_path / "out" / "notes.md").write_text("mine", encoding="utf-8")
    study(count=1, chunk=10)
    assert tarsus(*words, "--overwrite").code == 0
    assert [path.name for path in (tmp_path / "out" / "units").rglob("*.npz")] == ["000000.npz"]
    assert (tmp_path / "out" / "notes.md").is_file()


@pytest.mark.slow
def test_the_frozen_study_is_a_study(tarsus, study, tmp_path):
    assert tarsus("sweep", study(), "-o", tmp_path / "out").code == 0
    assert tarsus("sweep", tmp_path / "out" / "study.toml", "-o", tmp_path / "again", "--threads", "1").code == 0
    assert files(tmp_path / "again") == files(tmp_path / "out")


def test_an_interrupt_says_how_to_resume(tarsus, study, tmp_path, monkeypatch):
    from tarsus.study import sweeping

    whole, begun = sweeping.work_unit, itertools.count(1)

    def third_is_interrupted(*words, **options):
        if next(begun) == 3:
            raise KeyboardInterrupt
        return whole(*words, **options)

    monkeypatch.setattr(sweeping, "work_unit", third_is_interrupted)
    folder = tmp_path / "a folder"
    words = ("sweep", study(count=2, chunk=2), "-o", folder)
    found = tarsus(*words)
    (sentence,) = found.sentences
    assert found.code == 130 and found.out == "" and "finished parts are kept" in sentence
    assert f"-o '{folder}' --resume" in sentence and not list(folder.glob("units/*/*.part"))
    assert len(list(folder.glob("units/*/*.npz"))) >= 2  # and what other threads were at
    monkeypatch.undo()
    assert tarsus(*words, "--resume").code == 0


@pytest.mark.slow
def test_a_law_of_ones_own_is_part_of_the_plan(tarsus, study, magnet, tmp_path):
    law = tmp_path / "magnet.py"
    law.write_text(magnet.read_text(encoding="utf-8"), encoding="utf-8")
    words = ("simulate", "cantilever", "--law", law, "--duration", "1 ms", "--no-report")
    assert tarsus(*words, "-o", tmp_path / "run").code == 0
    file = study()
    text = file.read_text(encoding="utf-8").replace('"cantilever"', '"run/scene.toml"')
    file.write_text(f"{text}ground.laws.magnet.strength = [0.0, 1e-24]\n", encoding="utf-8")
    sweep = ("sweep", file, "-o", tmp_path / "out", "--resume")
    assert "--law" in tarsus(*sweep).sentences[0]
    assert tarsus(*sweep, "--law", law).code == 0
    law.write_text(law.read_text(encoding="utf-8") + "# changed\n", encoding="utf-8")
    assert "its laws/magnet.py differs" in tarsus(*sweep, "--law", law).sentences[0]


def test_all_that_is_wrong_with_a_study_is_said(tarsus, tmp_path):
    file = tmp_path / "bad.toml"
    file.write_text(STUDY.format(count=0, chunk=5, last=0.6).replace("peak", "peek"), encoding="utf-8")
    result = tarsus("sweep", file, "-o", tmp_path / "out")
    assert result.code == 2 and len(result.sentences) == 2 and not (tmp_path / "out").exists()
    for example in EXAMPLES.glob("*.toml"):
        assert "is a good study" in tarsus("check", example).out


@pytest.mark.slow
def test_the_packaged_cantilever_study_shows_where_the_tip_stays(tarsus, tmp_path):
    assert tarsus("sweep", "cantilever-adhesion", "-o", tmp_path).code == 0
    with xr.open_dataset(tmp_path / "sweep.nc") as dataset:
        held = dataset["contact_duration"].values > 0.0199  # of a period of 20 ms
        assert not held[:, 0].any() and held[:, -1].all()
        assert (np.diff(held.astype(int), axis=1) >= 0).all()  # more adhesion never frees it
        assert (dataset["peak"].values[held] == 0.0).all()


@pytest.mark.slow
def test_another_seed_draws_other_values(tarsus, tmp_path):
    study = tmp_path / "drawn.toml"
    study.write_text(
        'scene = "cantilever"\nduration = "1 ms"\nmeasures = ["bounces"]\n[design]\nkind = "sobol"\ncount = 4\n'
        '[vary]\nrobot.feet.tip.gap = { kind = "linspace", start = "50 um", stop = "70 um" }\n'
    )

    def gaps(folder, *words):
        assert tarsus("sweep", study, "-o", tmp_path / folder, *words).code in (0, 1)
        with xr.open_dataset(tmp_path / folder / "sweep.nc") as data:
            return data["robot.feet.tip.gap"].values.tolist()

    own, same, other = gaps("a"), gaps("b", "--seed", "0"), gaps("c", "--seed", "1")
    assert own == same != other
    said = tarsus("sweep", study, "-o", tmp_path / "c", "--resume", "--seed", "2")
    assert said.code == 2 and "keeps the values" in said.sentences[0]
    said = tarsus("sweep", "cantilever-adhesion", "-o", tmp_path / "d", "--seed", "1")
    assert said.code == 2 and "draws nothing" in said.sentences[0]


def test_a_sweep_in_tasks_says_how_to_go_on_and_has_a_page_at_the_end(tarsus, study, tmp_path):
    folder = tmp_path / "out"
    assert tarsus("sweep", study(count=1), "-o", folder, "--array", "2").code == 0
    assert task(folder, 1, 1) == 0
    told = tarsus("show", folder)
    assert "1 of 2 units" in told.out and "to go on with what is missing: `tarsus sweep` of this folder" in told.out
    refused = tarsus("report", folder, "--no-browser")
    (sentence,) = refused.sentences
    assert refused.code == 2 and f"1 of 2 units done and no page yet: `tarsus sweep {folder}` makes" in sentence
    assert task(folder, 2, 1) == 0
    assert "to go on" not in tarsus("show", folder).out
    opened = tarsus("report", folder, "--no-browser", "--json").json()
    assert opened == {"page": str(folder / "report.html")}
    assert (folder / "report.html").stat().st_size > 10_000
