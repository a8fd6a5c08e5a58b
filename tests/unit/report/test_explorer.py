"""The explorer's page as text, and the widget of a notebook, without a browser."""

from __future__ import annotations

import json
import re

import pytest
import traitlets

import tarsus as ts
from tarsus.base.errors import InputError
from tarsus.cli import main
from tarsus.report import explorer as room
from tarsus.report.run_page import report_html


@pytest.fixture
def engine(monkeypatch):
    """Some bytes in the place of the engine for pages, which a checkout need not have."""
    monkeypatch.setattr(room, "engine_bytes", lambda: b"\0asm")


def test_where_the_engine_is_not_built_one_command_is_said(monkeypatch, tmp_path, capsys):
    monkeypatch.setattr(room, "engine_bytes", lambda: None)
    assert main(["explore", "cantilever", "--duration", "20 ms", "-o", str(tmp_path / "page.html")]) == 2
    assert "python -m tarsus.core.page" in capsys.readouterr().err
    run = ts.simulate("cantilever", 0.02)
    assert 'class="explore"' not in report_html(run, static=False), "reports stay as they are"


def test_a_page_holds_all_that_it_needs(engine, tmp_path):
    file = tmp_path / "page.html"
    found = ts.explore("cantilever", file, duration="20 ms", drive=["signals.pzt.amplitude"])
    text = file.read_text(encoding="utf-8")
    assert not re.search(r'(?:src|href)="(?!#|data:)', text) and "https://" not in re.sub(
        r"<footer>.*", "", text, flags=re.S
    )
    info = json.loads(re.search(r'class="explore-info">(.*?)</script>', text, re.S)[1])
    assert [one["paths"][0] for one in info["sliders"]] == list(found.sliders)
    assert info["load"] == 'ts.load_scene("cantilever")' and info["given"] == {}
    assert {"robot.structure.length", "signals.pzt.frequency"} & set(found.explored.left)
    assert [one["name"] for one in info["measures"]] == list(found.explored.measures)


def test_what_was_changed_before_is_part_of_what_is_copied(engine, tmp_path):
    page = tmp_path / "page.html"
    words = ["--set", "robot.feet.tip.gap=6e-5 m", "--duration", "20 ms", "--drive", "signals.pzt.amplitude"]
    assert main(["explore", "cantilever", *words, "-o", str(page), "-q"]) == 0
    info = json.loads(
        re.search(r'class="explore-info">(.*?)</script>', page.read_text(encoding="utf-8"), re.S)[1]
    )
    assert info["words"] == {"robot.feet.tip.gap": "6e-5 m"} and info["given"] == {"robot.feet.tip.gap": 6e-5}


def test_a_report_carries_a_small_one(engine):
    run = ts.simulate("cantilever", 0.02)
    text = report_html(run, static=False)
    info = json.loads(re.search(r'class="explore-info">(.*?)</script>', text, re.S)[1])
    assert len(info["sliders"]) == 5 and not info["plays"]
    assert 'class="explore"' not in report_html(run)


def test_the_widget_reads_and_sets_values(engine):
    found = ts.explore("cantilever", duration="20 ms", drive=["signals.pzt.amplitude"])
    widget = found.widget()
    widget.values = {"robot.feet.tip.gap": 5e-5}
    assert widget.get_state()["values"] == {"robot.feet.tip.gap": 5e-5} and "<html" in widget.page
    assert widget.run().scene.robot.feet["tip"].gap == 5e-5
    for values, words in {
        ("robot.structure.length", 1.0): "no such slider", ("robot.feet.tip.gap", 1.0): "expected a value from",
        ("signals.pzt.amplitude", 8.0123): "none of the values",
    }.items():  # fmt: skip
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
    return ts.Scene(
        name="nine", duration=0.001, robot=ts.Robot(structure=masses, feet=feet, drives={}), ground=ground
    )
