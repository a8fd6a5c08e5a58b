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


CAMPAIGN = """
device = "cantilever"
records.loops = { purpose = "loops", files = ["loops.txt"] }
"""


class Worked(Exception):
    """Raised where work begins."""


def working(*words, **options):
    raise Worked


@pytest.fixture
def verbs(tmp_path, monkeypatch):
    """Words of every verb that writes, on input that is sound, and what begins its work."""
    lab = tmp_path / "lab"
    lab.mkdir()
    (lab / "loops.txt").write_text("", encoding="utf-8")
    (lab / "campaign.toml").write_text(CAMPAIGN, encoding="utf-8")
    file = tmp_path / "study.toml"
    file.write_text(STUDY, encoding="utf-8")
    for place in (
        "tarsus.simulate",
        "tarsus.synthesis.campaign_folder.write_campaign",
        "tarsus.identify.chain.identify",
        "tarsus.study.sweeping.run_sweep",
        "tarsus_reproduce.cantilever.reproduce_cantilever",
    ):
        monkeypatch.setattr(place, working)
    return {
        "simulate": ("simulate", "cantilever"),
        "synthesize": ("synthesize", "cantilever"),
        "identify": ("identify", lab),
        "sweep": ("sweep", file),
        "reproduce": ("reproduce", "cantilever"),
    }


@pytest.mark.parametrize("verb", ["simulate", "synthesize", "identify", "sweep", "reproduce"])
def test_a_folder_with_anything_in_it_is_refused_before_any_work(tarsus, verbs, tmp_path, monkeypatch, verb):
    monkeypatch.setenv("TARSUS_TRACEBACK", "1")
    folder = tmp_path / "out"
    folder.mkdir()
    (folder / "notes.md").write_text("mine", encoding="utf-8")
    refused = tarsus(*verbs[verb], "-o", folder)
    assert refused.code == 2 and len(refused.sentences) == 1
    assert (
        "'" + str(folder) + "' is not empty" in refused.sentences[0] and "--overwrite" in refused.sentences[0]
    )
    with pytest.raises(Worked):
        tarsus(*verbs[verb], "-o", folder, "--overwrite")
    with pytest.raises(Worked):
        tarsus(*verbs[verb], "-o", tmp_path / "new")
    assert (folder / "notes.md").read_text(encoding="utf-8") == "mine"


@pytest.mark.parametrize("verb", ["simulate", "synthesize", "identify", "sweep", "reproduce"])
def test_a_file_of_the_same_name_is_not_replaced(tarsus, verbs, tmp_path, verb):
    name = {
        "simulate": "scene.toml",
        "synthesize": "campaign.toml",
        "identify": "identified.toml",
        "sweep": "study.toml",
        "reproduce": "reproduction.csv",
    }[verb]
    folder = tmp_path / "out"
    folder.mkdir()
    (folder / name).write_text("mine", encoding="utf-8")
    refused = tarsus(*verbs[verb], "-o", folder, "--overwrite")
    assert refused.code == 2
    assert f"holds {name}, and `tarsus {verb}` did not write that there" in refused.sentences[0]
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


def test_a_sweep_replaces_a_sweep(tarsus, tmp_path):
    file = tmp_path / "study.toml"
    file.write_text(STUDY, encoding="utf-8")
    words = ("sweep", file, "-o", tmp_path / "out")
    assert tarsus(*words).code == 0
    (tmp_path / "out" / "notes.md").write_text("mine", encoding="utf-8")
    file.write_text(STUDY.replace("count = 3", "count = 1"), encoding="utf-8")
    refused = tarsus(*words)
    assert refused.code == 2 and "--resume" in refused.sentences[0] and "--overwrite" in refused.sentences[0]
    assert "give one of them" in tarsus(*words, "--resume", "--overwrite").sentences[0]
    assert tarsus(*words, "--overwrite").code == 0
    assert {path.name for path in (tmp_path / "out" / "units").rglob("*.npz")} == {"000000.npz"}
    assert (tmp_path / "out" / "notes.md").is_file()
