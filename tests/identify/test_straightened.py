"""Sweeps with a drive that bends: its harmonics move the damping, its force as volts does not."""

from __future__ import annotations

import numpy as np
import pytest

from identify.campaigns import folder
from independent.foreign.drive import Wave
from independent.foreign.motion import Motion
from independent.foreign.world import Device, World
from tarsus.identify.campaign import read_campaign
from tarsus.identify.foot import FootModel
from tarsus.identify.resonance import identify_resonances
from tarsus.identify.straightened import straightened
from tarsus.model.drive.waveforms import SweptSine
from tarsus.modes import estimate_frf, identify_modes
from tarsus.records.measurement import Channel, Measurement, Quantity

RATE = 20e3
BAND = (217.0, 1883.0)
"""Of the first mode alone."""
DAMPING = "robot.structure.damping_ratios.0"


def sweep(device: Device, volts: float = 3.0, low: float = 200.0, high: float = 8800.0) -> Measurement:
    """One sweep in the air, without noise; of 3 V, wide enough for the law's curvature to show."""
    wave = Wave("swept_sine", dict(amplitude=volts, start_frequency=low, stop_frequency=high, duration=1.0))
    moved = Motion(device, World()).swept(wave, RATE, 1.5)
    x = moved.x[:, :: moved.fine]
    seen = wave.volts(np.arange(x.shape[1]) / RATE)
    points = [Channel(f"{name}_x", Quantity.DISPLACEMENT, name) for name in ("tip", "center")]
    channels = Channel("volts", Quantity.VOLTAGE), *points
    return Measurement(channels, np.vstack([seen, x]), 1.0 / RATE, drive="volts")


def meant(volts: float, low: float = 200.0, high: float = 8800.0) -> SweptSine:
    """The drive of a sweep as a campaign states it."""
    return SweptSine(amplitude=volts, start_frequency=low, stop_frequency=high, duration=1.0)


def of_device(model: FootModel, device: Device) -> FootModel:
    """The model with the true law of a device."""
    law = "robot.drives.pzt.law"
    names = ("constant", "linear", "quadratic", "cubic")
    values = {f"{law}.{name}": value for name, value in zip(names, device.law, strict=True)}
    return model.changed({**values, f"{law}.thresholds": device.thresholds, f"{law}.weights": device.weights})


def test_damping_is_not_moved_by_a_drive_that_bends():
    device = Device()
    model = read_campaign(folder()).model
    record = sweep(device, high=2000.0)
    found = [
        identify_modes(estimate_frf([one], ["volts"], ["tip_x"], BAND), BAND, 4, between_fits=False).damping_ratios[0]
        for one in (record, *straightened([record], [(0.0, meant(3.0, high=2000.0))], of_device(model, device)))
    ]
    off = np.abs(np.array(found) / device.damping[0] - 1.0)
    assert off[0] > 5e-5
    assert off[1] < 5e-6


@pytest.mark.slow
def test_plays_that_a_sweep_moves_once_move_no_number():
    """Up and down the plays' step is another part of the force, and where a sine begins at once no Fourier series of
    its samples shows how far they went: frequencies were 5e-6 off, and damping 0.2 %."""
    device = Device(law=(-6e-7, -9e-8, 0.0, 0.0), weights=(-3e-7, -1.8e-7, -8e-8, 0.0, 0.0, 0.0))
    model = of_device(read_campaign(folder()).model, device)
    ways = ((200.0, 8800.0), (8800.0, 200.0))
    records, drives = [sweep(device, 0.2, *way) for way in ways], [(0.0, meant(0.2, *way)) for way in ways]
    found = identify_resonances(model, straightened(records, drives, model), (200.0, 8800.0), 1).step
    assert abs(found.value(DAMPING) / device.damping[0] - 1.0) < 1e-4
    assert abs(found.value("robot.structure.frequencies.0") / device.frequencies[0] - 1.0) < 1e-6
