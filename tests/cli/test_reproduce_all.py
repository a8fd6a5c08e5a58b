"""`reproduce --all`: a folder for every page and an index, from what each experiment wrote; words that are refused."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest

from tarsus_reproduce.pages.index import EXPERIMENTS, index_html
from unit.html_page import Page


@pytest.mark.slow
def test_every_page_and_an_index(tarsus, tmp_path):
    result = tarsus("reproduce", "--all", "-o", tmp_path, "--seeds", "2")
    assert result.code == 0
    text = (tmp_path / "index.html").read_text(encoding="utf-8")
    links = re.findall(r'href="([^"#]+)"', text)
    assert links == [f"{one.folder}/reproduction.html" for one in EXPERIMENTS]
    assert all((tmp_path / link).stat().st_size > 10_000 for link in links)
    results = {
        one.folder: json.loads((tmp_path / one.folder / "reproduction.json").read_text(encoding="utf-8"))
        for one in EXPERIMENTS
    }
    assert index_html(results) == text


def test_every_cantilever_page_is_of_its_own_device(tarsus, tmp_path, monkeypatch):
    asked = {}

    def told(name):
        def run(device, *words, **options):
            folder = next(word for word in words if isinstance(word, Path))
            asked[folder.name] = (name, device)
            folder.mkdir(parents=True)
            (folder / "reproduction.json").write_text("{}", encoding="utf-8")
            return 0

        return run

    for name in ("cantilever", "robot", "millipede"):
        monkeypatch.setattr(f"tarsus_reproduce.cli.{name}.run", told(name))
    monkeypatch.setattr("tarsus_reproduce.pages.index.write_index", lambda results, path: path.write_text(""))
    assert tarsus("reproduce", "--all", "-o", tmp_path / "all").code == 0
    assert asked == {
        "cantilever": ("cantilever", None),  # the mixture of its calibration
        "cantilever-1": ("cantilever", "cantilever-1"),
        "hexapod": ("robot", "hexapod"),
        "quadruped": ("robot", "quadruped"),
        "millipede": ("millipede", None),
    }


def prediction(median: float) -> dict[str, float]:
    return {"median": median, "low": 0.9 * median, "high": 1.1 * median}


def cantilever_row(role: str, peak: float) -> dict:
    measured = {"bounces": 1.0, "peak_um": 100.0, "contact_ms": None}
    ours = {"bounces": prediction(1.0), "peak_um": prediction(peak), "contact_ms": prediction(2.0)}
    return {
        "freq_hz": 5.0, "volt_v": 8.0, "wave": "sine", "role": role, "measured": measured, "source": None, "ours": ours,
    }  # fmt: skip


def test_the_index_keeps_fitted_and_predicted_rows_apart_and_names_what_is_missed():
    merits = {"peak": {"mean_absolute_percent": 12.3}, "contact": {"mean_absolute_percent": 45.6}}
    summary = {"ours": {**merits, "existence_right": 1, "count_cases": 2}}
    rows = [cantilever_row("calibrated on", 101.0), cantilever_row("predicted", 150.0)]
    variant = {"agree": 7, "contradict": 2, "directional_agree": 5, "directional_total": 11}
    text = index_html(
        {"cantilever": {"rows": rows, "summary": summary}, "millipede": {"variants": {"some": variant}}}
    )
    page = Page(text)
    assert "on 1 of 2 rows" in page.text and "peak 12.3 %, contact 45.6 %" in page.text
    assert "1 row, 1 of them measured" in page.text
    assert "Row 8 V sine, 5 Hz (predicted): peak 100 against 150 µm." in page.text
    assert "some: 7 of 16 agree, 2 contradict, 5 of 11 directional agree" in page.text
    assert "hexapod/reproduction.html" not in text and not {"link", "img"} & set(page.tags)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--all"], "--all writes pages: give their folder with -o"),
        (["hexapod", "--all", "-o", "x"], "--all makes every page: leave 'hexapod' out"),
        (["--all", "-o", "x", "--device", "mine"], "--device belongs to one experiment"),
        ([], "name an experiment (cantilever, hexapod, quadruped or millipede), or give --all"),
        (
            ["cantilever", "--device", "hexapod"],
            "has no point 'tip', 'center', which `reproduce cantilever` looks at",
        ),
        (["hexapod", "--device", "quadruped"], "has no point 'foot5', 'foot6'"),
        (["quadruped", "--device", "cantilever"], "it is no device of this experiment"),
        (["hexapod", "--readings", "3"], "--readings, --scatter and --seed are of the millipede"),
    ],
)
def test_words_that_do_not_go_together(tarsus, words, said):
    result = tarsus("reproduce", *words)
    assert (result.code, result.out) == (2, "")
    (sentence,) = result.sentences
    assert said in sentence


@pytest.mark.parametrize("words", [["validate"], ["validate", "cantilever"], ["validate", "--help"]])
def test_the_verb_validate_says_what_it_became(tarsus, words):
    result = tarsus(*words)
    assert (result.code, result.out) == (2, "")
    (sentence,) = result.sentences
    assert "tarsus reproduce" in sentence and "tarsus check" in sentence
