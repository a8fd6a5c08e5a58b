"""Files of releases say the same as the package: versions, dependencies, what CI tries."""

from __future__ import annotations

import json
import re
import tomllib
from pathlib import Path

import pytest

from example_files import load_file

ROOT = Path(__file__).parents[2]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]


def test_the_version_is_one():
    assert f"version: {PROJECT['version']}\n" in (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    assert f'version: "{PROJECT["version"]}"' in (ROOT / "conda" / "recipe.yaml").read_text(encoding="utf-8")
    assert f"## {PROJECT['version']}" in (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")


def test_the_recipe_asks_for_what_the_package_asks_for():
    recipe = (ROOT / "conda" / "recipe.yaml").read_text(encoding="utf-8")
    for wanted in PROJECT["dependencies"]:
        name, bounds = re.fullmatch(r"([\w-]+)(.*)", wanted).groups()
        assert f"    - {'matplotlib-base' if name == 'matplotlib' else name} {bounds}\n" in recipe, wanted


def test_floors_are_the_lowest_versions_that_are_allowed():
    floors = (ROOT / ".ci" / "floors.txt").read_text(encoding="utf-8").split()
    wanted = {re.match(r"([\w-]+)>=([\d.]+)", one).groups() for one in PROJECT["dependencies"]}
    found = {tuple(one.split("==")) for one in floors}
    assert {name for name, _ in found} == {name for name, _ in wanted}
    for name, version in wanted:
        assert any(one == name and (pin == version or pin.startswith(f"{version}.")) for one, pin in found), name


def test_ci_tries_every_python_and_system():
    ci = (ROOT / ".github" / "workflows" / "ci.yml").read_text(encoding="utf-8")
    for word in ("ubuntu-latest", "macos-latest", "windows-2022", "floors.txt", "check_links.py", ".ci/run"):
        assert word in ci, word
    for one in PROJECT["classifiers"]:
        if found := re.search(r"Python :: (3\.\d+)$", one):
            assert f'"{found[1]}"' in ci, one


def test_wheels_run_on_any_machine_of_their_kind():
    """A wheel's tag names no processor: unless another is asked for, its machine code is for all of them."""
    tools = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]
    (target,) = (
        one["cmake"]["define"]["TARSUS_TARGET"]
        for one in tools["scikit-build"]["overrides"]
        if one["if"] == {"state": "wheel"}
    )
    lists = (ROOT / "CMakeLists.txt").read_text(encoding="utf-8")
    assert f'TARSUS_TARGET STREQUAL "{target}"' in lists and target == "baseline"
    assert 'set(TARSUS_TARGET "native" CACHE STRING' in lists  # in place it is for this machine


@pytest.fixture
def history():
    return load_file(ROOT / "benchmarks" / "history.py")


def test_figures_of_versions_are_compared_within_a_machine(history, tmp_path, monkeypatch):
    row = {"problem": "P1", "solver": "tarsus", "unit": "ms/s", "median": 2.0, "wrong": 0}
    (tmp_path / "out.json").write_text(json.dumps({"rows": [row, {**row, "solver": "other", "wrong": 3}]}))
    file = tmp_path / "history.jsonl"
    assert history.compare(file) == []
    entry = history.add(tmp_path / "out.json", file)
    assert entry["figures"] == {"P1 tarsus [ms/s]": 2.0} and entry["version"]
    (tmp_path / "out.json").write_text(json.dumps({"rows": [{**row, "median": 1.0}]}))
    monkeypatch.setattr(history, "version", lambda name: "9.9")
    history.add(tmp_path / "out.json", file)
    monkeypatch.setattr(history, "machine", lambda: "another")
    history.add(tmp_path / "out.json", file)
    told = history.compare(file)
    assert told[1].endswith("9.9 0.50") and told[2] == "another" and told[3].endswith("9.9 1.00")
