"""Wrong inputs of impacts: records that do not belong together, channels that are none, points that tell too little."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

import tarsus as ts
import wrong_inputs
from hexapod_records import measurement, records, structure
from impacts.test_alignment import wave
from impacts.test_force import SMALL
from impacts.test_impacts import saw
from tarsus.impacts import FitWindow, estimate_impact_map
from tarsus.impacts.alignment import align
from tarsus.impacts.detection import detect_impacts
from tarsus.impacts.estimates import common_ratio, spread
from tarsus.impacts.free import FreeResponse
from tarsus.records.measurement import Channel, Measurement, Quantity
from tarsus_reproduce.forces import estimate_forces, impact_forces, point_matrices
from wrong_inputs import Ask, Said

LOOSE = ts.Lumped(coordinates=("a",), mass=(1.0,), stiffness=(0.0,))
FLAT = np.ones(1000)


def volts(*names: str) -> Measurement:
    return Measurement(tuple(Channel(n, Quantity.VOLTAGE) for n in names), np.tile(saw(50), (len(names), 1)), 1e-5)


def aligned(one: Measurement, other: Measurement, channel: str = "a", before: float = 1.0) -> Ask:
    return lambda at: align(one, other, [channel], before=before)


def mapped(
    channel: str = "foot1", close: Callable[[], Any] | None = None, in_air: Callable[[], Any] | None = None, **how: Any
) -> Ask:
    """The map of the hexapod's foot, of other records than its own."""
    return lambda at: estimate_impact_map(
        close() if close else records()[0], in_air() if in_air else records()[1], structure(), channel, **how
    )


def elsewhere() -> Measurement:
    close, _ = records()
    return Measurement((Channel("body", Quantity.VELOCITY),), close["foot1"][None], close.step)


def clipped() -> Measurement:
    close, _ = records()
    low = float(np.abs(close["foot2"]).max())
    full = {"foot2": low}
    return replace(close, channels=tuple(replace(c, full_scale=full.get(c.name)) for c in close.channels))


ONE = measurement(wave(0.0))
WRONG: dict[str, tuple[Ask, Said]] = {
    "too little before": (
        aligned(ONE, ONE, before=5e-4),
        "51 samples lie before 0.0005 s: aligning two records takes at least",
    ),
    "a constant": (aligned(measurement(FLAT), ONE), "channel 'a' is constant before the first contact"),
    "a constant in the air": (aligned(ONE, measurement(FLAT)), "constant in the reference record"),
    "two rates": (aligned(ONE, measurement(wave(0.0), step=2e-5)), "sampled differently"),
    "channel of two records": (aligned(ONE, ONE, "b"), "has no channel 'b'"),
    "no value": (lambda at: spread([]), "no value"),
    "no pair": (lambda at: common_ratio([], [], []), "no impact"),
    "one point of two": (
        lambda at: point_matrices(SMALL, ["a"]),
        "as many of these as the structure has coordinates, 2, got 1",
    ),
    "one point twice": (lambda at: point_matrices(SMALL, ["a", "a"]), "do not determine the coordinates"),
    "forces of volts": (
        lambda at: estimate_forces(volts("a", "b"), SMALL, ["a", "b"]),
        "channel 'a' is in V: forces are estimated from velocities",
    ),
    "foot of forces": (
        lambda at: impact_forces(measurement(np.ones(9), np.ones(9)), SMALL, ["a", "b"], "c", np.array([4])),
        "'c' is not among the channels a, b",
    ),
    "no vibration": (lambda at: FreeResponse(LOOSE, ("a",), np.ones(1), 5e-6), "no vibration"),
    "point that is not there": (
        lambda at: FreeResponse(structure(), ("feet1",), np.ones(1), 5e-6),
        "no point 'feet1'; valid names are 'foot1'",
    ),
    "no jump": (
        lambda at: detect_impacts(measurement(saw()), "a"),
        "no impacts found in channel 'a': its largest jump is ",
    ),
    "no motion": (lambda at: detect_impacts(measurement(np.ones(100)), "a"), "channel 'a' is constant"),
    "ten samples": (lambda at: detect_impacts(measurement(np.ones(10)), "a"), "channel 'a' has 10 samples"),
    "impacts in volts": (lambda at: detect_impacts(volts("a"), "a"), "is in V: impacts are looked for in velocities"),
    "foot in volts": (mapped("pzt volts"), "the contact foot's channel 'pzt volts' is in V, not m/s"),
    "channel of no point": (mapped("body", elsewhere, elsewhere), "channel 'body' looks at no point of the structure"),
    "in the air twice": (mapped(close=lambda: records()[1]), "no impacts found in channel 'foot1'"),
    "no record in the air": (mapped(in_air=lambda: []), "at least one record"),
    "clipped": (mapped(close=clipped), "channel 'foot2' is clipped: 1 of"),
    "nothing clear": (
        mapped(window=FitWindow(clarity=1e6)),
        ("none of the ", " impacts found in channel 'foot1' can be used"),
    ),
}


@wrong_inputs.cases(WRONG)
def test_wrong_input_is_a_sentence(ask: Ask, said: Said, tmp_path: Path) -> None:
    wrong_inputs.is_refused(ask, said, tmp_path)
