"""`simulate`: summary, JSON, output folder, settings and laws."""

from __future__ import annotations

import shlex
import subprocess
import sys

import pytest

from export.test_fmu import PUMP
from scene_files import SCENES

SHORT = ("--duration", "60 ms")


@pytest.mark.parametrize("device", ["hexapod", "cantilever"])
def test_measures_that_sound_alike_are_told_apart_where_they_differ(tarsus, device):
    words = ("simulate", device, "--duration", "0.1 s")
    value = {name: one["value"] for name, one in tarsus(*words, "--json").json()["measures"].items()}
    out = tarsus(*words).out
    assert ("rebounds those that begin by restitution" in out) == (value["bounces"] > value["rebounds"])
    assert ("adds up a period's contacts" in out) == (value["contact_duration"] > value["longest_contact"])
    assert (device == "hexapod") == ("Note: bounces are flights" in out)


@pytest.mark.parametrize(
    ("device", "said"),
    [("quadruped", "by the motion alone: drive pzt has no capacitance"), ("hexapod-walker", "the electrodes took")],
)
def test_energy_that_a_missing_capacitance_leaves_out_is_said(tarsus, device, said):
    out = " ".join(tarsus("simulate", device, "--duration", "5 ms").out.split())
    assert said in out and ("no capacitance" in out) == ("no capacitance" in said), out


def test_json_is_one_object_with_the_ledger_closed(tarsus):
    result = tarsus("simulate", "cantilever", *SHORT, "--json")
    assert result.code == 0
    run = result.json()
    assert run["ok"] is True
    assert run["duration_s"] == pytest.approx(0.06)
    assert run["ledger_closure"] < 1e-8
    assert run["events"]["capture"] + run["events"]["bounce"] > 0
    assert run["sentence"]
    for measure in run["measures"].values():
        assert measure["definition"] and measure["unit"] and measure["scope"] == "one foot"
    count = run["measures"]["bounces"]
    assert count["height_m"] == 1e-7 and count["dwell_s"] == 5e-4 and run["measures"]["peak"]["dwell_s"] is None
    assert "HIGHEST_UNCOUNTED" in {warning["kind"] for warning in run["warnings"]}


def test_the_summary_says_what_it_counts_and_where_that_misleads(tarsus):
    lines = tarsus("simulate", "cantilever", "--duration", "100 ms").out.splitlines()
    count = next(line for line in lines if line.startswith("bounces  "))
    assert "one foot, flights above 100 nm, after contacts below 500 µs" in count
    assert int(count.split()[1]) >= 1, "the hop of 25 um after a capture of 70 us that the report shows"
    assert any(line.startswith("Note: Foot tip:") and "longer than 500 µs" in line for line in lines)
    walk = tarsus("simulate", "millipede", "--duration", "60 ms").out.splitlines()
    for name, scope in (
        ("hardest impact", "worst foot"),
        ("longest contact", "worst foot"),
        ("impacts", "mean over feet"),
    ):
        assert scope in next(line for line in walk if line.startswith(f"{name} "))


def test_beside_a_run_stands_what_other_starts_lead_to(tarsus, tmp_path):
    words = ("simulate", SCENES / "vibrating_table.toml", "--duration", "0.2", "--starts", "3")
    told = tarsus(*words, "-o", tmp_path / "out").out
    page = (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    found = tarsus(*words, "--json").json()["attractors"]
    assert found["starts"] == 3 and len(found["attractors"]) >= 1 and found["own_start"] == 1
    for one in found["attractors"]:
        assert one["motion"] in told and one["motion"] in page
    assert told.count("leads here") == page.count("leads here") == 1
    assert "tarsus attractors" in page and "attractors" not in tarsus(*words[:4]).out


def test_the_next_command_is_printed_as_it_is_typed(tarsus, tmp_path):
    file = tmp_path / "my robot.toml"
    file.write_text((SCENES / "vibrating_table.toml").read_text(encoding="utf-8"), encoding="utf-8")
    changed = ("--set", "ground.restitution.coefficient=0.4", "--duration", "0.1")
    said = tarsus("simulate", file, *changed, "--starts", "2").out
    typed = shlex.split(said[said.index("tarsus attractors ") :])[1:]
    assert typed == ["attractors", str(file), *changed[:2]]
    assert tarsus(*typed, "--starts", "2", "--no-edges").code == 0


def test_a_run_that_stops_says_why_and_ends_with_1(tarsus, tmp_path):
    (tmp_path / "own.py").write_text(PUMP, encoding="utf-8")
    pump = ("--law", tmp_path / "own.py", "--set", "ground.laws.pump.coefficient=1")
    found = tarsus("simulate", "cantilever", "--duration", "5 ms", *pump)
    (sentence,) = found.sentences
    assert found.code == 1 and sentence.startswith("The run stopped") and sentence in found.out


@pytest.mark.slow
def test_in_a_process_of_its_own_nothing_but_the_summary_is_printed(tarsus):
    words = ("simulate", "cantilever", *SHORT)
    done = subprocess.run([sys.executable, "-m", "tarsus", *words], capture_output=True, text=True, check=True)
    head, *summary = done.stdout.splitlines()
    assert done.stderr == "" and head.startswith("cantilever: 0.06 s simulated")
    assert summary == tarsus(*words).out.splitlines()[1:]


def test_a_run_with_a_law_and_other_values_can_be_run_again_from_its_folder(tarsus, tmp_path, magnet):
    value = ("--set", "ground.laws.magnet.strength=3e-24", "--set", "ground.adhesion=none", "--set", "hz=40")
    words = (*SHORT, "--law", magnet, "--no-report")
    first = tarsus("simulate", "cantilever", *words, *value, "-o", tmp_path / "a")
    again = tarsus("simulate", tmp_path / "a" / "scene.toml", *words, "-o", tmp_path / "b")
    assert (first.code, again.code) == (0, 0)
    for name in ("scene.toml", "events.csv", "measures.json", "provenance.json", "citations.txt"):
        assert (tmp_path / "a" / name).read_bytes() == (tmp_path / "b" / name).read_bytes(), name
    assert not (tmp_path / "a" / "report.html").exists()
    nothing = ("--set", "ground.laws.magnet.strength=0")
    weaker = tarsus("simulate", tmp_path / "a" / "scene.toml", *words, *nothing, "--json").json()
    assert weaker["ledger_J"]["laws"]["magnet"] == weaker["ledger_J"]["adhesion"] == 0.0
    refused = tarsus("simulate", tmp_path / "a" / "scene.toml")
    assert refused.code == 2 and "--law" in refused.sentences[0]
