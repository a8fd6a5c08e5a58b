"""What a synthetic campaign plans: sweeps where the drive follows the voltage, and devices it refuses."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import tarsus as ts
from laboratory import LABORATORY
from tarsus.base.errors import InputError
from tarsus.base.quantities import Quantity
from tarsus.identify.campaign import read_campaign, read_records
from tarsus.model.drive.waveforms import SweptSine
from tarsus.records.purpose import Purpose
from tarsus.solve.outputs import Output
from tarsus.synthesis import devices
from tarsus.synthesis.campaign_folder import write_campaign
from tarsus.synthesis.plan import planned
from tarsus.synthesis.recordings import Instrument, Recording, recorded
from tarsus.synthesis.sweep_level import sweep_level


def test_a_drive_is_swept_where_it_follows_about_0_volts_or_where_it_does() -> None:
    """Plays rest below 1.143 V, and the memory-free part turns near 0 V."""
    assert sweep_level(ts.load_scene(LABORATORY).robot.drives["pzt"]) == (0.2, 0.0)
    drive = ts.load_scene(LABORATORY.with_name("laboratory_cantilever_1.toml")).robot.drives["pzt"]
    level, offset = sweep_level(drive)
    assert offset == 8.0
    assert level <= 0.1

    def gain(volts: float) -> float:
        cycles = drive.law.force(volts + 0.1 * np.array([1.0, -1.0, 1.0, -1.0]), drive.history)
        return abs(float(cycles[3] - cycles[2])) / 0.2

    assert gain(offset) > 30.0 * gain(0.0)


def test_what_differs_between_sets_and_what_moves_slowly_is_recorded() -> None:
    """Four sets of bounces, and the first set of every purpose again after all others, with its own record in the air;
    signals that are kept for validation come last."""
    plan = planned(ts.load_scene("cantilever-capture"), 20e3, "pzt")
    names = [one.name for one in plan if one.purpose is not Purpose.VALIDATION]
    bounces = [one for one in plan if one.purpose is Purpose.BOUNCES]
    assert [one.name for one in plan][: len(names)] == names and len(bounces) == 5
    assert len({one.signal for one in bounces}) == 4
    again = names[-5:]
    assert [one.partition("-")[0] for one in again] == ["sweep", "loops", "ramps", "bounces", "air"]
    for name in again:
        one, first = (next(this for this in plan if this.name == n) for n in (name, name.removesuffix("-again")))
        assert one.signal == first.signal and one.repeats == first.repeats
        assert first is next(this for this in plan if this.purpose is one.purpose)
    assert bounces[-1].air == again[-1]


def test_a_sweep_about_a_voltage_begins_at_rest_there() -> None:
    scene = ts.load_scene(LABORATORY.with_name("laboratory_cantilever_1.toml"))
    wave = SweptSine(amplitude=0.1, start_frequency=200.0, stop_frequency=900.0, duration=0.1, offset=8.0)
    take = Recording("sweep", Purpose.MODAL, wave, 0.1, gap=0.03, before=(8.2,))
    clean = Instrument(snr_db=300.0)
    sudden = Recording("sweep", Purpose.MODAL, wave, 0.1, gap=0.03)
    at_rest, jumped = (next(recorded(scene, one, clean, "pzt", (1,))).values[0] for one in (take, sudden))
    assert abs(at_rest[0]) < 1e-9
    assert np.abs(at_rest[:20]).max() < 0.05 * np.abs(jumped[:20]).max()


def test_devices_that_identification_does_not_know(tmp_path: Path) -> None:
    structure = ts.Lumped(coordinates=("tip",), mass=((1e-6,),), damping=((1e-6,),), stiffness=((1.0,),))
    drive = ts.Drive(load=ts.PointLoad(weights={"tip": 1.0}), law=ts.LinearForce(gain=1e-6))
    robot = ts.Robot(structure=structure, drives={"pzt": drive})
    scene = ts.Scene(name="spring", robot=robot, ground=ts.Ground(), duration=0.01)
    said = r"kind 'lumped', not 'beam', 'modal' or 'walker'; it has 0 feet, not one$"
    with pytest.raises(InputError, match=said):
        write_campaign(scene, tmp_path, Instrument(), 1)
    assert not list(tmp_path.iterdir())
    low = ts.with_values(ts.load_scene(LABORATORY), {"robot.feet.tip.gap": "5 um"})
    with pytest.raises(InputError, match=r"rests clear .*: \d+ of \d+ draws are refused, .* below the ground"):
        devices.perturbed(low, 0.2, 1)


def test_a_walking_campaign_reads_back_as_the_walks_that_were_made(tmp_path: Path) -> None:
    """On a walker whose legs and ground are nobody's, 40 dB, 20 kHz; it keeps these to itself."""
    ts.synthesize("millipede", tmp_path, seed=3, perturb=0.1)
    design, truth = ts.load_scene("millipede"), ts.read_scene(tmp_path / "truth" / "device.toml")
    opened = read_campaign(tmp_path)
    known, leg = opened.model.scene, "robot.structure.legs.L1.stiffness_v"
    assert ts.get_value(known, leg) == ts.get_value(design, leg) != ts.get_value(truth, leg)
    assert abs(ts.get_value(truth, leg) / ts.get_value(design, leg) - 1.0) < 0.1
    for path in devices.identified_paths(design):
        assert not path.startswith("ground.") or ts.get_value(known, path) != ts.get_value(truth, path), path
    assert ts.get_value(truth, "robot.drives.L1.law.gain") == ts.get_value(design, "robot.drives.L1.law.gain")
    sets = opened.campaign.records
    assert set(sets) == {"walk-1", "walk-2", "exercise-L1", "exercise-R1"}
    assert all(one.purpose is Purpose.WALKING and one.bridge for one in sets.values())
    assert [len(sets[name].files) for name in ("walk-1", "walk-2", "exercise-L1")] == [3, 3, 1]
    for name in ("walk-2", "exercise-L1"):
        one = sets[name]
        scene = ts.with_values(truth, {"gait": one.gait, "signals": dict(one.signals)})
        record = read_records(opened, name)[0].record
        assert record is not None and record.rate == pytest.approx(20e3)
        channels = [channel for channel in record.channels if channel.quantity is not Quantity.VOLTAGE]
        outputs = [Output(one.quantity, one.at, motional=one.quantity is Quantity.CURRENT) for one in channels]
        run = ts.simulate(scene, record.count * record.step)
        true = run.outputs(outputs, record.time)
        for channel, row in zip(channels, true, strict=True):
            off = record[channel.name] - row
            level = 0.01 * np.sqrt(np.mean((row - row[0] * (channel.quantity is Quantity.DISPLACEMENT)) ** 2))
            assert np.std(off) == pytest.approx(level, rel=0.1), channel.name
            assert abs(np.mean(off)) < 0.2 * level or channel.quantity is Quantity.DISPLACEMENT
