"""`devices`, `show` and `check`."""

from __future__ import annotations

import tarsus as ts
from tarsus.base.spec import get_value


def test_devices_lists_the_packaged_ones(tarsus):
    result = tarsus("devices", "--json")
    assert result.code == 0
    listed = {one["name"]: one for one in result.json()["devices"]}
    assert {"cantilever", "cantilever-1"} <= set(listed)
    assert listed["cantilever"]["feet"] == 1
    text = tarsus("devices")
    assert text.code == 0
    assert "cantilever-1" in text.out


def test_show_gives_every_value_its_unit_and_provenance(tarsus):
    for device in ("cantilever", "cantilever-1"):
        result = tarsus("show", device, "--json")
        assert result.code == 0
        values = result.json()["values"]
        assert len(values) > 10
        assert all(one["source"] in {"printed", "derived", "calibrated", "assumed"} for one in values), device
        assert all(one["note"] for one in values)
        by_path = {one["path"]: one for one in values}
        assert by_path["ground.adhesion.initial"]["unit"] == "N"
        scene, path = ts.load_scene(device), "ground.restitution.coefficient"
        expected = {"cantilever": "calibrated", "cantilever-1": "printed"}[device]
        assert (by_path[path]["value"], by_path[path]["source"]) == (get_value(scene, path), expected)


def test_show_prints_units_for_people(tarsus):
    result = tarsus("show", "cantilever-1")
    assert result.code == 0
    line = next(line for line in result.out.splitlines() if line.startswith("ground.film.thickness"))
    assert "58 um" in line


def test_show_of_a_device_that_is_not_there_names_the_nearest(tarsus):
    result = tarsus("show", "cantilver")
    assert result.code == 2
    assert "cantilver" in result.sentences[0]
    assert "did you mean 'cantilever'" in result.sentences[0]


def test_check_accepts_what_was_written(tarsus, scene_table, save):
    result = tarsus("check", save(scene_table))
    assert result.code == 0
    assert "good" in result.out


def test_check_names_all_errors_at_once(tarsus, scene_table, save):
    scene_table["ground"]["film"]["thickness"] = "0 um"
    scene_table["ground"]["adhesion"]["inital"] = scene_table["ground"]["adhesion"].pop("initial")
    scene_table["robot"]["feet"]["tip"]["gap"] = "3 mg"
    result = tarsus("check", save(scene_table))
    assert result.code == 2
    said = result.sentences
    assert any("ground.film.thickness" in one and "above 0" in one for one in said)
    assert any("inital" in one and "did you mean 'initial'" in one for one in said)
    assert any("robot.feet.tip.gap" in one and "a mass" in one for one in said)


def test_check_of_a_scene_with_a_law_of_ones_own(tarsus, scene_table, save, magnet):
    scene_table["ground"]["laws"] = {"magnet": {"strength": "2e-24 N m^4"}}
    file = save(scene_table)
    alone = tarsus("check", file)
    assert alone.code == 2
    assert "--law" in alone.sentences[0]
    assert tarsus("check", file, "--law", magnet).code == 0


def test_check_of_no_file_and_of_no_toml(tarsus, tmp_path):
    missing = tarsus("check", tmp_path / "none.toml")
    assert missing.code == 2
    assert "none.toml" in missing.sentences[0]
    broken = tmp_path / "broken.toml"
    broken.write_text("name = = 3\n", encoding="utf-8")
    result = tarsus("check", broken)
    assert result.code == 2
    assert "line 1" in result.sentences[0]
