"""Drives against a simulator that shares no formula with the library: every waveform, amplifiers and laws."""

from __future__ import annotations

import math

import numpy as np
import pytest

import tarsus as ts
from drive_cases import PRINTED, WAVEFORMS
from independent import drives as other
from model.test_drive_lower import check_shape
from tarsus.model.drive.amplifier import Amplifier
from tarsus.model.drive.law import VoltageLaw
from tarsus.model.drive.laws import Creeping
from tarsus.model.drive.laws.prandtl_ishlinskii import PrandtlIshlinskii
from tarsus.model.drive.lower import evaluate, lower
from tarsus.model.drive.signal import Signal

LAWS: dict[str, VoltageLaw] = {
    "linear": ts.LinearForce(gain=-0.6e-6, offset=0.1e-6),
    "printed": PRINTED,
    "plays": PrandtlIshlinskii(linear=1e-6, thresholds=(0.0, 2.0, 2.0, 50.0), weights=(1e-6, 2e-6, -1e-6, 5e-6)),
    "creeping": Creeping(
        instant=PrandtlIshlinskii(linear=1e-6, quadratic=2e-8, thresholds=(1.0,), weights=(2e-7,)),
        thresholds=(0.0, 1.5),
        weights=(1e-7, 2e-7),
        times=(0.2, 2.0),
        temperature=303.15,
        per_kelvin=4e-3,
    ),
}
HISTORIES = {"virgin": (), "poled": (10.0, 0.0), "negative": (-9.0, 3.0)}
LINE = ts.LinearForce(gain=1.0)
STAGES = {"all three": (0.3, 4.0, 6.0), "no lag": (0.0, 9.0, 3.0), "no slew": (0.05, math.inf, 2.0), "slow": (0, 1, 90)}
"""Lag, slew rate and rails of amplifiers, in shares of the waveform's time and 10 V."""


def agrees(waveform: Signal, law: VoltageLaw, history: tuple[float, ...], end: float, within: float, **stage: float):
    """The force of a drive at times up to an end, as the other finds it."""
    load = ts.PointLoad(weights={"tip": 1.0})
    drive = ts.Drive(load=load, law=law, history=history, amplifier=Amplifier(**stage))
    pieces, _ = lower(drive.actuator_volts(waveform), law, history)
    check_shape(pieces)
    command = other.command(waveform, end)
    volts = other.amplified(command, drive.amplifier, (0.0, *history)[-1], end)
    force = other.force(volts, law, history, end)
    t = np.sort(np.random.default_rng(1).uniform(0.0, end, 300))
    edges = np.array([0.0, *force.starts, *volts.starts, *(p.end for p in volts.pieces)])
    t = t[np.abs(t[:, None] - edges).min(axis=1) > 1e-9 * end]
    asked = [command.at(time).value(time) for time in t]
    np.testing.assert_allclose(waveform.volts(t), asked, rtol=0.0, atol=1e-10)
    wanted = np.array([force.at(time).value(time) for time in t])
    assert np.abs(evaluate(pieces, t) - wanted).max() <= within * max(float(np.ptp(wanted)), 1e-6)


def span(waveform: Signal) -> float:
    return waveform.period or min(float(waveform.track().start[-1]), 0.5)


SOME = ("sine-phase", "square-duty", "ramped-phase", "chirp", "on-off-repeat", "spline")
# The other takes the rounding of its spline, which ends at 0 V, for a fall of the voltage.
CASES = [
    (name, law, history)
    for law, history in (("linear", "poled"), ("printed", "negative"), ("plays", "virgin"), ("creeping", "poled"))
    for name in (SOME if law == "creeping" else WAVEFORMS)
    if (name, law) != ("spline", "printed")
]


@pytest.mark.parametrize(
    ("name", "law", "history"), [*CASES, ("square", "printed", "poled"), ("sine", "plays", "poled")]
)
def test_forces_of_every_waveform_and_law(name: str, law: str, history: str) -> None:
    waveform = WAVEFORMS[name]
    agrees(waveform, LAWS[law], HISTORIES[history], (2.2 if waveform.period else 1.2) * span(waveform), 1e-10)


@pytest.mark.parametrize(
    ("name", "stage"),
    [
        ("square-duty", "all three"),
        ("on-off", "all three"),
        ("sine", "slow"),
        ("sine", "no slew"),
        ("ramped-phase", "no slew"),
        ("spline", "no slew"),
        ("chirp", "no lag"),
    ],
)
def test_volts_behind_amplifiers(name: str, stage: str) -> None:
    """From the last voltage of the history on, and of what repeats for as long as it takes to settle."""
    waveform = WAVEFORMS[name]
    lag, slew, rail = STAGES[stage]
    time = span(waveform)
    numbers = {"rise_time": lag * time * math.log(9.0) or None, "clip": rail}
    if math.isfinite(slew):
        numbers["slew_rate"] = 10.0 * slew / time
    agrees(waveform, LINE, (9.0, 2.0), (2.2 if waveform.period else 1.2) * time, 1e-9, **numbers)
