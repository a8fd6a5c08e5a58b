"""A law of the ground or of a drive, or a waveform, is one file: put beside those of the library it acts everywhere."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

import tarsus as ts
from tarsus.model.laws import registry

LAWS = {
    "suction": '''
"""A seal between foot and ground."""
from tarsus.model.laws.base import DampingLaw
from tarsus.base.spec import quantity

class Suction(DampingLaw):
    slot = "suction"
    slot_note = "a seal between foot and ground"
    title = "seal"

    drag: float = quantity("N s/m", "drag at contact", ge=0)
    height: float = quantity("m", "height over which it falls", gt=0)

    @staticmethod
    def momentum(gap, drag, height):
        return drag * height / (1.0 + gap / height)
''',
    "wind": '''
"""A breeze from below."""
from tarsus.model.laws.base import SmoothLaw
from tarsus.base.spec import quantity

class Wind(SmoothLaw):
    title = "breeze"
    uses_rate = False
    lift: float = quantity("N", "force")

    @staticmethod
    def force(gap, gap_rate, volts, time, lift):
        return lift
''',
}
LAWS["wet"] = '''
"""Lubricated feet."""
from typing import Literal
from tarsus.base.spec import quantity
from tarsus.model.laws.base import FrictionLaw

class Lubricated(FrictionLaw):
    slot = "friction"
    kind: Literal["lubricated"] = "lubricated"
    dry: float = quantity("1", "coefficient of friction at rest", ge=0)
    viscosity: float = quantity("N s/m", "drag of the lubricant", ge=0)
    speed: float = quantity("m/s", "speed at which the feet float", gt=0)

    @staticmethod
    def bound(margin, strength, slip, dry, viscosity, speed):
        return dry * margin / (1.0 + slip / speed) + viscosity * slip
'''
WAVE = '''
"""A ramp up and down."""
from typing import Literal
import numpy as np
from tarsus.model.drive.signal import Signal
from tarsus.model.drive.track import linear_track
from tarsus.base.spec import quantity

class Tooth(Signal):
    kind: Literal["tooth"] = "tooth"
    top: float = quantity("V", "highest voltage")
    half: float = quantity("s", "time up, and down", gt=0)

    def volts(self, time):
        return np.interp(np.remainder(time, 2 * self.half), [0.0, self.half, 2 * self.half], [0.0, self.top, 0.0])

    def track(self):
        times = [0.0, self.half, 2 * self.half]
        return linear_track(times, [0.0, self.top], [self.top, 0.0], periodic=True, hold=False)
'''

BACKLASH = '''
"""A drive with play in its joint: half of the force comes through a gap."""
from typing import Literal
import numpy as np
from tarsus.base.columns import columns
from tarsus.base.spec import quantity
from tarsus.model.drive.law import VoltageLaw
from tarsus.model.drive.parts import Parts
from tarsus.model.drive.plays import play_states, remembered, states_along, visited

class Backlash(VoltageLaw):
    kind: Literal["backlash"] = "backlash"
    gain: float = quantity("N/V", "force per volt")
    slack: float = quantity("V", "half of the gap", ge=0)

    def force(self, volts, history=()):
        v = np.concatenate([visited(history), np.atleast_1d(volts)])
        play = play_states(v, np.array([self.slack]), np.zeros(1))[:, 0]
        return (0.5 * self.gain * (v + play))[1 + len(history):]

    def parts(self, track, history):
        r = columns((self.slack,))
        rest = states_along(track, r, remembered(history, r))[0::2]
        numbers = columns((0.5 * self.gain, self.slack))
        gain, slack = track.of_run(numbers)[:, 0], track.of_run(numbers)[:, 1]
        sign = track.direction()
        met = rest[:, 0] + sign * slack
        inside = (sign * (met - track.first) > 0.0) & (sign * (track.last - met) > 0.0)
        owner = np.flatnonzero(inside)
        stretch = np.concatenate([np.arange(track.count), owner])
        low = np.concatenate([np.full(track.count, -1.0), track.solve(owner, met[owner])])
        order = np.lexsort((low, stretch))
        stretch, low = stretch[order], low[order]
        new = low == -1.0
        high = np.append(np.where(new[1:], 1.0, low[1:]), 1.0)
        middle = track.values(stretch, 0.5 * (low + high))
        pushed = (sign[stretch] * (middle - met[stretch]) >= 0.0) & (sign[stretch] != 0.0)
        still = gain[stretch] * np.where(pushed, -sign[stretch] * slack[stretch], rest[stretch, 0])
        none = np.zeros(len(stretch))
        law = np.stack([still, gain[stretch] * (1.0 + pushed), none, none], axis=-1)
        return Parts(stretch, low, high, law, track.kink[stretch] | ~new)
'''


def run_beside(folder: Path, script: str) -> dict:
    """What a script prints in a process whose library has the files of a folder as well."""
    head = (
        "import importlib.util, sys, pathlib, json\n"
        "folder = pathlib.Path(sys.argv[1])\n"
        "import tarsus\n"
        "home = pathlib.Path(tarsus.__file__).parent\n"
        "class Beside:\n"
        "    def find_spec(self, name, path=None, target=None):\n"
        "        for package, at in (('tarsus.model.laws', 'laws'), ('tarsus.model.drive.waveforms', 'waves'),\n"
        "                            ('tarsus.model.drive.laws', 'drives')):\n"
        "            if name == package:\n"
        "                inside = home.joinpath(*package.split('.')[1:])\n"
        "                return importlib.util.spec_from_file_location(name, inside / '__init__.py',\n"
        "                    submodule_search_locations=[str(inside), str(folder / at)])\n"
        "sys.meta_path.insert(0, Beside())\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", head + script, str(folder)],
        capture_output=True,
        text=True,
        env=os.environ | {"MPLBACKEND": "agg"},
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout.splitlines()[-1])


SYSTEMS = """
import numpy as np
import tarsus as ts
from tarsus.inspection.runs import run_data
from tarsus.files.toml import parse_scene, scene_text
from tarsus.model.laws.registry import built_in
from tarsus.report import write_report

