"""The foreign laboratory against the library: the same device, driven alike, without any difference of the worlds."""

from __future__ import annotations

import numpy as np
import pytest

import tarsus as ts
from independent.foreign.drive import Wave
from independent.foreign.motion import Motion
from independent.foreign.world import Device, World
from tarsus.base.events import EventKind
from tarsus.base.spec import with_values
from tarsus.files.library import load_scene
from tarsus.model.drive.waveforms import RampedSquare, Sine, Square
from tarsus.model.standing import rest_state

RATE = 20e3
FAST = ts.Accuracy(gap=1e-11, drive=1e-12)
SIGNALS = {
    "square": (Square(amplitude=2.25, frequency=300.0), 0.04),
    "ramped_square": (RampedSquare(amplitude=8.0, frequency=60.0, duty=0.5), 0.05),
    "sine": (Sine(amplitude=6.0, frequency=100.0), 0.04),
}


@pytest.mark.slow
@pytest.mark.parametrize("kind", SIGNALS)
@pytest.mark.parametrize("rule", ["capture_unless_pulled", "restitute_first"])
def test_events_and_samples_agree(kind: str, rule: str) -> None:
    """Kinds of all events, their times to 1e-6 of the first mode's period, samples to 1e-6 of the motion."""
    signal, duration = SIGNALS[kind]
    slow = 0.02 if rule == "restitute_first" else 0.0
    device = Device(adhesion=(4.81342e-9, 3.69856e-6))
    keys = {key: getattr(signal, key) for key in ("amplitude", "frequency", "duty") if hasattr(signal, key)}
    moved = Motion(device, World(slow=slow), steps=4).driven(Wave(kind, keys), RATE, duration, device.gap)
    landing = {"kind": rule} | ({"speed": slow} if slow else {})
    scene = with_values(load_scene("cantilever-capture"), {"ground.landing": landing, "signals.pzt": signal})
    rest = np.array(rest_state(scene))
    run = ts.simulate(with_values(scene, {"initial.displacement": tuple(rest)}), duration, accuracy=FAST)
    expected = [(float(one["time"]), EventKind(one["kind"]).name.lower()) for one in run.events]
    assert [kind for _, kind in moved.events] == [kind for _, kind in expected]
    assert len(expected) > 5
    off = np.array([a[0] - b[0] for a, b in zip(moved.events, expected, strict=True)])
    assert np.abs(off).max() < 1e-6 / device.frequencies[0]
    states = run.states(np.arange(moved.x.shape[1]) / (RATE * moved.fine))
    for k, point in enumerate(("tip", "center")):
        row = np.array(scene.robot.structure.row(point))
        assert np.abs(moved.x[k] - row @ (states.x - rest[:, None])).max() < 1e-6 * np.ptp(moved.x[k])
