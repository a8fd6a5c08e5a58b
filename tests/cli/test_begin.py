"""Where work begins: new files, what records hold, whether things can be used, whether the installation is sound."""

import math
import re
import shlex
import tomllib

import numpy as np
import pytest

import tarsus as ts
from tarsus.base.plausible import remarks
from tarsus.design.problem import DesignSettings, problem_of
from tarsus.design.request import settings_of
from tarsus.files.library import device_names
from tarsus.files.toml import scene_text
from tarsus.inspection import installation
from tarsus.model.scene import Source


def offers_all_sources(file) -> bool:
    """Each word that the comment of a new file offers for where a number comes from is one, and none is missing."""
    offered = re.search(r"^\[provenance\].*: (.*)$", file.read_text(), re.MULTILINE)[1].replace(" or ", ", ")
    return set(offered.split(", ")) == {one.value for one in Source}


def test_a_new_device_is_a_good_scene_that_runs(tarsus, tmp_path):
    file = tmp_path / "my robot.toml"
    said = tarsus("new", "device", file)
    assert said.code == 0 and offers_all_sources(file)
    assert "is a good scene: my robot (1 drive, 1 foot" in tarsus("check", file).out
    structure = ts.load_scene(file).robot.structure
    assert all(structure.row(one) @ structure.vertical() == pytest.approx(1.0, abs=0.01) for one in structure.points)
    typed = shlex.split(" ".join(re.search(r"`tarsus (.*) -o FOLDER`", said.out, re.DOTALL)[1].split()))
    run = tarsus(*typed, "--json").json()
    assert run["ok"] and run["measures"]["impacts"]["value"] >= 1


def test_a_new_device_may_be_a_copy(tarsus, tmp_path):
    file = tmp_path / "mine.toml"
    assert tarsus("new", "device", file, "--device", "cantilever-1").code == 0
    found = tarsus("show", "cantilever-1", file, "--json").json()
    assert found["values"] == [] and found["same"] > 20


def test_a_new_law_acts(tarsus, tmp_path):
    file = tmp_path / "magnet.py"
    assert tarsus("new", "law", file).code == 0
    words = ("simulate", "cantilever", "--duration", "5 ms", "--json")
    free = tarsus(*words).json()
    pulled = tarsus(*words, "--law", file, "--set", "ground.laws.magnet.strength=3e-22 N m^4").json()
    assert pulled["ledger_J"]["laws"]["magnet"] != 0.0 and "magnet" not in free["ledger_J"]["laws"]


@pytest.mark.parametrize(
    ("device", "varied"),
    [
        ("cantilever-1", "restitution and film"),
        ("hexapod-walker", "restitution and film"),
        ("mems-switch", "volts and frequency"),
        ("climber", "friction and robot.structure.body.mass"),
    ],
)
def test_a_new_study_varies_what_its_device_has(tarsus, tmp_path, device, varied):
    file = tmp_path / "mine.toml"
    assert tarsus("new", "study", file, "--device", device).code == 0
    assert f"is a good study: {varied}: 15 runs" in tarsus("check", file).out
    assert f'scene = "{device}"' in file.read_text()


def test_a_new_study_of_a_scene_file_runs(tarsus, tmp_path):
    """The file has neither film nor adhesion and lies in another folder than the study, which is named from there."""
    scene, file = tmp_path / "mine.toml", tmp_path / "studies" / "st.toml"
    tarsus("new", "device", scene)
    text = scene.read_text()
    kept = text[: text.index("[ground.film]")] + text[text.index("[ground.gravity]") :]
    scene.write_text(kept.replace('duration = "0.1 s"', 'duration = "10 ms"'))
    file.parent.mkdir()
    assert tarsus("new", "study", file, "--device", scene).code == 0
    assert 'scene = "../mine.toml"' in file.read_text()
    assert tarsus("sweep", file, "-o", tmp_path / "out").code == 0
    seen = tarsus("show", tmp_path / "out", "--json").json()["measures"]["impact_speed"]
    assert 0.0 < seen["least"] <= seen["median"] <= seen["most"] and 0 < seen["runs"] <= 15
    assert set(seen["most_at"]) == {"ground.restitution.coefficient", "volts"}
    assert re.search("impact speed .*mm/s", tarsus("show", tmp_path / "out").out)


