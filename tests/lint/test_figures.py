"""Tables of README and gallery are those of the results that are kept, and those of the packaged calibrations."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest

from example_files import load_file

ROOT = Path(__file__).parents[2]


@pytest.fixture
def figures():
    return load_file(ROOT / "docs" / "figures.py")


def test_the_pages_hold_the_tables_of_the_results(figures):
    assert figures.page_differences() == []
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    marked = re.findall(r"<!-- figures: (\w+) -->\n(.*?)<!-- end -->", readme, re.DOTALL)
    assert [name for name, _ in marked] == ["experiments", "fast"] and len(readme.split()) <= 800
    for _, table in marked:
        readme = readme.replace(table, "")
    assert "\n|" not in readme, "a table outside of the marks"


def test_a_number_that_was_typed_is_found(figures, tmp_path, monkeypatch):
    page = tmp_path / "README.md"
    page.write_text((ROOT / "README.md").read_text(encoding="utf-8").replace(" % | ", " % |  ", 1), encoding="utf-8")
    monkeypatch.setattr(figures, "PAGES", (page,))
    monkeypatch.setattr(figures, "ROOT", tmp_path)
    assert figures.page_differences() == ["README.md: run `python docs/figures.py`"]


def test_new_numbers_of_a_calibration_come_into_table_and_sentence(figures, tmp_path, monkeypatch):
    kept = figures.result("cantilever")
    kept["choices"]["landing"] = {"weights": {"capture": 0.4, "restitute": 0.6}, "open": True}
    kept["summary"]["left_out"]["measures"]["peak"]["mean_relative_error"] = 0.4321
    kept["summary"]["best"] = {"measures": json.loads(json.dumps(kept["summary"]["training"]["measures"]))}
    kept["summary"]["best"]["measures"]["bounces"]["existence_right"] = 7
    (tmp_path / "cantilever.json").write_text(json.dumps(kept), encoding="utf-8")
    monkeypatch.setattr(figures, "RESULTS", tmp_path)
    told = figures.cantilever()
    weighed = "60 % for restitution first, 40 % for held unless pulled"
    assert f"The data do not decide which landing rule holds ({weighed})." in told
    assert "43.2 %" in told and "best device: 7 of 12 right" in told


def test_the_packaged_mixtures_are_those_of_the_results(figures):
    assert figures.mixture_differences() == []
