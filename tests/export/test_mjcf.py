"""What MuJoCo is given: the dynamics of the scene, contacts with its restitution, and a loss that is measured."""

from __future__ import annotations

import cmath
import json
import math
import subprocess
import sys
import xml.etree.ElementTree as Xml

import numpy as np
import pytest

import tarsus as ts
from scene_files import SCENES
from tarsus.base.errors import InputError
from tarsus.cli import main
from tarsus.export.mjcf import Mjcf, Units, damping_ratio, stepped_restitution
from tarsus.export.subject import Subject, evaluate, expanded

HOSTILE = "a\" <b> & ' */ #error\n]]> --> é \u202e"


def model_of(name: str, duration: float = 0.02, **values: object) -> Mjcf:
    return Mjcf(Subject.of(ts.load_scene(name, **values), duration))


def restitution_of(ratio: float) -> float:
    """Of a damped spring that only pushes, in closed form (Schwager and Poeschel 2007)."""
    root = cmath.sqrt(1.0 - ratio * ratio)
    return cmath.exp(1j * ratio / root * cmath.log(2.0 * ratio * ratio - 1.0 + 2j * ratio * root)).real


@pytest.mark.parametrize("ratio", [0.05, 0.3, 0.9, 1.5])
def test_restitution_of_a_spring_that_only_pushes(ratio):
    """Its equation of motion, stepped a thousand times finer than a model is, gives the closed form."""
    assert stepped_restitution(ratio, 5e-4) == pytest.approx(restitution_of(ratio), rel=2e-3)


def test_the_textbook_damping_is_another():
    log = math.log(0.378)
    assert restitution_of(-log / math.hypot(math.pi, log)) == pytest.approx(0.455, abs=1e-3)
    assert stepped_restitution(damping_ratio(0.378, 0.05), 0.05) == pytest.approx(0.378, abs=1e-3)
    assert damping_ratio(0.0, 0.05) == 4.0 and damping_ratio(1.0, 0.05) == 0.0


@pytest.mark.parametrize("name", ["cantilever", "quadruped", SCENES / "three_feet.toml"])
def test_tendons_are_the_structure(name):
    """Inertia, springs and dampers of the tendons, taken together, are the scene's in the joints."""
    model = model_of(str(name), 0.002)
    system, moves, parts = model.subject.plan.system, model.tree.moves, model.tree.parts.values()
    for matrix, one in ((system.mass, "mass"), (system.stiffness, "stiffness"), (system.damping, "damping")):
        if one == "damping" and (told := not np.allclose(matrix, matrix.T, rtol=1e-9, atol=0.0)):
            assert any("damping: what of a matrix that is not symmetric" in said for said in model.lost) == told
            continue
        found = sum(getattr(part, one) * np.outer(part.row, part.row) for part in parts)
        wanted = moves.T @ matrix @ moves
        assert found == pytest.approx(wanted, abs=1e-9 * np.abs(wanted).max())
    if name == SCENES / "three_feet.toml":  # heights of feet are sums of the joints above them
        assert system.normals.T @ moves == pytest.approx(np.tril(np.ones((3, 4))), abs=1e-9)
    push = sum(part.force * part.row for part in parts)
    assert push == pytest.approx(moves.T @ system.constant, abs=1e-9 * np.abs(system.constant).max() + 1e-30)


def test_a_foot_below_a_ceiling_meets_it_by_its_gap_with_the_damping_of_its_restitution():
    model = model_of("cantilever", 0.002, **{"robot.feet.tip.normal": -1})
    root, units = Xml.fromstring(model.text()), model.units
    ground, foot = (
        root.find(f".//{kind}[@name='{name}']") for kind, name in (("geom", "ground:tip"), ("geom", "foot:tip"))
    )
    radius = float(foot.get("size"))
    heights = [float(one.get("pos").split()[2]) for one in (ground, foot)]
    assert (heights[0] - heights[1] - radius) * units.length == pytest.approx(70e-6)
    spring, damper = (-float(one) for one in root.find(".//pair").get("solref").split())
    ratio = damping_ratio(model.restitution, model.step * model.contact_rate)
    assert damper / (2.0 * math.sqrt(spring)) == pytest.approx(ratio)
    assert Units(2.0, 3.0, 5.0).force == pytest.approx(6.0 / 25.0)


def test_names_do_not_break_the_file():
    scene = ts.load_scene("cantilever").model_copy(update={"name": HOSTILE})
    root = Xml.fromstring(Mjcf(Subject.of(scene, 0.01)).text())
    assert root.get("model") == HOSTILE.replace("\n", " ") or root.get("model") == HOSTILE
    assert [one.tag for one in root][:3] == ["option", "compiler", "worldbody"]


