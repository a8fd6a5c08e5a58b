"""Displacements and velocities of one point: records that are right pass, at any rate, and wrong ones do not."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest

from laboratory import LABORATORY
from tarsus.files.library import load_scene
from tarsus.identify.consistency import not_together, relation_of
from tarsus.identify.traces import Trace, trace_of
from tarsus.model.drive.waveforms import RampedSquare, Sine, Square
from tarsus.records.purpose import IN_AIR, Purpose
from tarsus.synthesis.devices import perturbed
from tarsus.synthesis.recordings import Instrument, Recording, recorded, rest_of


def held_out(volts: float, hz: float, kind: type[Square] | type[Sine]) -> Recording:
    name = f"{kind.__name__.lower()}-{volts:g}v-{hz:g}hz"
    return Recording(name, Purpose.VALIDATION, kind(amplitude=volts, frequency=hz), (6.0 if hz > 5.0 else 3.0) / hz)


FEW = (
    held_out(8.0, 100.0, Square),
    held_out(6.0, 50.0, Square),
    held_out(6.0, 100.0, Sine),
    Recording("ramps", Purpose.RAMPS, RampedSquare(amplitude=8.0, frequency=60.0, duty=1.0), 6.0 / 60.0),
    Recording("air", Purpose.AIR, Square(amplitude=8.0, frequency=300.0), 0.05, gap=IN_AIR),
)


@lru_cache(maxsize=8)
def clean(rate: float) -> tuple[Trace, ...]:
    """Records of a device, without noise."""
    scene = perturbed(load_scene(LABORATORY), 0.2, 1)
    out = []
    for take in FEW:
        record = next(recorded(scene, take, Instrument(rate=rate, snr_db=300.0), "pzt", (1,)))
        points = tuple(scene.robot.structure.points)
        out.append(trace_of(record, points, take.name, "pzt volts", rest_of(take), take.gap))
    return tuple(out)


def noisy(trace: Trace, decibels: float, seed: int) -> Trace:
    """The record with noise of each channel so far below its motion, judged by the rest before the drive."""
    random, moving = np.random.default_rng(seed), trace.time >= 0.0

    def add(rows: np.ndarray) -> np.ndarray:
        level = np.sqrt(np.mean(rows[:, moving] ** 2, axis=1, keepdims=True)) * 10.0 ** (-decibels / 20.0)
        told = rows + level * random.standard_normal(rows.shape)
        return told - told[:, ~moving].mean(axis=1, keepdims=True)

    x, v = add(trace.x), add(trace.v)
    quiet = [rows[:, ~moving].std(axis=1, ddof=1) for rows in (x, v)]
    return replace(trace, x=x, v=v, noise_x=quiet[0], noise_v=quiet[1])


def scaled(trace: Trace, x: float = 1.0, v: float = 1.0) -> Trace:
    """The first point's channels times factors."""
    first = np.array([1.0, 0.0])
    by_x, by_v = 1.0 + first * (x - 1.0), 1.0 + first * (v - 1.0)
    return replace(
        trace,
        x=trace.x * by_x[:, None],
        v=trace.v * by_v[:, None],
        noise_x=trace.noise_x * np.abs(by_x),
        noise_v=trace.noise_v * np.abs(by_v),
    )


WRONG: dict[str, tuple[Callable[[Trace], Trace], str]] = {
    "sign": (lambda t: scaled(t, v=-1.0), "opposite signs"),
    "mm/s for m/s": (lambda t: scaled(t, v=1000.0), "times the integral of the velocity"),
    "um for mm": (lambda t: scaled(t, x=1000.0), "times the integral of the velocity"),
}


def refused(traces: list[Trace]) -> dict[str, str]:
    out = {}
    for t in traces:
        found = {point: relation_of(t.x[k], t.v[k], t.volts, t.step) for k, point in enumerate(t.points)}
        if said := not_together(t, {point: one for point, one in found.items() if one is not None}):
            out[t.set] = str(said[0])
    return out


@pytest.mark.parametrize("rate", [20e3, 50e3])
@pytest.mark.parametrize("decibels", [30.0, 40.0, 200.0])
def test_records_that_are_right_pass(rate, decibels):
    assert refused([noisy(t, decibels, n) for n, t in enumerate(clean(rate))]) == {}


@pytest.mark.parametrize("rate", [20e3, 50e3])
@pytest.mark.parametrize("decibels", [30.0, 40.0])
def test_wrong_records_do_not(rate, decibels):
    traces = [noisy(t, decibels, n) for n, t in enumerate(clean(rate))]
    for change, words in WRONG.values():
        told = refused([change(t) for t in traces])
        assert set(told) == {t.set for t in traces} and all(words in said for said in told.values()), told
    between = [t for t in traces if t.set != "air"]  # its drive jumps too often for a scale to be told closely
    assert set(refused([scaled(t, x=1.1) for t in between])) == {t.set for t in between}
    quick = [t for t in between if t.set != "ramps"]  # slow ones hardly tell a velocity that is 1 ms late
    late = [replace(t, v=np.roll(t.v, round(1e-3 / t.step), axis=1)) for t in quick]
    assert set(refused(late)) == {t.set for t in quick}
