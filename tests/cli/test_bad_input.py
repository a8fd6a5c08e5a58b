"""Bad input: each a clear sentence and exit code 2, before anything is simulated."""

from __future__ import annotations

import os

import pytest


def refuse(result, *parts: str) -> str:
    """The sentence that holds all parts, of a result that must be a refusal."""
    assert result.code == 2
    assert result.out == ""
    matching = [one for one in result.sentences if all(part in one for part in parts)]
    assert matching, result.err
    return matching[0]


@pytest.mark.parametrize(
    ("setting", "parts"),
    [
        ("ground.film.thickness=0", ("ground.film.thickness", "above 0")),
        ("ground.film.thickness=0 um", ("ground.film.thickness", "above 0")),
        ("ground.film.thickness=70 mg", ("ground.film.thickness", "a length (m)", "a mass")),
        ("ground.film.thickness=nan", ("ground.film.thickness", "finite")),
        ("ground.film.thicknes=1 um", ("did you mean 'ground.film.thickness'",)),
        ("robot.feet.tip.gap=-5 um", ("robot.feet.tip.gap",)),
        ("ground.restitution.coefficient=-0.4", ("from 0 to 1",)),
        ("volts=8 m", ("a voltage",)),
        ("wave=sqare", ("square",)),
        ("ground.film.thickness", ("path=value",)),
        ("=3", ("path=value",)),
        ("duration=0", ("duration", "above 0")),
    ],
)
def test_settings(tarsus, setting, parts):
    refuse(tarsus("simulate", "cantilever", "--set", setting), *parts)


def test_the_same_setting_twice(tarsus):
    words = ("simulate", "cantilever", "--set", "volts=6", "--set", "volts=8")
    refuse(tarsus(*words), "'volts' twice")


def test_all_bad_settings_are_named_at_once(tarsus):
    result = tarsus(
        "simulate", "cantilever", "--set", "ground.film.thickness=0", "--set", "ground.adhesion.rate=2 V"
    )
    refuse(result, "ground.film.thickness")
    refuse(result, "ground.adhesion.rate", "a voltage")


@pytest.mark.parametrize("text", ["0", "0 s", "-1 s", "nan", "inf", "3 V", "soon"])
def test_durations(tarsus, text):
    refuse(tarsus("simulate", "cantilever", f"--duration={text}"), "duration")


@pytest.mark.parametrize("text", ["1e7", "1e300 s"])
def test_a_run_that_would_never_end(tarsus, text):
    refuse(tarsus("simulate", "cantilever", "--duration", text), "steps", "longest run")


@pytest.mark.parametrize(
    ("key", "value", "parts"),
    [
        ("mass", [[float("nan"), 0.0], [0.0, 1.0]], ("mass", "finite")),
        ("mass", [[-1.0, 0.0], [0.0, 1.0]], ("robot.structure.mass", "never negative")),
        ("mass", [[1.0, 1.0], [1.0, 1.0]], ("mass", "singular")),
        ("mass", [1.0, -2.0], ("mass",)),
        ("stiffness", [[1.0, 0.0]], ("stiffness",)),
    ],
)
def test_structures(tarsus, scene_table, save, key, value, parts):
    lumped = {
        "kind": "lumped",
        "coordinates": ["tip", "center"],
        "mass": [[1e-9, 0.0], [0.0, 1e-9]],
        "stiffness": [[1.0, -0.5], [-0.5, 1.0]],
        "damping": [[0.0, 0.0], [0.0, 0.0]],
    }
    scene_table["robot"]["structure"] = lumped
    scene_table["robot"]["drives"]["pzt"]["load"] = {"kind": "point", "weights": {"center": 1.0}}
    scene_table.pop("provenance", None)
    assert tarsus("check", save(scene_table)).code == 0
    lumped[key] = value
    refuse(tarsus("simulate", save(scene_table)), *parts)


def test_a_foot_below_the_ground_at_rest(tarsus, scene_table, save):
    scene_table["robot"]["feet"]["tip"]["gap"] = "-1 um"
    refuse(tarsus("simulate", save(scene_table)), "robot.feet.tip.gap")


