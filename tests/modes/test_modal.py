"""Modes of known models are found again, with their shapes, and intervals that hold."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from example_files import load_file
from tarsus.base.errors import InputError
from tarsus.modes import Frf, ModeVerdict, identify_modes
from tarsus.modes.gather import decays, merged
from tarsus.modes.intervals import Basis, Scatter, numbers_of, pole_ranges, variances_of
from tarsus.modes.lscf import pole_tracks
from tarsus.modes.refine import LocalFit
from tarsus.records.measurement import Channel, FrequencyResponse, Measurement, Quantity

modal_recovery = load_file(Path(__file__).parents[2] / "benchmarks" / "modal_recovery.py")

LINES = np.arange(100.0, 1000.0, 1.0)
POLES = ((300.0, 0.02), (340.0, 0.015), (700.0, 0.05))
SHAPES = np.array([[1.0, 0.6, -0.4], [0.7, -1.0, 0.5], [0.5, 0.8, 1.0]])


def responses(
    quantity: Quantity, noise: float = 0.0, drives: int = 1, scale: float = 1e3, lines: np.ndarray = LINES
) -> Frf:
    """Three modes at three points, shapes times ``scale`` for modal masses of 1 kg, driven at the first points."""
    w = 2.0 * np.pi * lines
    own = 2.0 * np.pi * np.array([f for f, _ in POLES])[:, None]
    ratio = np.array([z for _, z in POLES])[:, None]
    modes = 1.0 / (own**2 - w**2 + 2.0j * ratio * own * w)
    order = (Quantity.DISPLACEMENT, Quantity.VELOCITY, Quantity.ACCELERATION).index(quantity)
    values = scale**2 * np.einsum("mo,mi,mf->oif", SHAPES, SHAPES[:, :drives], modes) * (1.0j * w) ** order
    random = np.random.default_rng(7)
    level = noise * np.sqrt(np.mean(np.abs(values) ** 2, axis=-1, keepdims=True) / 2.0)
    values = values + level * (random.standard_normal(values.shape) + 1.0j * random.standard_normal(values.shape))
    names = ("p1", "p2", "p3")
    return Frf(lines, values, names, names[:drives], quantity)


@pytest.mark.parametrize(
    ("drives", "quantity"), [(1, Quantity.DISPLACEMENT), (1, Quantity.ACCELERATION), (2, Quantity.VELOCITY)]
)
def test_a_model_is_found_again(quantity, drives):
    fit = identify_modes(responses(quantity, drives=drives), (110.0, 990.0), 12)
    assert fit.frequencies == pytest.approx([f for f, _ in POLES], rel=1e-5)
    assert fit.damping_ratios == pytest.approx([z for _, z in POLES], rel=1e-3)
    assert not fit.refused and not fit.remarks
    assert [(row[0], row[2], row[-1]) for row in fit.table().rows] == [
        (f, z, "determined") for f, z in zip(fit.frequencies, fit.damping_ratios, strict=True)
    ]
    structure = fit.structure()
    found = np.array([structure.row(name) for name in ("p1", "p2", "p3")]).T
    for row, shape in zip(found, SHAPES, strict=True):
        assert row == pytest.approx(1e3 * shape * np.sign(row[0] * shape[0]), rel=5e-3, abs=1.0)
    assert fit.misfit < 1e-3


def test_without_a_drive_at_a_point_the_participation_carries_the_size():
    frf = responses(Quantity.VELOCITY)
    turned = frf.values * np.exp(0.1j)  # as by the phase of an instrument
    shaken = Frf(frf.frequency, turned, frf.outputs, ("voltage",), frf.quantity)
    shapes, pulls = identify_modes(shaken, (110.0, 990.0), 12).shapes()
    assert np.abs(shapes).max(axis=1) == pytest.approx(np.ones(3))
    assert shapes[:, :, None] * pulls[:, None, :] == pytest.approx(
        1e6 * SHAPES[:, :, None] * SHAPES[:, None, :1], rel=5e-3, abs=5e3
    )


def test_responses_as_read_from_a_file_and_their_repeats():
    noisy = [responses(Quantity.VELOCITY, 0.01 * k) for k in (1, 2)]
    outputs = tuple(Channel(name, Quantity.VELOCITY) for name in noisy[0].outputs)
    read = [FrequencyResponse(outputs, (Channel("p1", Quantity.FORCE),), LINES, r.values) for r in noisy]
    fit = identify_modes(read[0], (110.0, 990.0), 12)
    assert fit.frequencies == pytest.approx([f for f, _ in POLES], rel=5e-4)
    assert all(mode.basis is Basis.CHANNELS or mode.basis is Basis.LINES for mode in fit.modes)
    repeated = identify_modes(merged([read[0], read[1]] * 2), (110.0, 990.0), 12, between_fits=False)
    assert all(mode.basis is Basis.REPEATS for mode in repeated.modes)
    with pytest.raises(InputError, match="the lines of the files are not the same"):
        merged([read[0], FrequencyResponse(outputs, read[0].inputs, LINES + 0.5, noisy[0].values)])


def test_responses_that_are_conjugated_of_another_quantity_or_noise_have_no_modes():
    frf = responses(Quantity.VELOCITY)
    fit = identify_modes(replace(frf, values=frf.values.conj()), (110.0, 990.0), 12)
    assert {mode.verdict for mode in fit.modes} == {ModeVerdict.WRONG_WAY}
    assert all("turns the wrong way" in reason and "sign of the phase" in reason for reason in fit.refused)
    fit = identify_modes(replace(frf, quantity=Quantity.DISPLACEMENT), (110.0, 990.0), 12)
    assert [mode.verdict for mode in fit.modes] == [ModeVerdict.TURNED] * 3
    assert "is the response a displacement" in fit.refused[0]
    random = np.random.default_rng(3)
    noise = random.standard_normal((3, 1, 500)) + 1.0j * random.standard_normal((3, 1, 500))
    with pytest.raises(InputError, match="no mode was found between 10 Hz and 490 Hz"):
        identify_modes(replace(frf, frequency=np.arange(500.0), values=noise), (10.0, 490.0))


def test_modes_that_are_left_out_are_remarked():
    fine = np.arange(100.0, 1000.0, 0.5)
    fit = identify_modes(responses(Quantity.VELOCITY, 0.01, lines=fine), (110.0, 990.0), 3, between_fits=False)
    assert len(fit.modes) < 3 and "unexplained" in fit.remarks[0]


def test_a_line_near_zero_that_is_off_the_grid_is_left_out():
    frf = responses(Quantity.VELOCITY)
    outputs = tuple(Channel(name, Quantity.VELOCITY) for name in frf.outputs)
    lines = np.concatenate([[1e-5], LINES - LINES[0] + 0.5])
    values = np.concatenate([frf.values[..., :1], frf.values], axis=-1)
    read = FrequencyResponse(outputs, (Channel("p1", Quantity.FORCE),), lines, values)
    fit = identify_modes(read, (0.0, 850.0), 12)
    assert fit.frequencies == pytest.approx([f - 99.5 for f, _ in POLES], rel=1e-2)


def test_close_modes_are_told_apart():
    """Two modes of one damping, two half-power bands apart, the first weaker in all points together; 40 dB."""
    lines, ratio, random = np.arange(200.0, 420.0, 0.25), 0.004, np.random.default_rng(0)
    own = 2.0 * np.pi * np.array([300.0, 300.0 * (1.0 + 4.0 * ratio)])[:, None]
    w = 2.0 * np.pi * lines
    mobility = 1.0j * w / (own**2 - w**2 + 2.0j * ratio * own * w)
    size = random.uniform(0.5, 2.0, (3, 2)) * random.choice([-1.0, 1.0], (3, 2))
    size[:, 0] *= 0.3
    values = (size @ mobility)[:, None]
    noise = random.standard_normal((2, *values.shape)) * 0.01 * np.abs(values).std() / np.sqrt(2.0)
    frf = Frf(lines, values + noise[0] + 1.0j * noise[1], ("p0", "p1", "p2"), ("f",), Quantity.VELOCITY)
    fit = identify_modes(frf, (210.0, 410.0))
    assert fit.frequencies == pytest.approx(own[:, 0] / (2.0 * np.pi), rel=1e-3)
    assert fit.damping_ratios == pytest.approx([ratio, ratio], rel=0.15)


def test_what_cannot_be_used():
    frf = responses(Quantity.VELOCITY)
    with pytest.raises(InputError, match="fewer than 3 lines lie between 2000 Hz and 3000 Hz"):
        identify_modes(frf, (2000.0, 3000.0))
    with pytest.raises(InputError, match="5 lines, too few"):
        identify_modes(frf, (300.0, 304.0))
    with pytest.raises(InputError, match="not evenly spaced"):
        Frf(LINES**1.1, frf.values, frf.outputs, frf.inputs, frf.quantity)
    with pytest.raises(InputError, match="channels swapped"):
        Frf(LINES, frf.values, frf.outputs, frf.inputs, Quantity.VOLTAGE)
    holes = frf.values.copy()
    holes[1, 0, 4] = np.nan
    with pytest.raises(InputError, match="'p2' to 'p1' has no finite number at 104 Hz"):
        Frf(LINES, holes, frf.outputs, frf.inputs, frf.quantity)


# Slow: many fits of noisy responses. Models are found again without noise above.
@pytest.mark.slow
@pytest.mark.parametrize(("drawn", "repeats"), [(8, 1), (8, 6)])
def test_errors_and_intervals_at_forty_decibels(drawn, repeats):
    found = modal_recovery.Score.joined(
        [
            modal_recovery.scored(case, case.identified())
            for seed in range(drawn)
            for case in [modal_recovery.wide(np.random.default_rng(seed), 40.0, repeats)]
        ]
    )
    assert np.isfinite(found.frequency).all() and found.extra == 0
    assert np.abs(found.frequency).max() < 5e-4
    assert np.abs(found.damping).max() < 0.03
    covered = np.concatenate([found.frequency_held, found.damping_held])
    assert 0.85 <= covered.mean() <= 1.0, "8 intervals of 95 % a structure"


def test_repeats_that_agree_by_chance_are_known_no_better_than_their_noise():
    """Six repeats that scatter by a tenth of the noise that their mean shows over the lines."""
    frf, exact = responses(Quantity.VELOCITY, noise=0.01), responses(Quantity.VELOCITY)
    random = np.random.default_rng(3)
    drawn = random.standard_normal((6, *frf.values.shape)) * np.abs(frf.values - exact.values)
    repeats = frf.values + 0.1 * (drawn - drawn.mean(axis=0))
    fit = identify_modes(replace(frf, repeats=repeats), (110.0, 990.0), 12, between_fits=False)
    for mode, (frequency, ratio) in zip(fit.modes, POLES, strict=True):
        assert mode.basis is Basis.REPEATS
        assert mode.damping.low < ratio < mode.damping.high
        assert mode.frequency.low < frequency < mode.frequency.high


@pytest.mark.parametrize(
    ("frequencies", "ratios", "sizes", "samples"),
    [
        ((656.02, 660.28), (0.00649, 0.00678), (1.0, 0.847), 459),
        ((629.30, 638.46), (0.00728, 0.00505), (1.0, -0.662), 427),
        ((239.83, 244.29), (0.0062, 0.00425), (1.0, -0.008 - 0.094j), 1315),
    ],
)
def test_one_pole_does_not_stand_for_two_that_beat(frequencies, ratios, sizes, samples):
    """One point of a decay shows two modes that candidates of the models have as one, with a damping up to a quarter
    off."""
    w, ratio = 2.0 * np.pi * np.array(frequencies), np.array(ratios)
    poles, time = w * (-ratio + 1.0j * np.sqrt(1.0 - ratio**2)), np.arange(samples) / 4096.0
    row = 2.0 * np.real(np.array(sizes) @ np.exp(poles[:, None] * time))
    row += 1e-3 * np.std(row) * np.random.default_rng(3).standard_normal(len(row))
    record = Measurement((Channel("tip", Quantity.VELOCITY),), row[None], 1.0 / 4096.0)
    fit = identify_modes(decays([record]), (frequencies[0] - 100.0, frequencies[0] + 100.0))
    assert len(fit.modes) == 2
    for mode in fit.modes:
        if mode.verdict is ModeVerdict.DETERMINED:
            nearest = np.argmin(np.abs(poles - mode.pole))
            assert mode.damping.low <= ratio[nearest] <= mode.damping.high
            assert mode.damping.value == pytest.approx(ratio[nearest], rel=0.1)


def test_ranges_of_a_pole_are_students_of_what_repeats_tell_alike():
    """Information of n repeats alike: a number's interval is that of a mean of n, by its slopes along the pole."""
    pole, count, step = complex(-60.0, 80.0), 5, 1e-6
    score = np.random.default_rng(4).normal(size=(count, 2))
    found = pole_ranges(pole, Scatter(np.tile(np.eye(2), (count, 1, 1)), score))
    for k, one in enumerate(found):
        slope = [(numbers_of(pole + way)[k] - numbers_of(pole - way)[k]) / (2.0 * step) for way in (step, 1j * step)]
        half = 2.776445 * np.std(score @ slope, ddof=1) / np.sqrt(count)
        assert [one.value, one.high - one.value] == pytest.approx([numbers_of(pole)[k], half], rel=1e-6)
    none = np.zeros((1, 2))
    fit = LocalFit(pole, slice(0, 1), none, none, np.diag([2.0, 5.0])[None], none, none)
    # slopes along the real and the imaginary part: damping, then frequency
    assert np.sqrt(variances_of(fit)) == pytest.approx([0.2 / (2.0 * np.pi), 0.5 / abs(pole)])


def test_a_pole_that_two_orders_miss_is_one():
    pole = np.array([-10.0 + 300.0j])
    found = [
        len(pole_tracks(dict(enumerate([pole, *missed, pole])), 1.0)) for missed in ([pole[:0]] * 2, [pole[:0]] * 3)
    ]
    assert found == [1, 2]
