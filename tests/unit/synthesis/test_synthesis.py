"""What a synthetic campaign plans: sweeps where the drive follows the voltage, and devices it refuses."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import tarsus as ts
from laboratory import LABORATORY
from tarsus.base.errors import InputError
from tarsus.model.drive.waveforms import SweptSine
from tarsus.records.purpose import Purpose
from tarsus.synthesis import devices
from tarsus.synthesis import recordings as synthesis
from tarsus.synthesis.campaign_folder import write_campaign
from tarsus.synthesis.recordings import Instrument, Recording, recorded
from tarsus.synthesis.sweep_level import sweep_level


def test_a_drive_that_follows_about_0_volts_is_swept_there() -> None:
    assert sweep_level(ts.load_scene(LABORATORY).robot.drives["pzt"]) == (0.2, 0.0)


def test_a_drive_that_hardly_follows_there_is_swept_where_it_does() -> None:
    """Plays rest below 1.143 V, and the memory-free part turns near 0 V."""
    drive = ts.load_scene(LABORATORY.with_name("laboratory_cantilever_1.toml")).robot.drives["pzt"]
    level, offset = sweep_level(drive)
    assert offset == 8.0
    assert level <= 0.1

    def gain(volts: float) -> float:
        cycles = drive.law.force(volts + 0.1 * np.array([1.0, -1.0, 1.0, -1.0]), drive.history)
        return abs(float(cycles[3] - cycles[2])) / 0.2

    assert gain(offset) > 30.0 * gain(0.0)


def test_a_sweep_about_a_voltage_begins_at_rest_there() -> None:
    scene = ts.load_scene(LABORATORY.with_name("laboratory_cantilever_1.toml"))
    wave = SweptSine(amplitude=0.1, start_frequency=200.0, stop_frequency=900.0, duration=0.1, offset=8.0)
    take = Recording("sweep", Purpose.MODAL, wave, 0.1, gap=0.03, before=(8.2,))
    clean = Instrument(snr_db=300.0)
    sudden = Recording("sweep", Purpose.MODAL, wave, 0.1, gap=0.03)
    at_rest, jumped = (next(recorded(scene, one, clean, "pzt", (1,))).values[0] for one in (take, sudden))
    assert abs(at_rest[0]) < 1e-9
    assert np.abs(at_rest[:20]).max() < 0.05 * np.abs(jumped[:20]).max()


def test_an_experiment_that_is_repeated_is_one_motion_with_the_noise_of_each(monkeypatch) -> None:
    scene = ts.load_scene(LABORATORY)
    wave = SweptSine(amplitude=0.1, start_frequency=200.0, stop_frequency=900.0, duration=0.05)
    take = Recording("sweep", Purpose.MODAL, wave, 0.05, gap=0.03)
    runs = []
    monkeypatch.setattr(synthesis, "simulate", lambda *words: runs.append(ts.simulate(*words)) or runs[-1])
    first, second = recorded(scene, take, Instrument(snr_db=40.0), "pzt", (1, 2))
    assert len(runs) == 1 and "ledger" not in vars(runs[0])
    noise = first.values[0] - second.values[0]
    assert 0.0 < noise.std() < 0.03 * first.values[0].std()


@pytest.mark.parametrize(
    ("name", "said"),
    [
        (
            "millipede",
            r"kind 'walker', not 'beam' or 'modal'; it has 2 drives, not one; it has 2 feet, not one$",
        ),
        ("millipede-30", "it has 30 drives, not one; it has 30 feet, not one$"),
    ],
)
def test_devices_that_identification_does_not_know(name: str, said: str, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=said):
        write_campaign(ts.load_scene(name), tmp_path, Instrument(), 1)
    assert not list(tmp_path.iterdir())


def test_a_device_of_which_no_draw_can_be_used_says_how_many_and_why():
    low = ts.with_values(ts.load_scene(LABORATORY), {"robot.feet.tip.gap": "5 um"})
    with pytest.raises(
        InputError, match=r"rests clear .*: \d+ of \d+ draws are refused, .* below the ground"
    ):
        devices.perturbed(low, 0.2, 1)