def test_a_new_design_is_searched_as_it_is_and_on_grounds(tarsus, tmp_path):
    """It lies in another folder than its scene, which is named from there; the line of a ground may be uncommented."""
    scene, file = tmp_path / "mine.toml", tmp_path / "designs" / "best.toml"
    tarsus("new", "device", scene, "--device", "cantilever")
    file.parent.mkdir()
    assert tarsus("new", "design", file, "--device", scene).code == 0
    text = file.read_text()
    assert 'scene = "../mine.toml"' in text and '# "ground.restitution.coefficient" = [' in text
    few = [word for one in ("candidates=64", "from_rest=60 ms", "look=2") for word in ("--request", one)]
    found = tarsus("design", file, *few, "--no-report", "--json", "-o", tmp_path / "out").json()
    assert found["free"] == ["signals.pzt.amplitude", "signals.pzt.frequency"] and found["over"] == []
    assert found["robust"]["nominal"]["mean apex"] > 0.0
    file.write_text(text.replace('# "ground', '"ground'))
    found = tarsus("design", file, *few, "--no-report", "--json", "-o", tmp_path / "other").json()
    assert found["over"] == ["ground.restitution.coefficient"] and found["risk"] == "worst"


@pytest.mark.parametrize("device", ["hexapod-walker", "climber", "mems-switch"])
def test_a_new_design_asks_for_what_its_device_has(tarsus, tmp_path, device):
    file = tmp_path / "mine.toml"
    assert tarsus("new", "design", file, "--device", device).code == 0
    scene = ts.load_scene(device)
    asked = problem_of(scene, settings_of(DesignSettings, file), None)
    assert f"is a good design file: {scene.name}, mean" in tarsus("check", file).out
    assert tarsus("show", file, "--json").json()["free"] == list(asked.free.names)
    swept = tarsus("sweep", file, "-o", tmp_path / "out")
    assert swept.code == 2 and "`tarsus design` takes it" in swept.sentences[0]
    (path, *_), (wanted,) = asked.free.paths, asked.objectives
    assert path.startswith("gait." if scene.gait else "signals.")
    assert wanted.measure == ("mean_apex" if device == "mems-switch" else "mean_speed")


@pytest.fixture
def lab(tmp_path):
    """A folder with two repeats whose columns have units and one file whose columns have none."""
    time = np.arange(400) / 10e3
    rows = np.column_stack([time, 1e-3 * np.sin(2e3 * time), 8.0 * np.sign(np.sin(300.0 * time + 0.1))])
    for name in ("steps-1.csv", "steps-2.csv"):
        text = "time [s],tip velocity [m/s],volts [V]\n"
        text += "\n".join(",".join(f"{x:.9g}" for x in row) for row in rows)
        (tmp_path / name).write_text(text)
        rows[:, 1] *= 1.01
    (tmp_path / "bare-1.csv").write_text("a,b\n" + "\n".join(f"{x:.6g},{y:.6g}" for x, y, _ in rows))
    return tmp_path


def test_a_new_campaign_lists_the_records_of_a_folder_and_is_checked_with_them(tarsus, lab):
    found = tarsus("new", "campaign", lab, "--device", "cantilever", "--json").json()
    text = (lab / "campaign.toml").read_text()
    for line in (
        'files = "steps-*.csv"',
        'drive = "volts"',
        '# "tip velocity" = { point = "tip" }',
        "# a velocity",
        "# Put sets in the order in which they were recorded. Four sets of each purpose, and the first again at the",
    ):
        assert line in text
    assert "[records.bare]" in text and any("bare-1.csv" in one for one in found["remarks"])
    again = tarsus("new", "campaign", lab)
    assert again.code == 2 and "stays as it is" in again.sentences[0]
    bad = tarsus("check", lab)
    assert bad.code == 2 and any("bare-1.csv" in one for one in bad.sentences)
    kept = text[: text.index("[records.bare]")] + text[text.index("[records.steps]") :]
    (lab / "campaign.toml").write_text(kept)
    bad = tarsus("check", lab)
    assert bad.code == 2 and any("no channel is the displacement of point 'tip'" in one for one in bad.sentences)
    shown = tarsus("show", lab / "steps-1.csv", "--json").json()
    assert shown["samples"] == 400 and shown["rate_hz"] == pytest.approx(10e3)
    tip = next(one for one in shown["channels"] if one["name"] == "tip velocity")
    assert tip["unit"] == "m/s" and tip["largest"] == pytest.approx(1e-3, rel=1e-3)