def test_an_unknown_key(tarsus, scene_table, save):
    scene_table["groud"] = scene_table.pop("ground")
    refuse(tarsus("simulate", save(scene_table)), "groud", "did you mean 'ground'")


def test_an_unknown_device_and_a_missing_file(tarsus, tmp_path):
    refuse(tarsus("simulate", "cantilver"), "did you mean 'cantilever'")
    refuse(tarsus("simulate", tmp_path / "none.toml"), "none.toml")


LAWS = {
    "raises.py": ("raise RuntimeError('no magnet today')\n", ("line 1", "no magnet today")),
    "syntax.py": ("x = 1\ndef law(:\n", ("line 2",)),
    "empty.py": ("x = 1\n", ("no law",)),
    "divides.py": (
        "from tarsus.model.laws import SmoothLaw\n"
        "from tarsus.base.spec import quantity\n"
        "class Divides(SmoothLaw):\n"
        "    strength: float = quantity('N', 'strength', default=1.0)\n"
        "    @staticmethod\n"
        "    def force(gap, gap_rate, volts, time, strength):\n"
        "        return strength / 0.0\n",
        ("line 7", "ZeroDivisionError"),
    ),
}


@pytest.mark.parametrize("name", sorted(LAWS))
def test_law_files(tarsus, tmp_path, name):
    text, parts = LAWS[name]
    file = tmp_path / name
    file.write_text(text, encoding="utf-8")
    refuse(tarsus("simulate", "cantilever", "--law", file), name, *parts)


def test_a_law_file_that_is_missing(tarsus, tmp_path):
    refuse(tarsus("simulate", "cantilever", "--law", tmp_path / "none.py"), "none.py")


def test_a_law_value_that_is_wrong(tarsus, magnet):
    words = ("simulate", "cantilever", "--law", magnet, "--set")
    refuse(tarsus(*words, "ground.laws.magnet.strength=3 V"), "ground.laws.magnet.strength", "a voltage")
    refuse(tarsus(*words, "ground.laws.magnet.strenght=3"), "strenght", "did you mean 'strength'")
    refuse(tarsus(*words, "ground.laws.magnet.offset=0"), "ground.laws.magnet.offset", "above 0")


def test_an_output_folder_that_is_a_file(tarsus, tmp_path):
    file = tmp_path / "taken"
    file.write_text("", encoding="utf-8")
    refuse(tarsus("simulate", "cantilever", "-o", file), "is a file")
    refuse(tarsus("simulate", "cantilever", "-o", file / "below"), "is a file")


@pytest.mark.skipif(os.name == "nt" or os.geteuid() == 0, reason="the superuser may write anywhere")
def test_an_output_folder_that_is_not_writable(tarsus, tmp_path):
    folder = tmp_path / "closed"
    folder.mkdir(mode=0o500)
    refuse(tarsus("simulate", "cantilever", "-o", folder / "out"), "not writable")


def test_rows_files(tarsus, tmp_path):
    rows = tmp_path / "rows.csv"
    rows.write_text("freq_hz,volt_v,wave\n5,6,sine\n5,six,sine\n", encoding="utf-8")
    refuse(tarsus("reproduce", "cantilever", "--rows", rows), "rows.csv, line 3", "'six'")
    refuse(tarsus("reproduce", "cantilever", "--rows", tmp_path / "none.csv"), "none.csv")
    refuse(tarsus("reproduce", "cantilever", "--device", "cantilver"), "did you mean 'cantilever'")


def test_lines_are_named_for_a_law_file_given_by_a_relative_path(tarsus, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "raises.py").write_text("x = 1\nraise RuntimeError('boom')\n", encoding="utf-8")
    refuse(tarsus("simulate", "cantilever", "--law", "raises.py"), "raises.py, line 2", "boom")


def test_a_negative_duration(tarsus):
    refuse(tarsus("simulate", "cantilever", "--duration", "-3 s"), "--duration", "above 0", "-3 s")


def test_files_that_are_no_scene(tarsus, tmp_path):
    (tmp_path / "bytes.toml").write_bytes(b"\xca\xfe\xba\xbe")
    refuse(tarsus("check", tmp_path / "bytes.toml"), "bytes.toml", "no text file")
    refuse(tarsus("simulate", tmp_path), "cannot be read", "is a directory")
