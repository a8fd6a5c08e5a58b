"""`tarsus design gait` and `tarsus design adapt`: files, pages, one JSON object, and sentences for what cannot be."""

from __future__ import annotations

import csv
import shlex

import pytest

WALK = shlex.split(
    "millipede-printed --free gait.duty,gait.frequency=100Hz:200Hz --request from_rest=10ms --request candidates=64"
    " --threads 1"
)
GAIT = (*WALK, "--request", "look=2")


def test_a_front_is_written_and_read_again(tarsus, tmp_path, opened):
    words = ("--request", "objective=speed", "-o", str(tmp_path), "--no-report", "--json")
    done = tarsus("design", "gait", *GAIT, *words)
    assert done.code == 0, done.err
    table = done.json()
    assert table["gap"] is None and table["front"][0]["nominal"]["speed"] == table["optimum"]["nominal"]["speed"]
    rows = list(csv.reader((tmp_path / "front.csv").open()))
    assert len(rows) == len(table["front"]) + 3 and {len(row) for row in rows} == {len(rows[0])}
    assert "#define GAIT_COUNT 2u" in (tmp_path / "gait.h").read_text()
    assert opened(tmp_path, "gait design", "gait.duty", "without a unit are in SI")["front"] == table["front"]
    again = tarsus("design", "gait", *GAIT, *words, "--resume")
    assert again.code == 0, again.err
    resumed = again.json()
    assert resumed["reused"] == table["runs"] and resumed["runs"] == 0
    assert resumed["front"] == table["front"] and resumed["robust"] == table["robust"]


def test_limits_are_words_of_their_own(tarsus, tmp_path):
    words = ("--limits", "slip_ratio<5,peak<1mm", "--limits", "mean_speed > 0.1 um/s", "--no-report", "--json")
    done = tarsus("design", "gait", *GAIT, *words, "-o", str(tmp_path / "kept"))
    assert done.code == 0 and not done.sentences, "what the table says is not said beside it"
    said = [one["measure"] for one in done.json()["limits"]]
    assert said[:3] == ["slip_ratio", "peak", "mean_speed"]
    never = ("--limits", "mean_speed > 1 m/s", "--request", "objective=least slip", "--no-report", "--json")
    done = tarsus("design", "gait", *GAIT, *never, "-o", str(tmp_path / "never"))
    assert done.code == 1 and "no gait was found that keeps the limits" in done.sentences[0]
    assert done.json()["objectives"][0]["name"] == "slip"
    wrong = ("--limits", "slip<0.2,slip_ratio=1", "--limits", "mean_speed<1V", "-o", str(tmp_path / "none"))
    done = tarsus("design", "gait", *GAIT, *wrong)
    assert done.code == 2 and len(done.sentences) == 3 and not (tmp_path / "none").exists()


@pytest.mark.slow
def test_a_front_is_written_with_pages_that_play(tarsus, tmp_path):
    words = ("--over", "ground.friction.coefficient=4:12", "-o", str(tmp_path / "gaits"), "--json")
    table = tarsus("design", "gait", *GAIT, *words).json()
    page = (tmp_path / "gaits" / "report.html").read_text()
    assert 'href="gaits/gait-01.html"' in page and 'href="gaits/robust.html"' in page
    played = (tmp_path / "gaits" / "gaits" / "robust.html").read_text()
    assert "robust on the ground that is worst for it</h1>" in played
    assert "The walk" in played and f"{table['robust']['worst_ground']['ground.friction.coefficient']:.3g}" in played