def test_sweeps_that_differ_are_sets_of_their_own(tarsus, tmp_path):
    """One goes up, one down, one takes longer; a repeat of the first stays with it. Rests are read off the volts."""
    rest, step = 200, 1e-4
    for name, (low, high, count) in {
        "sweep-1": (20.0, 400.0, 4000),
        "sweep-2": (20.0, 400.0, 4000),
        "sweep-3": (400.0, 20.0, 4000),
        "sweep-4": (20.0, 400.0, 5000),
        "steps-1": (50.0, 50.0, 4000),
    }.items():
        time = step * np.arange(count)
        angle = 2.0 * np.pi * (low * time + 0.5 * (high - low) / time[-1] * time**2)
        still = rest if name.startswith("steps") else 0
        volts = np.concatenate([np.zeros(still), np.sin(angle) + (0.0 if still else 1.5)])
        rows = np.column_stack([step * np.arange(len(volts)), volts, 1e-3 * volts])
        text = "\n".join(",".join(f"{x:.9g}" for x in row) for row in rows)
        (tmp_path / f"{name}.csv").write_text(f"time [s],U [V],Spitze v [m/s]\n{text}\n")
    assert tarsus("new", "campaign", tmp_path, "--device", "cantilever").code == 0
    sets = tomllib.loads((tmp_path / "campaign.toml").read_text())
    assert sets["defaults"] == {"drive": "U"}
    assert {name: one["files"] for name, one in sets["records"].items()} == {
        "steps": "steps-1.csv",
        "sweep-1": ["sweep-1.csv", "sweep-2.csv"],
        "sweep-3": "sweep-3.csv",
        "sweep-4": "sweep-4.csv",
    }
    assert sets["records"]["steps"]["rest"] == "20 ms" and "rest" not in sets["records"]["sweep-1"]
    assert '# "Spitze v" = { point = "?" }' in (tmp_path / "campaign.toml").read_text()


@pytest.mark.parametrize("legs", [1, 2, 3, 4, 6, 8, 40])
def test_a_new_robot_walks_on_any_number_of_legs(tarsus, tmp_path, legs):
    file = tmp_path / "walker.toml"
    assert tarsus("new", "device", file, "--legs", legs, "--mass", "0.3 g").code == 0 and offers_all_sources(file)
    scene = ts.load_scene(file)
    assert len(scene.robot.feet) == legs and scene.robot.structure.body.mass == 3e-4
    assert all(one.capacitance for one in scene.robot.drives.values())  # a gait's design asks for energy
    lines = file.read_text().splitlines()
    assert sum("#" in one for one in lines) > 12 and len(lines) <= max(60, 28 + 4 * legs)
    if legs <= 8:
        run = ts.simulate(scene, 0.25)
        assert run.ok and run.measures["mean_speed"].value > (1e-4 if legs == 1 else 2e-3)


SWEPT = (
    'signal = { kind = "swept_sine", amplitude = "8 V", start_frequency = "5 Hz", stop_frequency = "20 Hz", '
    'duration = "0.3 s" }'
)
LOOPS = """device = "cantilever"
points = ["tip"]
[defaults]
rest = "10 ms"
drive = "volts"
[defaults.channels]
x = { unit = "um", point = "tip" }
v = { unit = "mm/s", point = "tip" }
volts = "V"
tilt = "V"
[records.loops]
purpose = "PURPOSE"
files = ["loops-1.mat"]
"""