suction, wind = built_in()["suction"], built_in()["wind"]
wave = {"kind": "tooth", "top": "4 V", "half": "5 ms"}
base = ts.read_scene(sys.argv[2])
modal = {"ground.suction": suction(drag=2e-5, height=5e-6), "ground.laws.gust": wind(lift=-3e-8)}
wet = built_in()["lubricated"](dry=0.3, viscosity=2e-6, speed=1e-3)
legged = {"ground.suction": suction(drag=2e-7, height=5e-6), "ground.laws.gust": wind(lift=-3e-8)}
legged |= {"ground.friction": wet}
walker = ts.load_scene("millipede").model_copy(update={"duration": 0.006, "provenance": {}})
modal |= {"signals.pzt": wave, "duration": 0.02}
scenes = {"modal": ts.with_values(base, modal), "legged": ts.with_values(walker, legged)}
scenes = {name: scenes[name] for name in NAMES}
out = {}
for name, scene in scenes.items():
    text = scene_text(scene)
    assert parse_scene(text) == scene
    run = ts.simulate(scene, scene.duration)
    data = run.to_dataset()
    back = ts.load_run(run.save(folder / name))
    page = write_report(run, folder / "report.html").read_text() if name == "legged" else None
    path = "ground.suction.drag"
    drag = ts.get_value(scene, path)
    batch = ts.simulate_batch(scene, {path: [drag, 0.0]}, scene.duration, track=False)
    held = data["contact"].values.astype(bool)
    pushed = data["contact_force"].values[held] + data["pull"].values[held]
    parts = [data[f"{law}_force"].values[held] for law in ("gust", "electrostatic") if f"{law}_force" in data]
    out[name] = {
        "ok": run.ok, "closure": run.ledger.closure, "laws": dict(run.ledger.laws), "stored": dict(back.ledger.laws),
        "forces": {law: float(abs(data[f"{law}_force"]).max()) for law in run.ledger.laws},
        "works": {law: float(data[f"{law}_work"][-1]) for law in run.ledger.laws},
        "units": [data[f"gust_{what}"].attrs["units"] for what in ("force", "work")],
        "named": data["suction_force"].attrs["long_name"],
        "file": sorted(set(back.variables()) & {"gust_work", "suction_work"}),
        "json": sorted(run_data(run, [])["ledger_J"]["laws"]),
        "lines": page and ["lost to the seal" in page, "work of the breeze" in page],
        "batch": len(batch.events(0)) and not np.array_equal(batch.events(0), batch.events(1)),
        "alike": bool(np.isclose(batch.events(0)["time"][0], run.events["time"][0], rtol=1e-9)),
        "held": int(held.sum()), "misfit": float(np.abs(pushed + sum(parts)).max() / np.abs(pushed).max()),
        "volts": float(data["volts"].max()),
    }
