"""`reproduce millipede`: verdicts for people and for programs, files, and what it refuses."""

from __future__ import annotations

import csv
import json
from dataclasses import replace

import pytest

from reproduce.coarse_studies import FEW, overdamped
from tarsus_reproduce import millipede, readings
from tarsus_reproduce.trends import Verdict


@pytest.fixture(scope="module")
def short_runs():
    """A device judged by shorter runs, under two names, which a command line takes in place of its own."""
    outcome = millipede.judge_scene("millipede", overdamped(), coarse=FEW, duration=0.04)
    return millipede.MillipedeReproduction((outcome, replace(outcome, name="other")))


@pytest.fixture
def quick(monkeypatch, short_runs):
    devices = []

    def reproduce(device, *, progress):
        progress(0, 1, "nothing")
        devices.append(device)
        return short_runs

    def draw(base, count, seed, *, file, threads, progress):
        score = short_runs.outcomes[0].score
        return readings.Readings(seed, tuple(readings.Reading(n, {}, score) for n in range(count)))

    monkeypatch.setattr(millipede, "reproduce_millipede", reproduce)
    monkeypatch.setattr(readings, "random_readings", draw)
    return devices


def test_json_and_files(tarsus, quick, tmp_path, monkeypatch):
    drawn = []

    def draw(reproduction, path, *, readings):
        drawn.append((reproduction.outcomes[1].name, len(readings.readings)))
        path.write_text("drawn elsewhere", encoding="utf-8")

    monkeypatch.setattr("tarsus_reproduce.pages.millipede.write_millipede_report", draw)
    found = tarsus(
        "reproduce", "millipede", "--json", "-o", tmp_path, "--readings", "5", "--seed", "3"
    ).json()
    assert quick == [millipede.VARIANTS]
    assert found["experiment"] == "millipede" and found["ok"]
    assert list(found["variants"]) == ["millipede", "other"]
    assert (found["readings"]["count"], found["readings"]["seed"]) == (5, 3)
    assert json.loads((tmp_path / "reproduction.json").read_text(encoding="utf-8")) == found
    with (tmp_path / "reproduction.csv").open(encoding="utf-8", newline="") as stream:
        rows = list(csv.DictReader(stream))
    assert len(rows) == sum(len(variant["trends"]) for variant in found["variants"].values())
    assert {row["verdict"] for row in rows} <= {verdict.value for verdict in Verdict}
    assert float(rows[0]["first"]) == found["variants"]["millipede"]["trends"][0]["first"]
    assert drawn == [("other", 5)]
    assert (tmp_path / "reproduction.html").read_text(encoding="utf-8") == "drawn elsewhere"


# Slow: every figure is drawn. Its sibling above writes the rest; reproduce/test_millipede.py draws the page.
@pytest.mark.slow
def test_the_page_beside_the_files(tarsus, quick, tmp_path):
    words = ("reproduce", "millipede", "-o", tmp_path, "--readings", "5", "--seed", "3")
    assert tarsus(*words).code == 0
    page = (tmp_path / "reproduction.html").read_text(encoding="utf-8")
    assert "<svg" in page and "Random readings of what is not printed" in page


def test_tables_for_people(tarsus, quick):
    result = tarsus("reproduce", "millipede", "--device", "millipede")
    assert quick == ["millipede"]
    assert result.code == 0 and result.sentences == []
    for words in ("Spearman's rho", "damping ratio", "Fig. 4.7(b)", "4.11", "insensitive", " of 11"):
        assert words in result.out
    assert "wrote" not in result.out and "e-1" not in result.out.split("Fig. 4.7(a)")[1].splitlines()[0]


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--seeds", "3"), "--seeds: the millipede has one start"),
        (("--rows", "rows.csv"), "--rows: no table is printed for the millipede"),
        (("--readings", "-1"), "--readings, --scatter: expected numbers from 0 to"),
        (("--seed", "3"), "--seed: is the seed of --readings and --scatter"),
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
    assert len(result.sentences) == 7  # five studies vary the restitution, two of them the film
    assert "millipede-film-nano: ground.film.coefficient: 'ground.film' is not set here" in "".join(
        result.sentences
    )
