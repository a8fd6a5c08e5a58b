"""The explorer's page as text, and the widget of a notebook, without a browser."""

from __future__ import annotations

import json
import re
import runpy
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
import traitlets

import tarsus as ts
from tarsus.base.errors import InputError
from tarsus.cli import main
from tarsus.core.page import compiling
from tarsus.report import explorer as room
from tarsus.report.run_page import report_html
from tarsus.solve import page_engine


@pytest.fixture
def engine(monkeypatch):
    """Some bytes in the place of the engine for pages, which a checkout need not have."""
    for home in (room, page_engine):
        monkeypatch.setattr(home, "engine_bytes", lambda: b"\0asm")


@pytest.fixture
def cache(monkeypatch, tmp_path):
    """A user's cache that is empty, and no engine beside the sources."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    monkeypatch.setattr(page_engine, "files", lambda package: tmp_path)
    return tmp_path / "cache" / "tarsus"


@pytest.fixture
def compiler(monkeypatch):
    """Commands that were run in the place of zig's compiler, which writes a module that holds nothing."""
    ran = []

    def run(command, **options):
        ran.append(command)
        if "-o" in command:
            Path(command[command.index("-o") + 1]).write_bytes(b"\0asm\1\0\0\0")
        return subprocess.CompletedProcess(command, 0)

    monkeypatch.setattr(compiling, "subprocess", SimpleNamespace(run=run))
    return ran


def test_the_engine_is_compiled_once_and_kept(cache, compiler, tmp_path):
    words = ["explore", "cantilever", "--duration", "20 ms", "-q", "--overwrite", "-o", str(tmp_path / "page.html")]
    assert main(words) == 0 and main(words) == 0
    assert sum("-o" in one for one in compiler) == 1
    (file,) = cache.iterdir()
    assert file.name == f"page-engine-{compiling.digest()[:16]}.wasm"
    assert compiling.sources_of(file.read_bytes()) == compiling.digest()


def test_the_engine_is_compiled_by_hand_into_a_file(compiler, monkeypatch, tmp_path):
    monkeypatch.setattr(sys, "argv", ["tarsus.core.page", str(tmp_path / "made.wasm")])
    runpy.run_module("tarsus.core.page", run_name="__main__")
    assert compiling.sources_of((tmp_path / "made.wasm").read_bytes()) == compiling.digest()


def test_an_engine_of_other_sources_is_not_used(cache, compiler, monkeypatch):
    first = page_engine.compiled_engine()
    assert page_engine.engine_bytes() == first
    monkeypatch.setattr(compiling, "FLAGS", [*compiling.FLAGS, "-O3"])
    assert page_engine.engine_bytes() is None and page_engine.compiled_engine() != first


def test_a_cache_that_cannot_be_written_is_left_alone(cache, compiler, tmp_path):
    (tmp_path / "cache").write_text("in the way")
    assert page_engine.compiled_engine()[:4] == b"\0asm"


def test_without_a_compiler_one_command_is_said(cache, monkeypatch, tmp_path, capsys):
    missing = subprocess.CompletedProcess([], 1)
    monkeypatch.setattr(compiling, "subprocess", SimpleNamespace(run=lambda command, **options: missing))
    assert main(["explore", "cantilever", "--duration", "20 ms", "-o", str(tmp_path / "page.html")]) == 2
    assert "type `pip install ziglang`, then the same again" in capsys.readouterr().err
    run = ts.simulate("cantilever", 0.02)
    assert 'class="explore"' not in report_html(run, static=False), "reports stay as they are"


def told(text: str) -> dict[str, Any]:
    """What the script of a page is given."""
    return json.loads(re.search(r'class="explore-info">(.*?)</script>', text, re.S)[1])


def test_a_page_is_told_all_that_it_needs(engine, tmp_path):
    file, other = tmp_path / "page.html", tmp_path / "other.html"
    found = ts.explore("cantilever", file, duration="20 ms", drive=["signals.pzt.amplitude"])
    info = told(file.read_text(encoding="utf-8"))
    assert [one["paths"][0] for one in info["sliders"]] == list(found.sliders)
    assert info["load"] == 'ts.load_scene("cantilever")' and info["given"] == {}
    assert {"robot.structure.length", "signals.pzt.frequency"} & set(found.explored.left)
    assert [one["name"] for one in info["measures"]] == list(found.explored.measures)
    words = ["--set", "robot.feet.tip.gap=6e-5 m", "--duration", "20 ms", "--drive", "signals.pzt.amplitude"]
    assert main(["explore", "cantilever", *words, "-o", str(other), "-q"]) == 0
    info = told(other.read_text(encoding="utf-8"))
    assert info["words"] == {"robot.feet.tip.gap": "6e-5 m"} and info["given"] == {"robot.feet.tip.gap": 6e-5}
    run = ts.simulate("cantilever", 0.02)
    assert len(told(report_html(run, static=False))["sliders"]) == 5
    assert 'class="explore"' not in report_html(run)


def test_the_widget_reads_and_sets_values(engine):
    found = ts.explore("cantilever", duration="20 ms", drive=["signals.pzt.amplitude"])
    widget = found.widget()
    widget.values = {"robot.feet.tip.gap": 5e-5}
    assert widget.get_state()["values"] == {"robot.feet.tip.gap": 5e-5} and "<html" in widget.page
    assert widget.run().scene.robot.feet["tip"].gap == 5e-5
    for values, words in {
        ("robot.structure.length", 1.0): "no such slider",
        ("signals.pzt.amplitude", 8.0123): "none of the values",
    }.items():
        with pytest.raises(traitlets.TraitError, match=words):
            widget.values = dict([values])


def test_more_contact_modes_than_a_page_holds_are_told(engine):
    with pytest.raises(InputError, match="contact modes: an explorer holds"):
        ts.explore(scene_of_nine_feet()).html()


def scene_of_nine_feet():
    names = [f"m{k}" for k in range(9)]
    masses = ts.Lumped(coordinates=names, mass=[1e-6] * 9, stiffness=[1.0] * 9, damping=[1e-6] * 9)
    feet = {name: ts.Foot(point=name, gap=1e-6) for name in names}
    ground = ts.Ground(restitution=ts.Restitution(coefficient=0.5))
    return ts.Scene(name="nine", duration=0.001, robot=ts.Robot(structure=masses, feet=feet, drives={}), ground=ground)
