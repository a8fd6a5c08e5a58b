"""Two runs, or two descriptions, beside each other; and pages made again."""

import pytest

import tarsus as ts
from tarsus.files.toml import write_scene


@pytest.fixture(scope="module")
def runs(tmp_path_factory):
    """Folders of two runs that differ in their restitution."""
    from tarsus.cli import main

    root = tmp_path_factory.mktemp("runs")
    for name, coefficient in (("a", "0.378"), ("b", "0.4")):
        words = ["simulate", "cantilever", "--duration", "40 ms", "--no-report", "-o", str(root / name)]
        assert main([*words, "--set", f"ground.restitution.coefficient={coefficient}"]) == 0
    return root


def test_runs_are_compared(tarsus, runs):
    found = tarsus("show", runs / "a", runs / "b", "--json").json()
    assert [row["path"] for row in found["values"]] == ["ground.restitution.coefficient"]
    assert found["values"][0]["difference"] == pytest.approx(0.4 / 0.378 - 1.0)
    assert found["parting"]["number"] == 2 and found["parting"]["first"]["kind"] == "bounce"
    speeds = {row["name"]: row for row in found["measures"]}["hardest_impact"]
    assert speeds["difference"] == pytest.approx(0.0, abs=1e-6)
    told = tarsus("show", runs / "a", runs / "b").out
    assert "they part at event 2: bounce of tip" in told and "5.82 %" in told


def test_a_run_is_the_same_as_itself(tarsus, runs):
    found = tarsus("show", runs / "a", runs / "a", "--json").json()
    assert found["parting"] is None and found["values"] == []
    assert all(row["difference"] in (0.0, None) for row in found["measures"] + found["energies"])
    assert "all 43 values that both have are equal" in tarsus("show", runs / "a", runs / "a").out


def test_what_is_told_of_intervals(tarsus, tmp_path):
    """Of a number well within the interval that the device states, of one beyond, and of one that has none."""
    scene = ts.load_scene("cantilever")
    damping, adhesion, gap = (
        "robot.structure.damping_ratios.0",
        "ground.adhesion.initial",
        "robot.feet.tip.gap",
    )
    low, high = scene.interval(damping)
    changes = {damping: low + 0.3 * (high - low), adhesion: 2.0 * scene.interval(adhesion)[1], gap: 71e-6}
    other = tmp_path / "other.toml"
    write_scene(ts.with_values(scene, changes), other)
    found = tarsus("show", "cantilever", other, "--json").json()
    inside = {row["path"]: row["inside"] for row in found["values"]}
    assert inside == {damping: True, adhesion: False, gap: None}
    told = tarsus("show", "cantilever", other).out
    assert "1 of 2 values with a 95 % interval have the other's value inside" in told


def test_a_run_is_no_description(tarsus, runs):
    said = tarsus("show", runs / "a", "cantilever")
    assert said.code == 2 and "compare two runs or two descriptions" in said.sentences[0]


def test_a_page_is_made_again_without_simulating(tarsus, runs, monkeypatch):
    monkeypatch.setattr(ts, "simulate", lambda *_, **__: pytest.fail("simulated"))
    found = tarsus("report", runs / "b", "--no-browser", "--json").json()
    assert found == {"page": str(runs / "b" / "report.html"), "made_again": True}
    assert "cantilever" in (runs / "b" / "report.html").read_text()