@pytest.fixture
def bare(tmp_path):
    """A folder with a MATLAB file as laboratories write it, columns without units, and its campaign file."""
    from scipy.io import savemat

    time, noise = np.arange(4000) / 10e3, np.random.default_rng(1).standard_normal((2, 4000))
    angle = 2.0 * np.pi * 10.0 * np.maximum(time - 10e-3, 0.0)
    x, v = 5.0 * (1.0 - np.cos(angle)) + 1e-3 * noise[0], 0.1 * np.pi * np.sin(angle) + 1e-4 * noise[1]
    savemat(tmp_path / "loops-1.mat", {"time": time, "x": x, "v": v, "volts": 8.0 * np.sin(angle)})
    return tmp_path


@pytest.mark.parametrize(
    ("purpose", "signal", "code", "said"),
    [
        ("loops", "", 0, "no records are for 'ramps'"),
        ("validation", "", 2, "no set of records determines a number: all are for validation"),
        ("modal", "", 2, "need the swept sine that drove them"),
        ("loops", SWEPT, 2, "a swept sine serves 'modal', got 'loops'"),
    ],
)
def test_a_campaign_is_good_where_its_records_serve_their_purpose(tarsus, bare, purpose, signal, code, said):
    """Of channels whose units are said once for all files a file may lack some."""
    (bare / "campaign.toml").write_text(LOOPS.replace("PURPOSE", purpose) + signal)
    found = tarsus("check", bare)
    assert found.code == code and any(said in one for one in found.sentences), found.sentences


def test_a_new_campaign_has_lines_to_uncomment_and_guesses_purposes(tarsus, bare):
    for name in ("sweep-1", "held-out-sine", "other"):
        (bare / f"{name}.mat").write_bytes((bare / "loops-1.mat").read_bytes())
    tarsus("new", "campaign", bare, "--device", "cantilever")
    text = (bare / "campaign.toml").read_text()
    assert text.count("# x = ") == 1 and '# volts = "V"' in text and '# v = { unit = "mm/s"' in text
    told = dict(zip(re.findall(r"\[records\.(.*)\]", text), re.findall('purpose = "(.*)"', text), strict=True))
    assert told == {"held-out-sine": "validation", "loops": "loops", "other": "validation", "sweep": "modal"}
    assert text.count("guessed from the name") == 3 and text.count("say what for") == 1
    (bare / "campaign.toml").write_text(re.sub(r"(?m)^# (?=[\[a-z].*( = |defaults))", "", text))
    assert not any("nothing says what channel" in one for one in tarsus("check", bare).sentences)


def test_channels_of_a_new_campaign_fit_their_files_as_they_are_uncommented(tarsus, bare):
    """Points are guessed from a device in the folder, the drive is among a set's channels, and what the defaults say
    of some files leaves the others as they are."""
    (bare / "device.toml").write_text(scene_text(ts.load_scene("cantilever")), encoding="utf-8")
    (bare / "ramps-1.csv").write_text(
        "time [s],tip velocity [mm/s],pzt volts [V]\n"
        + "".join(f"{1e-4 * k:.4f},{math.sin(k) * (k > 20)},{8.0 * (k > 20)}\n" for k in range(200))
    )
    tarsus("new", "campaign", bare, "--device", "device.toml")
    text = (bare / "campaign.toml").read_text()
    assert '# "tip velocity" = { point = "tip" }' in text and '# "pzt volts" = {}' in text
    (bare / "campaign.toml").write_text(re.sub(r"(?m)^# (?=[\[a-z\"].*( = |defaults|records))", "", text))
    said = tarsus("check", bare).sentences
    assert not any("ramps-1.csv" in one and ("no channel" in one or "drive" in one) for one in said), said


def test_packaged_devices_are_remarked_on_in_nothing():
    assert {name: remarks(ts.load_scene(name)) for name in device_names()} == {name: [] for name in device_names()}


def test_doctor_checks_the_engine_and_complains_of_a_wrong_one(tarsus, monkeypatch):
    found = tarsus("doctor", "--json").json()
    assert found["engine_error"] < 1e-12 and found["devices"] >= 10
    monkeypatch.setattr(installation, "IMPACTS", (0.4515236409857308, 1.2642, 1.9957))
    said = tarsus("doctor")
    assert said.code == 1 and "build it again" in said.sentences[0]


def test_completion_is_a_script(tarsus):
    assert "_tarsus" in tarsus("completion", "bash").out
