"""Sweeps with a drive that bends: its harmonics move the damping, its force as volts does not."""

from __future__ import annotations

import numpy as np
from identify.campaigns import folder

from independent.foreign.drive import Wave
from independent.foreign.motion import Motion
from independent.foreign.world import Device, World
from tarsus.identify.campaign import read_campaign
from tarsus.identify.foot import FootModel
from tarsus.identify.resonance import identify_resonances
from tarsus.identify.straightened import straightened
from tarsus.records.measurement import Channel, Measurement, Quantity

RATE = 20e3
DAMPING = "robot.structure.damping_ratios.0"


def sweep(device: Device) -> Measurement:
    """One upward sweep of 3 V in the air, without noise: wide enough for the law's curvature to show."""
    wave = Wave("swept_sine", dict(amplitude=3.0, start_frequency=200.0, stop_frequency=8800.0, duration=1.0))
    moved = Motion(device, World()).swept(wave, RATE, 1.5)
    x = moved.x[:, :: moved.fine]
    volts = wave.volts(np.arange(x.shape[1]) / RATE)
    points = [Channel(f"{name}_x", Quantity.DISPLACEMENT, name) for name in ("tip", "center")]
    channels = Channel("volts", Quantity.VOLTAGE), *points
    return Measurement(channels, np.vstack([volts, x]), 1.0 / RATE, drive="volts")


def of_device(model: FootModel, device: Device) -> FootModel:
    """The model with the true law of a device."""
    law = "robot.drives.pzt.law"
    names = ("constant", "linear", "quadratic", "cubic")
    values = {f"{law}.{name}": value for name, value in zip(names, device.law, strict=True)}
    return model.changed({**values, f"{law}.thresholds": device.thresholds, f"{law}.weights": device.weights})


def test_damping_is_not_moved_by_a_drive_that_bends():
    device = Device()
    model = read_campaign(folder()).model
    record = sweep(device)
    found = [
        identify_resonances(model, [one], (200.0, 8800.0), 1).step.value(DAMPING)
        for one in (record, straightened(record, of_device(model, device)))
    ]
    off = np.abs(np.array(found) / device.damping[0] - 1.0)
    assert off[0] > 2e-4
    assert off[1] < 5e-5
