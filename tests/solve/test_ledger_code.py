"""A run whose energy account is open does not end in a plain "done"."""

from __future__ import annotations

import dataclasses
import math

import pytest

import tarsus as ts
from scene_files import one_mode, pushed
from tarsus.cli import main
from tarsus.files.toml import write_scene
from tarsus.model.scene import Scene
from tarsus.solve.codes import CLOSED, ResultCode
from tarsus.study.workunit import OUTCOMES
from walking_scenes import block


def swung(level: float = 1e-3) -> Scene:
    """One mode under a force that swings: nothing happens without volts."""
    return pushed(one_mode(1e4, 0.1, 1e-6), "A", 3.3e-4, {"kind": "sine", "amplitude": level, "frequency": 3e3})


@pytest.fixture
def strict(monkeypatch: pytest.MonkeyPatch) -> None:
    """Rounding counts as open."""
    monkeypatch.setattr("tarsus.solve.run.CLOSED", 0.0)


def test_an_open_account_is_no_done(strict: None) -> None:
    run = ts.simulate(swung())
    assert 0.0 < run.ledger.closure < CLOSED
    assert run.end_time == run.duration
    assert run.code is ResultCode.LEDGER_OPEN and not run.ok
    assert "energy account is open" in str(run.code)
    assert ts.simulate(swung(0.0)).ok


@pytest.mark.parametrize("scene", [swung(), block()], ids=["modes", "walker"])
def test_an_account_that_is_no_number_is_open(scene: Scene) -> None:
    run = ts.simulate(scene, duration=1e-4)
    run.__dict__["ledger"] = dataclasses.replace(run.ledger, closure=math.nan)
    assert run.code is ResultCode.LEDGER_OPEN


def test_batches_report_it_where_they_are_asked_to(strict: None) -> None:
    vary = {"signals.d.amplitude": [0.0, 1e-3]}
    plain = ts.simulate_batch(swung(), vary)
    kept = ts.simulate_batch(swung(), vary, ledger=True)
    assert plain.codes == [ResultCode.DONE, ResultCode.DONE]
    assert kept.codes == [ResultCode.DONE, ResultCode.LEDGER_OPEN]
    assert kept.run(0).ok and not kept.run(1).ok
    assert "LEDGER_OPEN" in OUTCOMES


def test_the_command_line_says_it_and_exits_with_1(strict: None, tmp_path, capsys) -> None:
    file = tmp_path / "pushed.toml"
    write_scene(swung(), file)
    assert main(["simulate", str(file)]) == 1
    out, err = capsys.readouterr()
    assert ResultCode.LEDGER_OPEN.value in out and ResultCode.LEDGER_OPEN.value in err


def test_a_structure_without_feet_has_its_account_on_any_ground() -> None:
    """The film has no foot to act on; what feet do for the account is asked of none."""
    scene = swung()
    ground = scene.ground.model_copy(update={"film": ts.Film(coefficient=1e-9, thickness=1e-3)})
    run = ts.simulate(scene.model_copy(update={"ground": ground}))
    assert run.ok and run.ledger.closure < CLOSED
    assert run.ledger.work_in == pytest.approx(ts.simulate(scene).ledger.work_in, rel=1e-12)
