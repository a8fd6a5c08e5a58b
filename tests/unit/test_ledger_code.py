"""A run whose energy account is open does not end in a plain "done"."""

from __future__ import annotations

import dataclasses
import math

import pytest

import tarsus as ts
from tarsus.base.spec import validate
from tarsus.cli import main
from tarsus.files.toml import write_scene
from tarsus.model.scene import Scene
from tarsus.solve.codes import CLOSED, ResultCode
from tarsus.study.workunit import OUTCOMES
from walking_scenes import block

ZETA = 1e5


def overdamped(zeta: float) -> Scene:
    """One mode under a constant force for its slow time constant: at zeta 1e5 its states lose more than 1e-8."""
    frequency, mass = 1e4, 1e-6
    structure = {
        "kind": "modal", "frequencies": [frequency], "damping_ratios": [zeta], "modal_masses": [mass],
        "shapes": {"A": [1.0]},
    }  # fmt: skip
    drive = {"load": {"kind": "point", "weights": {"A": 1.0}}, "law": {"kind": "linear", "gain": 1.0}}
    return validate(
        Scene,
        {
            "name": "overdamped",
            "duration": 2.0 * zeta / (2.0 * math.pi * frequency),
            "robot": {"structure": structure, "drives": {"d": drive}, "feet": {}},
            "signals": {"d": {"kind": "constant", "level": 1e-3}},
        },
    )


@pytest.fixture(scope="module")
def open_run() -> ts.Run:
    return ts.simulate(overdamped(ZETA))


def test_an_open_account_is_no_done(open_run: ts.Run) -> None:
    assert open_run.ledger.closure > CLOSED
    assert open_run.end_time == open_run.duration
    assert open_run.code is ResultCode.LEDGER_OPEN and not open_run.ok
    assert "energy account is open" in str(open_run.code)
    assert ts.simulate(overdamped(100.0)).ok


@pytest.mark.parametrize("scene", [overdamped(2.0), block()], ids=["modes", "walker"])
def test_an_account_that_is_no_number_is_open(scene: Scene) -> None:
    run = ts.simulate(scene, duration=1e-4)
    run.__dict__["ledger"] = dataclasses.replace(run.ledger, closure=math.nan)
    assert run.code is ResultCode.LEDGER_OPEN


def test_batches_tell_where_they_are_asked_to() -> None:
    vary = {"robot.structure.damping_ratios.0": [100.0, ZETA]}
    seconds = overdamped(ZETA).duration
    plain = ts.simulate_batch(overdamped(ZETA), vary, seconds)
    told = ts.simulate_batch(overdamped(ZETA), vary, seconds, ledger=True)
    assert plain.codes == [ResultCode.DONE, ResultCode.DONE]
    assert told.codes == [ResultCode.DONE, ResultCode.LEDGER_OPEN]
    assert told.run(0).ok and not told.run(1).ok
    assert "LEDGER_OPEN" in OUTCOMES


def test_a_batch_with_accounts_has_the_events_of_one_without() -> None:
    scene = ts.load_scene("cantilever")
    vary = {"ground.restitution.coefficient": [0.2, 0.5]}
    plain, told = (ts.simulate_batch(scene, vary, 0.03, ledger=ledger) for ledger in (False, True))
    for i in range(2):
        assert told.run(i).ok and len(told.events(i)) > 1
        assert told.events(i)["time"] == pytest.approx(plain.events(i)["time"], rel=1e-6)
    assert told.measure("peak") == pytest.approx(plain.measure("peak"), rel=1e-5)


def test_the_command_line_says_it_and_exits_with_1(tmp_path, capsys) -> None:
    file = tmp_path / "overdamped.toml"
    write_scene(overdamped(ZETA), file)
    assert main(["simulate", str(file)]) == 1
    out, err = capsys.readouterr()
    assert ResultCode.LEDGER_OPEN.value in out and ResultCode.LEDGER_OPEN.value in err
