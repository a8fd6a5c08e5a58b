"""Runs and batches: what they return and cost, codes of open accounts, and the versions that results depend on."""

from __future__ import annotations

import dataclasses
import math
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import tarsus
import tarsus as ts
from example_laws import OWN
from scene_files import one_mode, pushed
from tarsus.cli import main
from tarsus.files.toml import write_scene
from tarsus.files.version import SHOWING, result_sources
from tarsus.model.scene import Scene
from tarsus.solve import Accuracy
from tarsus.solve.codes import CLOSED, ResultCode
from tarsus.study.workunit import OUTCOMES
from walking_scenes import block

SCENES = Path(__file__).parent.parent / "scenes"


@pytest.fixture(scope="module")
def scene() -> ts.Scene:
    base = ts.read_scene(SCENES / "sticky_feet.toml")
    start = ts.Initial(displacement=(2e-6, 0.0, 0.0), velocity=(0.0, 1e-3, 0.0))
    ground = base.ground.model_copy(update={"laws": {"drag": OWN["drag"](coefficient=1e-5, height=1.0)}})
    return base.model_copy(update={"initial": start, "ground": ground, "duration": 0.02})


@pytest.fixture(scope="module")
def run(scene: ts.Scene) -> ts.Run:
    return ts.simulate(scene)


def test_at_gives_the_states_between_the_events(run):
    """The rate is the derivative of the gap, forces balance the motion, and any choice of times agrees."""
    times = np.linspace(0.0, run.end_time, 401)
    series = run.at(times)
    again = run.at(times[::7])
    for name, tolerance in (("x", 1e-13), ("v", 1e-11), ("pull", 1e-9)):
        one, other = getattr(series.state, name)[:, ::7], getattr(again.state, name)
        np.testing.assert_allclose(other, one, rtol=0, atol=tolerance * np.abs(one).max())
    system, h = run.plan.system, 2e-7
    corners = np.concatenate([run.plan.channels[0].start + period for period in (0.0, 1.0 / 90.0)])
    jumps = np.concatenate([run.all_events["time"], corners])
    quiet = np.array([t for t in times[1:-1] if np.abs(jumps - t).min() > 10 * h])
    middle, before, after = run.at(quiet), run.at(quiet - h), run.at(quiet + h)
    slope = (after.state.x - before.state.x) / (2 * h)
    np.testing.assert_allclose(middle.state.v, slope, rtol=0, atol=1e-6 * np.abs(slope).max())
    acceleration = (after.state.v - before.state.v) / (2 * h)
    foot = np.where(middle.state.held, -middle.state.pull, sum(middle.laws.values()))
    force = system.loads @ middle.force + system.constant[:, None] + system.normals @ foot
    force -= system.damping @ middle.state.v + system.stiffness @ middle.state.x
    smooth = np.abs(acceleration).max(axis=0) < 1e3
    assert smooth.sum() > 300
    scale = np.abs(system.mass @ acceleration).max()
    np.testing.assert_allclose(force, system.mass @ acceleration, rtol=0, atol=1e-5 * scale)


def test_dataset_has_dimensions_units_and_names(run):
    data = run.to_dataset(np.linspace(0.0, run.end_time, 11))
    assert dict(data.sizes) == {"time": 11, "foot": 2, "drive": 1, "point": 2}
    assert data["foot"].values.tolist() == ["left", "right"] and data["drive"].values.tolist() == ["pzt"]
    of_unit = {
        "s": "time",
        "V": "volts",
        "C": "charge",
        "A": "current",
        "m": "displacement gap",
        "m/s": "velocity gap_rate",
        "1": "contact",
        "N": "drive_force pull adhesion_strength film_force electrostatic_force drag_force contact_force",
        "J": "kinetic_energy elastic_energy work_in damping_loss film_work electrostatic_work drag_work impact_loss"
        " adhesion_loss",
    }
    units = {name: unit for unit, names in of_unit.items() for name in names.split()}
    assert {name: data[name].attrs["units"] for name in units} == units
    assert all(data[name].attrs["long_name"] for name in units)
    assert set(data.data_vars) == set(units) - {"time"}
    assert data["gap"].dims == ("foot", "time") and data["displacement"].dims == ("point", "time")
    assert data.attrs["title"] == "two sticky feet" and data.attrs["duration_s"] == 0.02


