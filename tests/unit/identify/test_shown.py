"""What records show of their own instruments, on made records: named where it is, and nothing where all is sound."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from identify.test_checks import known
from scipy.signal import butter, lfilter

from tarsus.base.arrays import Floats
from tarsus.identify.shown import instrument_checks
from tarsus.identify.traces import Trace

STEP, COUNT, REST = 5e-5, 4000, 200
FRINGE = 316e-9


def moved(number: int) -> tuple[Floats, Floats]:
    """Displacement and velocity (ns,) of a point that goes to and fro, and rests at another place in between."""
    time = STEP * (np.arange(COUNT + REST, dtype=np.float64) - REST)
    omega = 2.0 * np.pi * (23.0 + 7.0 * number)
    x = np.where(time > 0.0, 3e-5 * (1.0 - np.cos(omega * time)), 0.0)
    return x, np.where(time > 0.0, 3e-5 * omega * np.sin(omega * time), 0.0)


def plain(x: Floats, v: Floats, repeat: int) -> tuple[Floats, Floats]:
    return x, v


def warmer(x: Floats, v: Floats, repeat: int) -> tuple[Floats, Floats]:
    return x * (1.0 + 5e-4 * repeat), v * (1.0 + 5e-4 * repeat)


def coupled(x: Floats, v: Floats, repeat: int) -> tuple[Floats, Floats]:
    """Displacements behind a high-pass of 0.1 Hz."""
    above, below = butter(1, 0.2 * STEP, "high")
    return lfilter(above, below, x), v


def dropped(x: Floats, v: Floats, repeat: int) -> tuple[Floats, Floats]:
    for at in (700, 1500, 3000):
        x, v = x + (np.arange(len(x)) >= at + 100 * repeat) * FRINGE, v.copy()
        v[at + 100 * repeat] += 1e-3
    return x, v


def records(change: Callable[..., tuple[Floats, Floats]], smooth: int = 1) -> list[Trace]:
    """Three repeats of each of four motions, with noise of 0.1 um and 30 um/s, a mean over some samples."""
    random, out = np.random.default_rng(3), []
    time = STEP * (np.arange(COUNT + REST, dtype=np.float64) - REST)
    for number in range(4):
        for repeat in range(3):
            rows = change(*moved(number), repeat)
            noise = random.standard_normal((2, len(time) + smooth - 1))
            noise = np.array([np.convolve(one, np.ones(smooth), "valid") for one in noise])
            x, v = (one[None] + s * n for one, s, n in zip(rows, (1e-7, 3e-5), noise, strict=True))
            own = np.array([1e-7]), np.array([3e-5]), np.array([1e-8])
            out.append(Trace(f"{number}-{repeat}", str(number), ("tip",), time, x, v, 0.0 * time, *own))
    return out


@pytest.mark.parametrize(
    ("change", "smooth", "said"),
    [
        (plain, 1, ""),
        (warmer, 1, "all motion grows by 0.05 % from one repeat to the next"),
        (coupled, 1, "the displacements are behind a high-pass of "),
        (dropped, 1, "drop-outs"),
        (plain, 8, "is coloured"),
    ],
)
def test_what_is_the_instruments_is_named(
    change: Callable[..., tuple[Floats, Floats]], smooth: int, said: str
) -> None:
    traces = records(change, smooth)
    checks = instrument_checks(known(), traces, traces, traces, alike=True, hum=False)
    assert len(checks) == 4
    failed = [one.cause for one in checks if not one.passed]
    assert len(failed) == bool(said) and all(said in one for one in failed), failed
    if change is coupled:
        assert float(failed[0].split("high-pass of ")[1].split()[0]) == pytest.approx(0.1, rel=0.03)


def test_numbers_that_hang_on_gains_are_in_doubt_and_what_hum_adds_is_not_taken_for_colour() -> None:
    traces = records(warmer)
    failed = [
        one for one in instrument_checks(known(), traces, (), (), alike=True, hum=False) if not one.passed
    ]
    assert [one.paths for one in failed] == [("robot.drives.pzt.law.linear", "ground.film.coefficient")]
    line = 3e-7 * np.sin(2.0 * np.pi * 50.0 * traces[0].time)
    hummed = [Trace(**{**vars(one), "x": one.x + line}) for one in records(plain)]
    for hum in (False, True):
        checks = instrument_checks(known(), hummed, (), (), alike=True, hum=hum)
        assert all(one.passed for one in checks) is hum


def test_steps_of_a_coarse_converter_are_no_drop_outs() -> None:
    """Four times the noise: of most samples repeats differ by nothing but what their zeros are off."""
    digit, coarse = np.array([4e-7, 1.2e-4]), []
    for one in records(plain):
        x, v = (step * np.round(row / step) for step, row in zip(digit, (one.x, one.v), strict=True))
        own = {"noise_x": digit[:1] / np.sqrt(12.0), "noise_v": digit[1:] / np.sqrt(12.0)}
        coarse.append(Trace(**{**vars(one), "x": x - x[:, :REST].mean(), "v": v - v[:, :REST].mean(), **own}))
    checks = instrument_checks(known(), coarse, coarse, (), alike=True, hum=False)
    (dropped_out,) = (one for one in checks if one.name.startswith("drop-outs"))
    assert dropped_out.passed, dropped_out.value
