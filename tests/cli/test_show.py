"""`devices`, `show`, `check` and `report`: what names, files and folders hold, and how two of a kind differ."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import tarsus as ts
from tarsus.base.spec import get_value
from tarsus.files.draws import write_draws
from tarsus.files.runstore import RunStore
from tarsus.inspection.comparison import of_runs

BALL = Path(__file__).parents[1] / "scenes" / "ball.toml"


def line(result, start: str) -> str:
    return next(one for one in result.out.splitlines() if one.startswith(start))


def test_devices_are_listed_and_every_value_has_a_unit_and_a_provenance(tarsus):
    listed = {one["name"]: one for one in tarsus("devices", "--json").json()["devices"]}
    assert {"cantilever", "cantilever-1"} <= set(listed) and listed["cantilever"]["feet"] == 1
    for device, source in (("cantilever", "calibrated"), ("cantilever-1", "printed")):
        values = {one["path"]: one for one in tarsus("show", device, "--json").json()["values"]}
        assert len(values) > 10 and values["ground.adhesion.initial"]["unit"] == "N"
        assert all(one["source"] in {"printed", "derived", "calibrated", "assumed"} for one in values.values())
        assert all(one["note"] for one in values.values())
        found, path = ts.load_scene(device), "ground.restitution.coefficient"
        assert (values[path]["value"], values[path]["source"]) == (get_value(found, path), source)
    assert "58 µm" in line(tarsus("show", "cantilever-1"), "ground.film.thickness")


def test_intervals_impact_map_and_landing_rule_are_shown(tarsus, tmp_path):
    shown = tarsus("show", "hexapod")
    assert "117.24, 136.07," in line(shown, "robot.structure.frequencies")
    assert "2.68 to 3.13 kHz" in shown.out and "±" in shown.out
    assert max(map(len, shown.out.splitlines())) <= 120
    assert "impact law: dominant mode, made passive" in shown.out
    found = tarsus("show", "hexapod", "--json").json()
    by_path = {one["path"]: one for one in found["values"]}
    low, high = by_path["robot.structure.frequencies.5"]["interval"]
    assert 2600.0 < low < by_path["robot.structure.frequencies.5"]["value"] < high < 3200.0
    assert by_path["robot.feet.foot1.gap"]["interval"] is None
    assert found["impact_map"]["passive"] is True and found["landing"] == "capture_unless_pulled"
    assert found["impact_map"]["worst_gain"] == pytest.approx(1.0, abs=1e-9)
    file = tmp_path / "slow.toml"
    rule = ts.laws.RestituteFirst(speed=0.02)
    ts.write_scene(ts.load_scene("cantilever", **{"ground.landing": rule}), file)
    out = tarsus("show", file).out
    assert "landing: restitution first, held when slow" in out and "ground.landing.speed" in out
    assert "95 % interval" not in tarsus("show", BALL).out
    path, value = "ground.restitution.coefficient", 0.378
    for low, high, said in ((0.3, value, "0.3 to 0.378 !"), (value - 0.02, value + 0.02, "±\N{NO-BREAK SPACE}0.02")):
        origin = {"source": "calibrated", "note": "seen", "interval": [[low, high]]}
        known = ts.with_values(ts.load_scene("cantilever"), {path: value, "provenance": {path: origin}})
        ts.write_scene(known, file)
        assert said.replace("\N{NO-BREAK SPACE}", " ") in line(tarsus("show", file), path)


def test_check_accepts_what_was_written_and_names_all_errors_at_once(tarsus, scene_table, save, magnet):
    assert "is a good scene" in tarsus("check", save(scene_table)).out
    scene_table["ground"]["laws"] = {"magnet": {"strength": "2e-24 N m^4"}}
    alone = tarsus("check", save(scene_table))
    assert alone.code == 2 and "--law" in alone.sentences[0]
    assert tarsus("check", save(scene_table), "--law", magnet).code == 0
    scene_table["ground"]["film"]["thickness"] = "0 um"
    scene_table["ground"]["adhesion"]["inital"] = scene_table["ground"]["adhesion"].pop("initial")
    scene_table["robot"]["feet"]["tip"]["gap"] = "3 mg"
    result = tarsus("check", save(scene_table))
    assert result.code == 2
    for parts in (("ground.film.thickness", "above 0"), ("inital", "'initial'"), ("robot.feet.tip.gap", "a mass")):
        assert any(all(part in one for part in parts) for one in result.sentences)


@pytest.fixture(scope="module")
def runs(tmp_path_factory):
    """Folders of two runs that differ in their restitution."""
    from tarsus.cli import main

    root = tmp_path_factory.mktemp("runs")
    for name, coefficient in (("a", "0.378"), ("b", "0.4")):
        words = ["simulate", "cantilever", "--duration", "40 ms", "--no-report", "-o", str(root / name)]
        assert main([*words, "--set", f"ground.restitution.coefficient={coefficient}"]) == 0
    return root


def test_a_stored_run_is_shown_as_it_was_simulated(tarsus, runs, opened):
    found = opened(runs / "a", "run", "0.04 s simulated", "lost in impacts")
    assert found["ok"] and found["duration_s"] == 0.04 and found["measures"]["impacts"]["value"] >= 2
    series = {one["name"]: one for one in opened(runs / "a" / "series.nc", "series")["series"]}
    assert series["gap"]["unit"] == "m" and series["gap"]["smallest"] < 1e-12
    assert set(opened(runs, "folder of results")["folders"]) == {"a", "b"}


def test_studies_calibrations_and_sweeps_are_shown(tarsus, tmp_path):
    found = tarsus("show", "cantilever-adhesion", "--json").json()
    assert found["runs"] == 54 and found["vary"]["ground.restitution.coefficient"] == [0.1, 0.6]
    assert "ground.restitution.coefficient" in tarsus("show", "cantilever-adhesion").out
    from tarsus.files.installed import study_path
    from tarsus.files.tables import FileKind

    file = study_path("cantilever", FileKind.CALIBRATION)
    assert len(tarsus("show", file, "--json").json()["unknowns"]) >= 5
    assert "is a good calibration" in tarsus("check", file).out


def test_runs_are_compared(tarsus, runs):
    found = tarsus("show", runs / "a", runs / "b", "--json").json()
    assert [row["path"] for row in found["values"]] == ["ground.restitution.coefficient"]
    assert found["values"][0]["difference"] == pytest.approx(0.4 / 0.378 - 1.0)
    assert found["parting"]["number"] == 2 and found["parting"]["first"]["kind"] == "bounce"
    speeds = {row["name"]: row for row in found["measures"]}["hardest_impact"]
    assert speeds["difference"] == pytest.approx(0.0, abs=1e-6)
    shown = tarsus("show", runs / "a", runs / "b").out
    assert "they part at event 2: bounce of tip" in shown and "5.82 %" in shown
    same = tarsus("show", runs / "a", runs / "a", "--json").json()
    assert same["parting"] is None and same["values"] == []
    assert all(row["difference"] in (0.0, None) for row in same["measures"] + same["energies"])


@pytest.mark.parametrize(("shift", "parted"), [(0.5e-6, False), (2e-6, True)])
def test_events_at_times_as_near_as_no_ground_is_known_are_the_same(runs, shift, parted):
    """Shifts as parts of the duration, of which a millionth is allowed."""
    run, late = (ts.load_run(runs / "a") for _ in range(2))
    late.events["time"] += shift * run.duration
    assert (of_runs(("a", "b"), run, late).data["parting"] is not None) == parted


def test_a_value_is_compared_with_the_interval_of_the_other(tarsus, tmp_path):
    """A number well within the interval that the device states, one beyond, and one that has none."""
    scene = ts.load_scene("cantilever")
    damping, adhesion, gap = ("robot.structure.damping_ratios.0", "ground.adhesion.initial", "robot.feet.tip.gap")
    low, high = scene.interval(damping)
    changes = {damping: low + 0.3 * (high - low), adhesion: 2.0 * scene.interval(adhesion)[1], gap: 71e-6}
    other = tmp_path / "other.toml"
    ts.write_scene(ts.with_values(scene, changes), other)
    found = tarsus("show", "cantilever", other, "--json").json()
    inside = {row["path"]: row["inside"] for row in found["values"]}
    assert inside == {damping: True, adhesion: False, gap: None}
    assert "1 of 2 values with a 95 % interval" in tarsus("show", "cantilever", other).out
    bare = {"provenance": {}, "robot.drives.pzt.law.constant": "-2 uN"}
    ts.write_scene(ts.with_values(scene, changes | bare), other)
    back = {row["path"]: row for row in tarsus("show", other, "cantilever", "--json").json()["values"]}
    assert {path: back[path]["inside"] for path in inside} == inside, "the second's, where the first has none"
    raised = back["robot.drives.pzt.law.constant"]
    assert raised["difference"] == pytest.approx((raised["second"] + 2e-6) / 2e-6), "up is up"


def test_a_folder_where_another_verb_keeps_its_runs_is_no_sweep(tarsus, tmp_path):
    RunStore.open(tmp_path / "fit", {"study.toml": "", "scene.toml": ""}, what="calibration")
    shown = tarsus("show", tmp_path / "fit")
    assert shown.code == 0 and "was not finished" in shown.out and "--resume" in shown.out
    for verb in ("check", "report"):
        said = tarsus(verb, tmp_path / "fit")
        assert said.code == 2 and "--resume" in said.sentences[0]


def test_draws_are_shown_as_95_percent_of_them_and_what_is_none_is_refused(tarsus, tmp_path):
    even = np.linspace(0.0, 1.0, 1001)[:, None]
    write_draws(tmp_path / "even.npz", ["a"], np.zeros(1), even)
    found = tarsus("show", tmp_path / "even.npz", "--json").json()["numbers"]["a"]
    assert found == {"median": pytest.approx(0.5), "interval": pytest.approx([0.025, 0.975])}
    (tmp_path / "empty.npz").touch()
    np.savez(tmp_path / "none.npz", paths=np.array(["a"]), values=np.zeros(1), samples=np.zeros((0, 1)))
    for name in ("empty.npz", "none.npz"):
        found = tarsus("show", tmp_path / name)
        assert found.code == 2 and "holds no draws" in found.sentences[0]


def test_a_file_that_is_no_record_yet_is_listed_and_not_good(tarsus, tmp_path):
    file = tmp_path / "record.csv"
    file.write_text("time (s),velocity,drive (furlong)\n0,1,2\n0.1,2,3\n0.2,4,3\n")
    shown = tarsus("show", str(file))
    assert shown.code == 0 and "3 series, not read as a record yet" in shown.out
    assert "what channels 'velocity', 'drive (furlong)' measure; give it with --read NAME=UNIT" in shown.err
    assert [one["name"] for one in tarsus("show", str(file), "--json").json()["series"]][:2] == ["time", "velocity"]
    checked = tarsus("check", str(file))
    assert checked.code == 2 and "nothing says what channels 'velocity', " in checked.err