"""

REST = """
driven = {"kind": "backlash", "gain": "-1 uN/V", "slack": "0.7 V"}
scene = ts.with_values(base, {
    "robot.drives.pzt.law": driven, "robot.drives.pzt.history": (5.0, -1.3), "duration": 0.02,
    "signals.pzt": {"kind": "tooth", "top": "4 V", "half": "3.1 ms"}})
assert parse_scene(scene_text(scene)) == scene
paths = ["robot.drives.pzt.law.slack", "robot.drives.pzt.law.gain", "signals.pzt.top", "signals.pzt.half"]
times = np.array([0.0041, 0.0097, 0.0183])

def position(scene):
    return ts.simulate(scene, scene.duration).states(times).x[-1]

one = ts.simulate(scene, scene.duration, gradients=paths)
slopes = {}
for path in paths:
    value = ts.get_value(scene, path)
    there = [position(ts.with_values(scene, {path: value * (1.0 + k * 1e-3)})) for k in (-2, -1, 1, 2)]
    wanted = np.array([1.0, -8.0, 8.0, -1.0]) @ np.array(there) / (12e-3 * value)
    slopes[path] = [one.state_gradients(times)[path].x[-1].tolist(), wanted.tolist()]
varied = {path: ts.get_value(scene, path) * np.array([0.9, 1.0, 1.05]) for path in paths}
batch = ts.simulate_batch(scene, varied, scene.duration, track=False)
same = []
for k in range(3):
    own = ts.with_values(scene, {path: float(column[k]) for path, column in varied.items()})
    alone = ts.simulate(own, scene.duration).events["time"]
    same.append([len(alone), bool(np.allclose(batch.events(k)["time"], alone, rtol=1e-11, atol=0.0))])