@pytest.mark.parametrize(
    "signal", [ts.Sine(amplitude=8.0, frequency=50.0), ts.Sampled(times=(0.0, 0.01), levels=(0.0, 6.0))]
)
def test_a_channel_that_is_written_out_is_the_channel(signal):
    """What repeats, up to within a period, and what is held at its end."""
    scene = ts.load_scene("cantilever", **{"signals.pzt": signal})
    (channel, *_) = Subject.of(scene, 0.002).plan.channels
    times = np.linspace(0.0, 0.0998, 500)
    assert evaluate(expanded(channel, 0.0999), times) == pytest.approx(evaluate(channel, times), rel=1e-9, abs=1e-18)


def test_drives_are_straight_lines_between_rows():
    described = Subject.of(ts.load_scene("cantilever"), 0.05)
    times, values = described.drive_table(0.05)
    assert times[0] == 0.0 and times[-1] == 0.05 and np.all(np.diff(times) >= 0.0)
    between = np.linspace(1e-6, 0.05, 2000, endpoint=False)
    found = np.interp(between, times, values[:, 0])
    assert found == pytest.approx(described.forces(between)[0], abs=2e-3 * np.abs(values).max())


def test_what_cannot_be_is_said(tmp_path):
    with pytest.raises(InputError, match="expected one of mjcf, matlab, c, fmu, got 'urdf'"):
        ts.export("cantilever", "urdf", tmp_path)
    with pytest.raises(InputError, match="step: expected a time above 0 s"):
        ts.export("cantilever", "mjcf", tmp_path, step=0.0)


@pytest.mark.mujoco
@pytest.mark.parametrize("name", ["cantilever", "ball-on-table", "quadruped", "hexapod", "millipede", "hamr-like"])
def test_accelerations_are_those_of_the_scene(name):
    import mujoco

    from tarsus.export.mujoco_run import Loaded

    model = model_of(name)
    loaded, system = Loaded(model), model.subject.plan.system
    loaded.model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONTACT)
    rng, data, n = np.random.default_rng(1), mujoco.MjData(loaded.model), len(system.mass)
    x, v = 1e-6 * rng.normal(size=n), 1e-6 * rng.normal(size=n)
    force = 1e-5 * rng.normal(size=len(loaded.drives))
    moves, own, second = model.tree.moves, loaded.own, model.units.time
    data.qpos[:], data.qvel[:] = np.linalg.solve(moves, x) / own, np.linalg.solve(moves, v) / own * second
    data.ctrl[loaded.drives] = force / model.units.force
    mujoco.mj_forward(loaded.model, data)
    found = moves @ (data.qacc * own) / second**2
    push = system.constant + system.loads @ force - system.stiffness @ x - system.damping @ v
    wanted = np.linalg.solve(system.mass, push)
    if name == "hamr-like":  # its hips are below its centre of mass, and MuJoCo's feet go sideways when it rolls
        found, wanted = np.delete(found, 2), np.delete(wanted, 2)
    assert found == pytest.approx(wanted, rel=1e-4, abs=1e-4 * np.abs(wanted).max())


@pytest.mark.mujoco
@pytest.mark.parametrize(("name", "within"), [("cantilever", 0.02), ("ball-on-table", 0.02), ("hexapod", 0.02)])
def test_restitution_is_that_of_the_scene(name, within):
    from tarsus.export.mujoco_run import Loaded, restitution

    model = model_of(name, 0.1)
    mean, worst = restitution(Loaded(model))
    assert mean == pytest.approx(model.restitution, rel=within)
    assert worst == pytest.approx(model.restitution, rel=0.04)


@pytest.mark.mujoco
@pytest.mark.parametrize("name", ["cantilever", "millipede"])
def test_adhesion_holds_what_it_should(name):
    from tarsus.export.mujoco_run import Loaded, pull_off

    model = model_of(name, 0.1)
    assert pull_off(Loaded(model)) == pytest.approx(model.subject.held_strength, rel=0.01)


@pytest.mark.mujoco
def test_first_touchdowns_of_a_quadruped(tmp_path, capsys):
    """It has laws that MuJoCo has: restitution alone. Touchdowns agree to the length of a contact, and the script that
    comes along sees the same ones."""
    assert (
        main(["export", "quadruped", "--to", "mjcf", "--duration", "110 ms", "-o", str(tmp_path / "out"), "--json"])
        == 0
    )
    table = json.loads(capsys.readouterr().out)["measured"]["parts"][0]
    rows = np.array([[row[i] for i in (2, 3, 5, 6, 8, 9)] for row in table["rows"]], dtype=float)
    assert len(rows) == 3
    assert rows[:, 4] == pytest.approx(rows[:, 0], abs=2e-5)
    assert rows[:, 5] == pytest.approx(rows[:, 1], rel=0.01)
    out = subprocess.run(
        [sys.executable, tmp_path / "out" / "run_model.py", "0.05"], capture_output=True, text=True, check=True
    ).stdout
    seen = [float(line.split()[0]) for line in out.splitlines() if line.endswith("foot1")]
    assert min(abs(time - 45.42e-3) for time in seen) < 2e-5