def test_a_step_bound_ends_the_run_and_its_ledger_holds_at_every_step(scene):
    """Also where the last thing that happened is an event: a bounce, a capture, a release."""
    for steps in (1, 28, 58):
        run = ts.simulate(scene, accuracy=Accuracy(gap=1e-10, steps=steps))
        assert run.code is ResultCode.STEP_LIMIT and run.end_time < run.duration
        assert run.ledger.closure < 1e-8, steps


def swung() -> Scene:
    """One mode under a force that swings: nothing happens without volts."""
    return pushed(one_mode(1e4, 0.1, 1e-6), "A", 3.3e-4, {"kind": "sine", "amplitude": 1e-3, "frequency": 3e3})


def test_an_open_account_is_no_done(monkeypatch: pytest.MonkeyPatch, tmp_path, capsys) -> None:
    """Rounding counts as open: of a run, of a batch that is asked for its accounts, and by the command."""
    monkeypatch.setattr("tarsus.solve.run.CLOSED", 0.0)
    run = ts.simulate(swung())
    assert 0.0 < run.ledger.closure < CLOSED
    assert run.end_time == run.duration
    assert run.code is ResultCode.LEDGER_OPEN and not run.ok
    assert "energy account is open" in str(run.code) and "LEDGER_OPEN" in OUTCOMES
    vary = {"signals.d.amplitude": [0.0, 1e-3]}
    kept = ts.simulate_batch(swung(), vary, ledger=True)
    assert ts.simulate_batch(swung(), vary).codes == [ResultCode.DONE, ResultCode.DONE]
    assert kept.codes == [ResultCode.DONE, ResultCode.LEDGER_OPEN]
    assert kept.run(0).ok and not kept.run(1).ok
    write_scene(swung(), tmp_path / "pushed.toml")
    assert main(["simulate", str(tmp_path / "pushed.toml")]) == 1
    out, err = capsys.readouterr()
    assert ResultCode.LEDGER_OPEN.value in out and ResultCode.LEDGER_OPEN.value in err


@pytest.mark.parametrize("scene", [swung(), block()], ids=["modes", "walker"])
def test_an_account_that_is_no_number_is_open(scene: Scene) -> None:
    run = ts.simulate(scene, duration=1e-4)
    run.__dict__["ledger"] = dataclasses.replace(run.ledger, closure=math.nan)
    assert run.code is ResultCode.LEDGER_OPEN


def test_a_structure_without_feet_has_its_account_on_any_ground() -> None:
    """The film has no foot to act on; what feet do for the account is asked of none."""
    scene = swung()
    ground = scene.ground.model_copy(update={"film": ts.Film(coefficient=1e-9, thickness=1e-3)})
    run = ts.simulate(scene.model_copy(update={"ground": ground}))
    assert run.ok and run.ledger.closure < CLOSED
    assert run.ledger.work_in == pytest.approx(ts.simulate(scene).ledger.work_in, rel=1e-12)


ROOT = Path(tarsus.__file__).parent


def test_every_source_that_a_run_and_its_measures_load_is_in_the_hash() -> None:
    """Of a process that simulates, sweeps, calibrates and designs: what it has loaded but rooms that show results."""
    code = (
        "import sys, tarsus as ts, tarsus.study, tarsus.calibrate, tarsus.design, tarsus.identify\n"
        "ts.simulate('cantilever', '1 ms').measures; ts.simulate('millipede', '1 ms').measures\n"
        "own = [m.__file__ for n, m in list(sys.modules.items()) if n.split('.')[0] == 'tarsus']\n"
        "print(*filter(None, own), sep='\\n')"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    loaded = {Path(line).relative_to(ROOT) for line in done.stdout.splitlines()}
    assert Path("model/drive/laws/prandtl_ishlinskii.py") in loaded and Path("solve/engine.py") in loaded
    needed = {path for path in loaded if path.parts[0] not in SHOWING}
    assert needed <= {path.relative_to(ROOT) for path in result_sources()}
