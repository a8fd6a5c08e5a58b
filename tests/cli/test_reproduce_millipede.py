"""`reproduce millipede`: verdicts for people and for programs, files, and what it refuses."""

from __future__ import annotations

import csv
import json

import pytest

from reproduce.coarse_studies import few_runs
from tarsus_reproduce import millipede
from tarsus_reproduce.trends import Verdict


@pytest.fixture(scope="module")
def short_runs():
    """A reproduction of one variant by shorter runs, which a command line takes in place of its own."""
    variants = millipede.variants_of
    with few_runs() as patch:
        patch.setattr(millipede, "variants_of", lambda scene: variants(scene)[:1])
        return millipede.reproduce_millipede(duration=0.04)


@pytest.fixture
def quick(monkeypatch, short_runs):
    devices = []

    def validate(device, *, progress):
        progress(0, 1, "nothing")
        devices.append(device)
        return short_runs

    monkeypatch.setattr(millipede, "reproduce_millipede", validate)
    return devices


def test_json_and_files(tarsus, quick, tmp_path):
    found = tarsus("reproduce", "millipede", "--json", "-o", tmp_path).json()
    assert quick == ["millipede"]
    assert found["experiment"] == "millipede" and found["ok"]
    assert json.loads((tmp_path / "reproduction.json").read_text(encoding="utf-8")) == found
    with (tmp_path / "reproduction.csv").open(encoding="utf-8", newline="") as stream:
        rows = list(csv.DictReader(stream))
    assert len(rows) == sum(len(variant["trends"]) for variant in found["variants"])
    assert {row["verdict"] for row in rows} <= {verdict.value for verdict in Verdict}
    assert float(rows[0]["first"]) == found["variants"][0]["trends"][0]["first"]
    assert "<svg" in (tmp_path / "reproduction.html").read_text(encoding="utf-8")


def test_tables_for_people(tarsus, quick):
    result = tarsus("reproduce", "millipede", "--device", "millipede")
    assert result.code == 0 and result.sentences == []
    for words in (
        "Spearman's rho",
        "As described",
        "Fig. 4.7(b)",
        "4.11",
        "not determined",
    ):
        assert words in result.out
    assert "wrote" not in result.out and "e-1" not in result.out.split("Fig. 4.7(a)")[1].splitlines()[0]


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--seeds", "3"), "--seeds: the millipede starts from rest"),
        (("--rows", "rows.csv"), "--rows: the source prints no table for the millipede"),
        (("--device", "cantilever"), "cantilever: a millipede is a walker; this structure is of kind 'beam'"),
        (("--device", "milipede"), "no device is called 'milipede'"),
    ],
)
def test_bad_words_are_refused_in_a_sentence(tarsus, words, said):
    result = tarsus("reproduce", "millipede", *words)
    assert result.code == 2 and result.out == ""
    (sentence,) = result.sentences
    assert said in sentence


def test_a_millipede_without_a_law_that_varies_is_refused(tarsus, tmp_path):
    import tarsus as ts

    bare = ts.with_values(
        ts.load_scene("millipede"), {"ground.film": None, "ground.restitution": None, "provenance": {}}
    )
    ts.write_scene(bare, tmp_path / "bare.toml")
    result = tarsus("reproduce", "millipede", "--device", tmp_path / "bare.toml")
    assert result.code == 2
    assert len(result.sentences) == 5  # four studies vary the restitution, one of them the film
    assert "millipede-film: ground.film.coefficient: 'ground.film' is not set here" in "".join(
        result.sentences
    )
