"""-o: every verb that writes a folder follows one rule, and finds a bad one before it works."""

from __future__ import annotations

import pytest

STUDY = """
scene = "cantilever"
duration = "2 ms"
measures = ["peak"]
chunk = 2
[vary]
ground.restitution.coefficient = { kind = "linspace", start = 0.1, stop = 0.6, count = 3 }
"""


WRITING = {
    "simulate": ("cantilever", "scene.toml"),
    "synthesize": ("cantilever", "campaign.toml"),
    "identify": ("lab", "identified.toml"),
    "sweep": ("study.toml", "study.toml"),
    "yield": ("millipede", "yield.json"),
    "calibrate": ("cantilever", "calibration.json"),
    "branch": ("cantilever", "branch.json"),
    "attractors": ("cantilever", "attractors.json"),
    "atlas": ("cantilever", "atlas.json"),
    "reproduce": ("cantilever", "reproduction.csv"),
    "validate": ("ball-drop", "validation.csv"),
}
"""Verbs that write a folder: what they are asked about, and a file of theirs."""

FURTHER = {
    "atlas": ("--x", "robot.feet.tip.gap=60um:80um", "--y", "signals.pzt.amplitude=6V:8V"),
    "branch": ("--along", "signals.pzt.amplitude=8V:7V"),
    "yield": ("--dead", "0:1"),
}


@pytest.mark.parametrize("verb", WRITING)
def test_what_lies_in_a_folder_is_not_replaced(tarsus, tmp_path, monkeypatch, verb):
    """Refused before any work, which would take minutes."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "lab").mkdir()
    (tmp_path / "lab" / "loops.txt").touch()
    campaign = 'device = "cantilever"\nrecords.loops = { purpose = "loops", files = ["loops.txt"] }\n'
    (tmp_path / "lab" / "campaign.toml").write_text(campaign, encoding="utf-8")
    (tmp_path / "study.toml").write_text(STUDY, encoding="utf-8")
    about, name = WRITING[verb]
    folder = tmp_path / "out"
    folder.mkdir()
    (folder / name).write_text("mine", encoding="utf-8")
    words = (verb, about, *FURTHER.get(verb, ()), "-o", "out")
    (refused,) = tarsus(*words).sentences
    assert "'out' is not empty" in refused and "--overwrite" in refused
    (refused,) = tarsus(*words, "--overwrite").sentences
    assert f"holds {name}, and `tarsus {verb}` did not write that there" in refused
    assert [path.name for path in folder.iterdir()] == [name]


def test_a_run_replaces_a_run(tarsus, tmp_path):
    words = ("simulate", "cantilever", "--duration", "1 ms", "-o", tmp_path / "out")
    assert tarsus(*words, "--mat").code == 0
    (tmp_path / "out" / "notes.md").write_text("mine", encoding="utf-8")
    before = (tmp_path / "out" / "series.nc").read_bytes()
    assert tarsus(*words, "--set", "volts=3").code == 2
    assert (tmp_path / "out" / "series.nc").read_bytes() == before
    assert tarsus(*words, "--set", "volts=3", "--overwrite", "--no-report").code == 0
    present = {path.name for path in (tmp_path / "out").iterdir()}
    assert (tmp_path / "out" / "series.nc").read_bytes() != before
    assert {"notes.md", "series.nc"} <= present and not {"series.mat", "report.html"} & present
