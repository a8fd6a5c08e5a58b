"""A co-simulation unit of FMI 3.0: valid, and a session's robot to the last bit."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest

import tarsus as ts
from scene_files import SCENES
from tarsus.cli import main
from tarsus.export.verb import TARGETS
from tarsus.files.toml import parse_scene, scene_text

STEPS, DT = 24, 1e-3
HOSTILE = "a\" <b> & ' \n]]> --> é \u202e \x00"

PUMP = """
import tarsus as ts

class Pump(ts.SmoothLaw):
    coefficient: float = ts.quantity("N s/m", "push", ge=0)

    @staticmethod
    def force(gap, gap_rate, volts, time, coefficient):
        return coefficient * gap_rate
"""


def unit_of(scene: ts.Scene | str, folder: Path) -> Path:
    """The unit, which its validator finds nothing wrong with."""
    from fmpy.validation import validate_fmu

    ts.export(scene, "fmu", folder, duration=STEPS * DT)
    unit = folder / "robot.fmu"
    assert validate_fmu(str(unit)) == []
    return unit


class Loaded:
    """A unit that is loaded for the length of a block, its variables by name."""

    def __init__(self, unit: Path, folder: Path) -> None:
        from fmpy import extract, read_model_description
        from fmpy.fmi3 import FMU3Slave

        told = read_model_description(str(unit))
        self.numbers = {one.name: one.valueReference for one in told.modelVariables}
        self.slave = FMU3Slave(
            guid=told.instantiationToken,
            unzipDirectory=extract(str(unit), str(folder)),
            modelIdentifier=told.coSimulation.modelIdentifier,
            instanceName="robot",
        )
        self.slave.instantiate(loggingOn=True)
        self.slave.enterInitializationMode(startTime=0.0)
        self.slave.exitInitializationMode()

    def __enter__(self) -> Loaded:
        return self

    def __exit__(self, *said: object) -> None:
        self.slave.terminate()
        self.slave.freeInstance()

    def tell(self, name: str, value: float) -> None:
        self.slave.setFloat64([self.numbers[name]], [value])

    def seen(self, name: str) -> float:
        return self.slave.getFloat64([self.numbers[name]])[0]

    def step(self, time: float, dt: float = DT) -> bool:
        """Whether the unit asks to terminate."""
        return self.slave.doStep(currentCommunicationPoint=time, communicationStepSize=dt)[1]


@pytest.mark.fmu
@pytest.mark.parametrize(
    ("name", "values"),
    [("cantilever", {"robot.feet.tip.gap": 6e-5}), ("hexapod-walker", {"ground.friction.coefficient": 0.3})],
)
def test_steps_through_fmpy_are_those_of_a_session_and_of_a_run(name, values, tmp_path):
    """Volts that change at every step: the session's outputs to the last bit, and the run's in one piece to 1e-9."""
    from fmpy import simulate_fmu

    scene, rng = ts.load_scene(name), np.random.default_rng(3)
    drives = list(scene.robot.drives)
    least = -10.0 if len(drives) == 1 else 0.0
    levels = rng.uniform(least, 10.0, (STEPS, len(drives)))
    rows = [((k + j) * DT, *levels[k]) for k in range(STEPS) for j in (0, 1)]  # two rows of one time are a jump
    told = np.array(rows, dtype=[("time", float), *((f"volts.{drive}", float) for drive in drives)])
    found = simulate_fmu(
        str(unit_of(scene, tmp_path)),
        stop_time=STEPS * DT,
        output_interval=DT,
        start_values=values,
        apply_default_start_values=True,
        input=told,
    )
    sim = ts.Session(scene, vary=values)
    states = [sim.reset()]
    for k, dt in enumerate(np.diff(found["time"]).tolist()):
        states.append(sim.step(dict(zip(drives, levels[k].tolist(), strict=True)), dt))
    structure, feet = scene.robot.structure, list(scene.robot.feet)
    assert len(found) == STEPS + 1 and {"code", *(f"gap.{foot}" for foot in feet)} <= set(found.dtype.names)
    for i, foot in enumerate(feet):
        assert found[f"gap.{foot}"].tolist() == [float(one.gaps[i]) for one in states]
        assert found[f"contact.{foot}"].tolist() == [bool(one.contacts[i] > 0) for one in states]
        assert found[f"slip.{foot}"].tolist() == [bool(one.contacts[i] == 2) for one in states]
    for coordinate in structure.body_coordinates:
        assert found[f"body.{coordinate}"].tolist() == [float(one.body[coordinate]) for one in states]
    assert set(found["code"]) == {0} and sum(len(one.events) for one in states) > 8
    waves = {
        f"signals.{drive}": {"kind": "on_off", "levels": own.tolist(), "durations": [DT] * STEPS}
        for drive, own in zip(drives, levels.T, strict=True)
    }
    x = ts.simulate(ts.with_values(scene, {**values, **waves}), STEPS * DT).states(found["time"][1:]).x
    for point in structure.points:
        told_x = found[f"displacement.{point}"][1:]
        assert told_x.tolist() == [float(one.displacement(point)) for one in states[1:]]
        assert np.abs(told_x - structure.row(point) @ x).max() < 1e-9 * np.abs(x).max()


@pytest.mark.fmu
def test_a_unit_rolls_back_and_knows_nothing_of_another(tmp_path):
    unit = unit_of("millipede", tmp_path)
    ways = []
    with Loaded(unit, tmp_path / "one") as one, Loaded(unit, tmp_path / "other") as other:
        one.tell("volts.L1", 3.0)
        one.step(0.0)
        kept = one.slave.getFMUState()
        for _ in range(2):
            one.tell("volts.R1", 9.0)
            one.step(DT)
            ways.append((one.seen("time"), one.seen("volts.R1"), one.seen("body.surge")))
            one.slave.setFMUState(kept)
            assert one.seen("time") == DT and one.seen("volts.R1") == 0.0
        one.slave.freeFMUState(kept)
        assert other.seen("time") == 0.0 and other.seen("volts.L1") == 14.0
    assert ways[0] == ways[1] and ways[0][0] == 2 * DT and ways[0][2] != 0.0


@pytest.mark.fmu
def test_what_is_refused_moves_nothing(tmp_path):
    from fmpy.fmi1 import FMICallException
    from fmpy.fmi3 import fmi3Discard

    with Loaded(unit_of("cantilever", tmp_path), tmp_path / "one") as one:
        one.step(0.0)
        before = one.seen("displacement.tip")
        one.tell("volts.pzt", np.inf)
        with pytest.raises(FMICallException) as said:
            one.step(DT)
        assert said.value.status == fmi3Discard
        assert one.seen("displacement.tip") == before and one.seen("time") == DT
        one.tell("volts.pzt", 1.0)
        assert not one.step(DT) and one.seen("time") == 2 * DT


@pytest.mark.fmu
def test_a_robot_that_stops_asks_to_terminate(tmp_path):
    """A law that feeds on speed, without bound."""
    (tmp_path / "own.py").write_text(PUMP, encoding="utf-8")
    pump = ts.load_laws(tmp_path / "own.py")["pump"]
    scene = ts.with_values(ts.load_scene("cantilever"), {"ground.laws": {"pump": pump(coefficient=1.0)}})
    sim = ts.Session(scene)
    sim.reset()
    stopped = sim.step(dt=DT)
    with Loaded(unit_of(scene, tmp_path / "out"), tmp_path / "one") as one:
        assert one.step(0.0) and not stopped.ok
        assert one.seen("time") == stopped.time < DT
        assert one.slave.getInt32([one.numbers["code"]]) == [stopped.code.number] != [0]


@pytest.mark.fmu
def test_names_break_nothing_and_laws_come_along(tmp_path):
    """Names of scenes, drives and feet; and laws of a user's file that is no longer there."""
    from fmpy import read_model_description, simulate_fmu

    shutil.copy(SCENES / "squeeze.py", tmp_path / "own.py")
    laws = ts.load_laws(tmp_path / "own.py")
    text = scene_text(ts.load_scene("cantilever"))
    renamed = (
        text.replace("feet.tip", "feet.3-tip").replace("drives.pzt", "drives.p-z").replace("signals.pzt", "signals.p-z")
    )
    scene = ts.with_values(parse_scene(renamed), {"ground.laws": {"drag": laws["drag"](coefficient=1e-4, height=1e-6)}})
    scene = scene.model_copy(update={"name": HOSTILE})
    unit = unit_of(scene, tmp_path / "out")
    (tmp_path / "own.py").unlink()
    told = read_model_description(str(unit))
    assert told.description == HOSTILE.encode("unicode_escape").decode()
    names = {one.name for one in told.modelVariables}
    assert {"ground.laws.drag.coefficient", "gap.'3-tip'", "robot.feet.'3-tip'.gap", "volts.'p-z'"} < names
    assert simulate_fmu(str(unit), stop_time=2 * DT, output_interval=DT)["time"].tolist() == [0.0, DT, 2 * DT]


@pytest.mark.fmu
def test_the_command_writes_what_it_proposes(tmp_path):
    from fmpy import read_model_description

    folder = tmp_path / "out"
    said = ["--to", "fmu", "--duration", "3 ms", "--step", "0.5 ms", "-o", str(folder)]
    assert main(["export", "ball-on-table", *said]) == 0
    proposed = read_model_description(str(folder / "robot.fmu")).defaultExperiment
    assert (float(proposed.startTime), float(proposed.stopTime), float(proposed.stepSize)) == (0.0, 3e-3, 5e-4)
    listed = [f"- {one}" for one in ts.export("ball-on-table", "fmu", tmp_path, duration=1e-3).to_dict()["lost"]]
    assert (folder / "lost.txt").read_text(encoding="utf-8").splitlines() == listed and len(listed) == 2


def test_without_pythonfmu3_it_is_refused(tmp_path, monkeypatch):
    monkeypatch.setattr("tarsus.export.fmu.find_spec", lambda name: None)
    with pytest.raises(ts.InputError, match="pip install pythonfmu3"):
        ts.export("cantilever", "fmu", tmp_path, duration=1e-3)
    assert list(tmp_path.iterdir()) == [] and "robot.fmu" in TARGETS["fmu"].files
