"""Delays, gains, signs and low-passes of channels, from motion in closed form."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from independent.foreign.campaign import write_campaign
from independent.foreign.world import Device, World
from tarsus.identify.chain import identify
from tarsus.identify.instruments import Instruments, relations_of
from tarsus.identify.lateness import LowPass, lateness_of
from tarsus.identify.traces import jumps_of
from tarsus.identify.volts import delayed
from tarsus.modes.frf import Frf
from tarsus.modes.modal import ModalFit, identify_modes
from tarsus.records.measurement import Channel, Measurement, Quantity

STEP = 50e-6
POINTS = ("tip",)


def record(late: float = 0.0, gain: float = 1.0, seed: int = 1) -> Measurement:
    """A sum of sines and its velocity at 40 dB, the displacement late and by a factor too large."""
    random, time = np.random.default_rng(seed), STEP * np.arange(8000)
    omega, size = 2.0 * np.pi * np.array([40.0, 623.0]), np.array([30e-6, 20e-6])
    x = gain * size @ np.sin(np.outer(omega, time - late))
    v = (size * omega) @ np.cos(np.outer(omega, time))
    values = np.array([one + 0.01 * np.std(one) * random.standard_normal(len(one)) for one in (x, v)])
    channels = (Channel("x", Quantity.DISPLACEMENT, "tip"), Channel("v", Quantity.VELOCITY, "tip"))
    return Measurement(channels, values, STEP)


def found(**keys: float) -> Instruments:
    """From five repeats."""
    return Instruments(relations_of([record(**keys, seed=seed) for seed in range(5)], POINTS), STEP)


@pytest.mark.parametrize("late", [6e-6, -6e-6, 20e-6])
def test_delay_is_recovered_and_taken_off(late: float) -> None:
    """To 0.2 us, and the displacement is where it belongs to a tenth of what the delay moves it by."""
    instruments = found(late=late)
    assert instruments.lag("tip") == pytest.approx(late, abs=0.2e-6)
    assert instruments.gain("tip", Quantity.DISPLACEMENT) == 1.0
    apart = [
        np.std(instruments.taken_off(record(late=late), False)["x"] - record()["x"]),
        np.std(record(late=late)["x"] - record()["x"]),
    ]
    assert apart[0] < 0.1 * apart[1]
    assert len(instruments.sentences()) == 1


@pytest.mark.parametrize("gain", [1.03, -1.0])
def test_gain_and_sign(gain: float) -> None:
    """Of the displacement against the velocity, and of the velocity where that is at fault."""
    instruments = found(gain=gain)
    assert instruments.gain("tip", Quantity.DISPLACEMENT) == pytest.approx(gain, abs=0.002)
    other = instruments.hypotheses()[1]
    assert other.gain("tip", Quantity.DISPLACEMENT) == 1.0
    assert other.gain("tip", Quantity.VELOCITY) == pytest.approx(1.0 / gain, abs=0.002)


def test_sound_instruments_stay_as_they_are() -> None:
    """Not a sample changes, and nothing is reported."""
    instruments = found()
    assert not instruments.differ and instruments.sentences() == []
    assert instruments.taken_off(one := record(), False) is one


def responses(late: float, low: LowPass | None) -> ModalFit:
    """Two real modes behind a delay and a low-pass, at 50 dB."""
    random, frequency = np.random.default_rng(3), np.arange(200.0, 9000.0, 2.0)
    s = 2.0j * np.pi * frequency
    omega, zeta = 2.0 * np.pi * np.array([623.0, 6424.0]), np.array([0.011, 0.072])
    modes = 1.0 / (s**2 + 2.0 * (zeta * omega)[:, None] * s + omega[:, None] ** 2)
    through = np.exp(-s * late) * (1.0 if low is None else low.response(s))
    values = through * (np.array([[1.0, 20.0], [0.4, -12.0]]) @ modes)
    noise = random.standard_normal((6, 2, 2, len(s)))
    size = 3e-3 * np.sqrt(np.mean(np.abs(values) ** 2, axis=1))[:, None]
    repeats = (values + size * (noise[:, 0] + 1.0j * noise[:, 1]))[:, :, None]
    frf = Frf(frequency, repeats.mean(axis=0), ("a", "b"), ("volts",), Quantity.DISPLACEMENT, repeats)
    return identify_modes(frf, (200.0, 9000.0), 12, between_fits=False)


@pytest.mark.parametrize("late", [0.0, 6e-6, -4e-6])
def test_delay_behind_the_drive(late: float) -> None:
    """From the residues of modes that are real."""
    seen = lateness_of(responses(late, None))
    assert seen is not None and seen.low is None
    assert seen.late.value == pytest.approx(late, abs=0.05e-6)
    assert seen.off(STEP) == (late != 0.0)


def test_low_pass_is_told_from_a_delay() -> None:
    """Its kind, its corner to 0.5 %, and the delay of what is slow."""
    corner = 8000.0
    poles = np.exp(1.0j * np.pi * (2.0 * np.arange(4) + 5.0) / 8.0)
    low = LowPass("butter", poles, corner)
    assert low.delay == pytest.approx(2.6131 / (2.0 * np.pi * corner), rel=1e-4)
    seen = lateness_of(responses(0.0, low))
    assert seen is not None and seen.low is not None
    assert seen.low.name == "butter low-pass of order 4"
    assert seen.low.corner == pytest.approx(corner, rel=5e-3)
    assert seen.late.value == pytest.approx(low.delay, abs=0.2e-6)


def test_delayed_volts() -> None:
    """A triangle keeps its corners, a square the jumps that a sample now lies within."""
    place = np.arange(200.0)
    triangle = 5.0 * np.abs((place / 40.0) % 2.0 - 1.0)
    shifted = 5.0 * np.abs(((place - 0.12) / 40.0) % 2.0 - 1.0)
    assert delayed(triangle, 0.12)[5:-5] == pytest.approx(shifted[5:-5], abs=1e-3)
    square = np.where((place // 40) % 2 == 0, 5.0, -5.0)
    assert list(jumps_of(square)) == [39, 79, 119, 159]
    assert list(jumps_of(delayed(square, 0.4))) == [39, 40, 79, 80, 119, 120, 159, 160]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("world", "said"),
    [
        (World(), None),
        (World(late=6e-6), "come 6.0"),
        (World(gain=1.03), "is 1.03 +-"),
        (World(gain=-1.0), "is -1 +-"),
    ],
)
def test_foreign_campaigns(tmp_path: Path, world: World, said: str | None) -> None:
    """What instruments add is reported in one sentence, and the numbers of the ground are those of the device."""
    device = Device()
    found = identify(write_campaign(tmp_path, device, world))
    remarks = [one for one in found.remarks if "taken for the" in one]
    assert len(remarks) == (said is not None) and all(said in one for one in remarks if said)
    truth = {
        "ground.film.coefficient": device.film[0],
        "ground.film.thickness": device.film[1],
        "ground.restitution.coefficient": device.restitution,
        "ground.adhesion.initial": device.adhesion[0],
        "ground.adhesion.rate": device.adhesion[1],
    }
    for step in found.steps.values():
        for path, value, std in zip(step.paths, step.values, step.std, strict=True):
            assert abs(value - truth.get(path, value)) < 4.0 * std, path
