"""What MATLAB is given: state spaces that are the scene's, and a script that makes the run again in GNU Octave."""

from __future__ import annotations

import re
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
from scipy.io import loadmat

import tarsus as ts
from tarsus.export.matlab import laws_text, state_spaces
from tarsus.export.subject import Subject

HOSTILE = "a'; error('pwned') %{ \n \" \\ é */"


class Bent(ts.SmoothLaw):
    """A law with every kind of operation that is no plain arithmetic."""

    strength: float = ts.quantity("N", "size", default=1e-7)

    @staticmethod
    def force(gap, gap_rate, volts, time, strength):
        whole = round(3.5 * volts) + int(2.7 * volts) + volts // 2.0 + volts % 3.0
        if gap > 1e-5 or gap_rate < 0.0:
            whole = whole + min(abs(gap_rate), 2.0) ** 1.7
        return strength * whole


def octave(folder: Path, text: str) -> str:
    program = shutil.which("octave-cli") or shutil.which("octave")
    assert program, "this lane needs GNU Octave on the path (Debian: octave)"
    done = subprocess.run([program, "--norc", "--eval", text], cwd=folder, capture_output=True, text=True, timeout=900)
    return done.stdout + done.stderr


@pytest.mark.parametrize("name", ["cantilever", "millipede"])
def test_state_spaces_are_the_motion(name):
    """Rates of the state by A and B, with the forces of drives and feet, are those of the run."""
    run = ts.simulate(name, "30 ms")
    described = Subject(run.scene, run)
    spaces, n = state_spaces(described), len(run.plan.system.mass)
    events = np.concatenate([[0.0], run.events["time"]])
    wide = np.argsort(np.diff(events))[-6:]
    for time in 0.5 * (events[wide] + events[wide + 1]):
        around = run.at(time + np.array([-1e-7, 0.0, 1e-7]))
        seen = around.state
        still = np.zeros(len(described.feet)) if seen.contact is None else (seen.held & (seen.contact == 1))[:, 1]
        (k,) = [
            k
            for k in range(len(spaces["A"]))
            if np.array_equal(spaces["held"][k] > 0, seen.held[:, 1]) and np.array_equal(spaces["along"][k] > 0, still)
        ]
        if seen.held[:, 1].sum() > still.sum() and name == "millipede":
            continue  # friction of feet that slide is a force beside those along normals
        feet = np.where(seen.held[:, 1], 0.0, seen.resistive[:, 1] + seen.smooth[:, 1])
        u = np.concatenate([feet, described.forces(np.array([time]))[:, 0], [1.0]])
        state = np.concatenate([seen.x[:, 1], seen.v[:, 1]])
        found = spaces["A"][k] @ state + spaces["B"][k] @ u
        rate = (seen.v[:, 2] - seen.v[:, 0]) / 2e-7
        assert found[n:] == pytest.approx(rate, rel=1e-3, abs=1e-3 * np.abs(rate).max())
        out = spaces["C"][k] @ state + spaces["D"][k] @ u
        m = len(described.feet)
        free = ~seen.held[:, 1]
        assert out[:m][free] == pytest.approx(seen.gap[:, 1][free], rel=1e-9)
        assert out[m : 2 * m][free] == pytest.approx(seen.rate[:, 1][free], rel=1e-9, abs=1e-15)
        assert out[2 * m :][~free] == pytest.approx(seen.pull[:, 1][~free], rel=1e-6)


def test_files_hold_what_names_say(tmp_path):
    scene = ts.load_scene("cantilever").model_copy(update={"name": HOSTILE})
    found = ts.export(scene, "matlab", tmp_path, duration=0.03)
    model = loadmat(tmp_path / "model.mat", simplify_cells=True)
    assert model["name"] == HOSTILE and model["runs"] == 1 and found.to_dict()["lost"] == []
    assert "pwned" not in (tmp_path / "laws.m").read_text()
    assert model["events"].shape == (len((tmp_path / "events.csv").read_text().splitlines()) - 1, 3)
    assert loadmat(tmp_path / "series.mat", simplify_cells=True)["units"]["gap"] == "m"


def test_what_the_script_cannot_is_said(tmp_path):
    lost = ts.export("millipede", "matlab", tmp_path, duration=0.005).to_dict()["lost"]
    assert lost == ["run_model.m does not run this robot: its feet rub on the ground, and the script knows no friction"]
    assert loadmat(tmp_path / "model.mat", simplify_cells=True)["runs"] == 0


@pytest.mark.octave
@pytest.mark.parametrize(
    ("name", "duration"), [("cantilever", "4 ms"), ("ball-on-table", "18 ms"), ("mems-switch", "0.1 ms")]
)
def test_octave_makes_the_run_again(name, duration, tmp_path):
    ts.export(name, "matlab", tmp_path, duration=duration)
    said = octave(tmp_path, "run_model();")
    here, there, same, off = re.findall(r"(\d+) events here, (\d+) in events.csv; the first (\d+) .* to (\S+) s", said)[
        0
    ]
    assert here == there == same and int(same) >= 1, said
    assert float(off) < 1e-9 * 1e3 * ts.simulate(name, duration).end_time


@pytest.mark.octave
def test_octave_computes_laws_as_the_engine_does(tmp_path):
    (tmp_path / "laws.m").write_text(laws_text({"bent": Bent()}))
    points = [(2e-5, -0.3, 7.3, 0.0), (0.0, 0.5, -2.5, 0.0), (1e-6, -3.0, 1.0, 0.0)]
    calls = " ".join(f"printf('%.17g\\n', l.force({', '.join(map(repr, point))}));" for point in points)
    found = [float(line) for line in octave(tmp_path, f"l = laws(); {calls}").split()[:3]]
    assert found == pytest.approx([Bent().evaluate(*point) for point in points], rel=1e-14)