out["drive"] = {"slopes": slopes, "same": same, "period": scene.signals["pzt"].period}
run = ts.simulate(ts.with_values(walker, {"ground.friction": wet, "gait.high": "40 V"}), 0.02)
series = run.at(np.linspace(0.0, 0.02, 4001))
row = run.scene.robot.structure.row
speed = np.abs([row(f"{foot.point}_x") @ series.state.v for foot in run.scene.robot.feet.values()])
slides = series.slipping & (series.contact > 0.0)
most = 0.3 * (series.contact + series.strength)[slides] / (1.0 + speed[slides] / 1e-3) + 2e-6 * speed[slides]
batch = ts.simulate_batch(run.scene, {"ground.friction.dry": [0.3, 0.1]}, 0.02, track=False)
out["friction"] = {
    "slides": int(slides.sum()), "lost": run.ledger.friction, "closure": run.ledger.closure,
    "misfit": float(np.abs(np.abs(series.friction[slides]) / most - 1.0).max()),
    "batch": not np.array_equal(batch.events(0), batch.events(1)),
    "alike": bool(np.isclose(batch.events(0)["time"][-1], run.events["time"][-1], rtol=1e-7)),
}
"""


def found_by(folder: Path, script: str) -> dict:
    """What a script prints beside the law, the waveform and the drive of one file each."""
    for at, files in (("laws", LAWS), ("waves", {"tooth": WAVE}), ("drives", {"backlash": BACKLASH})):
        (folder / at).mkdir()
        for name, text in files.items():
            (folder / at / f"{name}.py").write_text(text)
    scene = Path(__file__).parent.parent / "scenes" / "sticky_feet.toml"
    script = f"{script}\nprint(json.dumps(out))\n"
    return run_beside(folder, script.replace("sys.argv[2]", repr(str(scene))))


@pytest.fixture(scope="module")
def modal(tmp_path_factory) -> dict:
    """The smaller system alone, in the lane of every day."""
    return found_by(tmp_path_factory.mktemp("modal"), SYSTEMS.replace("NAMES", "['modal']"))


@pytest.fixture(scope="module")
def rest(tmp_path_factory) -> dict:
    return found_by(tmp_path_factory.mktemp("rest"), SYSTEMS.replace("NAMES", "['legged']") + REST)


BOTH = pytest.mark.parametrize("system", ["modal", pytest.param("legged", marks=pytest.mark.slow)])


@pytest.fixture
def found(request, system) -> dict:
    return request.getfixturevalue("modal" if system == "modal" else "rest")


@BOTH
def test_a_law_of_one_file_acts_and_is_accounted_for(found, system):
    out = found[system]
    assert out["ok"] and out["closure"] < 1e-8
    assert {"suction", "gust"} <= set(out["laws"]) and out["laws"]["suction"] < 0.0 and out["laws"]["gust"] != 0.0
    assert out["stored"] == out["laws"] and out["json"] == sorted(out["laws"])
    assert out["forces"]["gust"] == pytest.approx(3e-8) and out["forces"]["suction"] > 0.0
    for law, work in out["works"].items():
        assert work == pytest.approx(out["laws"][law], rel=1e-9)
    assert out["units"] == ["N", "J"] and out["named"].startswith("force of the seal")
    assert out["file"] == ["gust_work", "suction_work"]


@BOTH
def test_its_parameters_vary_in_a_batch(found, system):
    assert found[system]["batch"] and found[system]["alike"]


@BOTH
def test_the_ground_bears_every_smooth_law_on_a_held_foot(found, system):
    assert found[system]["held"] > 0 and found[system]["misfit"] < 1e-9


@pytest.mark.slow
def test_a_law_of_friction_of_one_file_brakes_by_the_slip_speed(rest):
    out = rest["friction"]
    assert out["slides"] > 20 and out["lost"] > 0.0 and out["closure"] < 1e-8
    assert out["misfit"] < 1e-8
    assert out["alike"] and out["batch"]


@pytest.mark.slow
def test_the_report_has_its_lines(rest):
    assert rest["legged"]["lines"] == [True, True]


def test_a_waveform_of_one_file_drives(modal):
    assert modal["modal"]["volts"] == pytest.approx(4.0, rel=1e-2)


@pytest.mark.slow
def test_a_hysteresis_of_one_file_varies_and_has_derivatives(rest):
    """With a waveform of one file: by the numbers of both, side by side as alone."""
    out = rest["drive"]
    assert out["period"] == pytest.approx(6.2e-3)
    assert all(count > 0 and same for count, same in out["same"])
    for got, wanted in out["slopes"].values():
        assert any(got) and got == pytest.approx(wanted, rel=1e-5, abs=1e-6 * max(map(abs, wanted)))


def test_two_laws_of_one_name_are_refused():
    class Film(ts.SmoothLaw):
        pull: float = ts.quantity("N", "force")

        @staticmethod
        def force(gap, gap_rate, volts, time, pull):
            return -pull

    built_in = ts.Film(coefficient=1e-21, thickness=1e-6)
    with pytest.raises(ts.InputError, match="the name 'film' is taken"):
        ts.with_values(ts.load_scene("cantilever"), {"ground.film": built_in, "ground.laws.film": Film(pull=1e-9)})
    alone = {"ground.film": None, "ground.laws.film": Film(pull=0.0)}
    run = ts.simulate(ts.with_values(ts.load_scene("cantilever"), alone), 0.001)
    assert run.ledger.laws["film"] == 0.0 and registry.built_in()["film"] is ts.Film
