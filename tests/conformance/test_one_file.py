"""A law of the ground or of a drive, or a waveform, is one file: put beside those of the library it acts everywhere."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

import tarsus as ts
from scene_files import SCENES
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


BESIDE = """
import importlib.util, pathlib, sys
import numpy as np
import tarsus

folder, home = pathlib.Path(sys.argv[1]), pathlib.Path(tarsus.__file__).parent

class Beside:
    def find_spec(self, name, path=None, target=None):
        for package, at in (("tarsus.model.laws", "laws"), ("tarsus.model.drive.waveforms", "waves"),
                            ("tarsus.model.drive.laws", "drives")):
            if name == package:
                inside = home.joinpath(*package.split(".")[1:])
                return importlib.util.spec_from_file_location(name, inside / "__init__.py",
                    submodule_search_locations=[str(inside), str(folder / at)])

sys.meta_path.insert(0, Beside())
import tarsus as ts
from tarsus.files.toml import parse_scene, scene_text
base = ts.read_scene(sys.argv[2])
"""

SYSTEM = """
from tarsus.inspection.runs import run_data
from tarsus.model.laws.registry import built_in

suction, wind = built_in()["suction"], built_in()["wind"]
wave = {"kind": "tooth", "top": "4 V", "half": "5 ms"}
laws = {"ground.suction": suction(drag=2e-5, height=5e-6), "ground.laws.gust": wind(lift=-3e-8)}
scene = ts.with_values(base, laws | {"signals.pzt": wave, "duration": 0.02})
assert parse_scene(scene_text(scene)) == scene
run = ts.simulate(scene, scene.duration)
data, back, ledger = run.to_dataset(), ts.load_run(run.write(folder / "run")), dict(run.ledger.laws)
assert run.ok and run.ledger.closure < 1e-8
assert {"suction", "gust"} <= set(ledger) and ledger["suction"] < 0.0 and ledger["gust"] != 0.0
assert dict(back.ledger.laws) == ledger and sorted(run_data(run, [])["ledger_J"]["laws"]) == sorted(ledger)
assert {"gust_work", "suction_work"} <= set(back.variables())
most = {law: float(abs(data[f"{law}_force"]).max()) for law in ledger}
assert np.isclose(most["gust"], 3e-8) and most["suction"] > 0.0
for law, work in ledger.items():
    assert np.isclose(data[f"{law}_work"][-1], work, rtol=1e-9)
assert [data[f"gust_{what}"].attrs["units"] for what in ("force", "work")] == ["N", "J"]
assert data["suction_force"].attrs["long_name"].startswith("force of the seal")
assert np.isclose(data["volts"].max(), 4.0, rtol=1e-2), "the waveform drives"

batch = ts.simulate_batch(scene, {"ground.suction.drag": [2e-5, 0.0]}, scene.duration, track=False)
assert len(batch.events(0)) and not np.array_equal(batch.events(0), batch.events(1))
assert np.isclose(batch.events(0)["time"][0], run.events["time"][0], rtol=1e-9)

held = data["contact"].values.astype(bool)
pushed = data["contact_force"].values[held] + data["pull"].values[held]
smooth = sum(data[f"{law}_force"].values[held] for law in ("gust", "electrostatic") if f"{law}_force" in data)
assert held.any() and np.abs(pushed + smooth).max() < 1e-9 * np.abs(pushed).max(), "the ground bears every smooth law"
"""

DRIVE = """
driven = {"kind": "backlash", "gain": "-1 uN/V", "slack": "0.7 V"}
scene = ts.with_values(base, {
    "robot.drives.pzt.law": driven, "robot.drives.pzt.history": (5.0, -1.3), "duration": 0.02,
    "signals.pzt": {"kind": "tooth", "top": "4 V", "half": "3.1 ms"}})
assert parse_scene(scene_text(scene)) == scene and np.isclose(scene.signals["pzt"].period, 6.2e-3)
paths = ["robot.drives.pzt.law.slack", "robot.drives.pzt.law.gain", "signals.pzt.top", "signals.pzt.half"]
times = np.array([0.0041, 0.0097, 0.0183])

def position(scene):
    return ts.simulate(scene, scene.duration).states(times).x[-1]

one = ts.simulate(scene, scene.duration, gradients=paths)
for path in paths:
    value = ts.get_value(scene, path)
    there = [position(ts.with_values(scene, {path: value * (1.0 + k * 1e-3)})) for k in (-2, -1, 1, 2)]
    wanted = np.array([1.0, -8.0, 8.0, -1.0]) @ np.array(there) / (12e-3 * value)
    got = one.state_gradients(times)[path].x[-1]
    assert got.any() and np.allclose(got, wanted, rtol=1e-5, atol=1e-6 * np.abs(wanted).max()), path
varied = {path: ts.get_value(scene, path) * np.array([0.9, 1.0, 1.05]) for path in paths}
batch = ts.simulate_batch(scene, varied, scene.duration, track=False)
for k in range(3):
    own = ts.with_values(scene, {path: float(column[k]) for path, column in varied.items()})
    alone = ts.simulate(own, scene.duration).events["time"]
    assert len(alone) and np.allclose(batch.events(k)["time"], alone, rtol=1e-11, atol=0.0)
"""


# Slow: a dozen runs with a drive's derivatives.
@pytest.mark.parametrize(
    "script", [pytest.param(SYSTEM, id="law and waveform"), pytest.param(DRIVE, id="drive", marks=pytest.mark.slow)]
)
def test_what_lies_in_one_file_acts_everywhere(script: str, tmp_path: Path) -> None:
    """In a process whose library has the files of a folder as well: written, run, stored, varied in batches."""
    for at, files in (("laws", LAWS), ("waves", {"tooth": WAVE}), ("drives", {"backlash": BACKLASH})):
        (tmp_path / at).mkdir()
        for name, text in files.items():
            (tmp_path / at / f"{name}.py").write_text(text)
    words = [sys.executable, "-c", BESIDE + script, str(tmp_path), str(SCENES / "sticky_feet.toml")]
    done = subprocess.run(words, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


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
