"""Modes of known shapes: strongly damped ones that overlap, from responses with noise."""

from __future__ import annotations

import numpy as np
import pytest

import tarsus as ts
from tarsus.base.errors import InputError
from tarsus.model.structure import Modal
from tarsus.modes.frf import Frf
from tarsus.modes.known_shapes import fit_known_shapes
from tarsus.modes.mode import ModeVerdict
from tarsus.records.measurement import Quantity


def quadruped() -> Modal:
    structure = ts.load_scene("quadruped").robot.structure
    assert isinstance(structure, Modal)
    return structure


def responses(noise: float, repeats: int, *, seed: int = 3, spacing: float = 1.0) -> tuple[Frf, np.ndarray]:
    """Velocities over a force at foot 1, with noise (of the root mean square of a point) in each repeat; lines some Hz
    apart."""
    structure = quadruped()
    f = np.arange(6.0, 1800.0, spacing)
    s = 2.0j * np.pi * f
    rows = np.array([structure.row(name) for name in structure.points])
    omega = 2.0 * np.pi * np.array(structure.frequencies)[:, None]
    ratio = np.array(structure.damping_ratios)[:, None]
    single = s / (s**2 + 2.0 * ratio * omega * s + omega**2)
    clean = rows @ (rows[0][:, None] * single)
    random = np.random.default_rng(seed)
    size = noise * np.sqrt(np.mean(np.abs(clean) ** 2, axis=1))[:, None]
    shape = (repeats, *clean.shape)
    many = clean + size * (random.standard_normal(shape) + 1j * random.standard_normal(shape)) / np.sqrt(2.0)
    names = tuple(structure.points)
    frf = Frf(f, many.mean(axis=0)[:, None], names, ("volts",), Quantity.VELOCITY, many[:, :, None])
    return frf, rows.T


def test_five_overlapping_modes() -> None:
    structure = quadruped()
    frf, shapes = responses(0.01, 4)
    fit = fit_known_shapes(frf, shapes)
    np.testing.assert_allclose(fit.frequencies, structure.frequencies, rtol=3e-3)
    np.testing.assert_allclose(fit.damping_ratios, structure.damping_ratios, rtol=2e-2)
    assert fit.misfit < 0.02
    for mode, f, ratio in zip(fit.modes, structure.frequencies, structure.damping_ratios, strict=True):
        assert mode.verdict is ModeVerdict.DETERMINED
        for got, wanted in ((mode.frequency, f), (mode.damping, ratio)):
            assert abs(got.value - wanted) < 3.0 * got.half_width(1.0)
    # residues of the displacement: shape times participation over 2 i w_d
    mode = fit.modes[3]
    turning = 2.0 * np.pi * structure.frequencies[3] * np.sqrt(1.0 - structure.damping_ratios[3] ** 2)
    np.testing.assert_allclose(mode.residues[:, 0], shapes[3] * shapes[3, 0] / (2.0j * turning), rtol=2e-3)


# Slow: more draws of the noise. One stays, of ten intervals.
@pytest.mark.parametrize(("draws", "least"), [(1, 0.75), pytest.param(12, 0.88, marks=pytest.mark.slow)])
def test_intervals_cover(draws: int, least: float) -> None:
    structure = quadruped()
    inside = []
    for seed in range(draws):
        frf, shapes = responses(0.01, 5, seed=100 + seed)
        fit = fit_known_shapes(frf, shapes)
        inside += [
            one.low <= wanted <= one.high
            for mode, f, ratio in zip(fit.modes, structure.frequencies, structure.damping_ratios, strict=True)
            for one, wanted in ((mode.frequency, f), (mode.damping, ratio))
        ]
    assert np.mean(inside) > least


def test_shapes_in_another_order_wrong_shapes_and_modes_in_the_noise() -> None:
    frf, shapes = responses(0.002, 4, spacing=4.0)
    fit = fit_known_shapes(frf, shapes[::-1])
    np.testing.assert_allclose(fit.frequencies, quadruped().frequencies[::-1], rtol=3e-3)
    assert fit_known_shapes(frf, shapes[:, [3, 1, 2, 0, 4]]).misfit > 0.3
    frf, shapes = responses(3.0, 4, spacing=4.0)
    assert any("no certain damping" in said for said in fit_known_shapes(frf, shapes).refused)


def test_one_drive_only() -> None:
    frf, shapes = responses(0.01, 2, spacing=4.0)
    two = Frf(frf.frequency, np.repeat(frf.values, 2, axis=1), frf.outputs, ("a", "b"), frf.quantity)
    with pytest.raises(InputError, match="need one drive, got 2"):
        fit_known_shapes(two, shapes)
