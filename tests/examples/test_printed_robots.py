"""The examples hexapod_modes.py and rebuild_quadruped.py, and the packaged devices they describe."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.special import logit

import tarsus as ts
from example_files import load
from tarsus_reproduce.forces import point_matrices
from tarsus_reproduce.printed import modal_form, printed_model


@pytest.fixture(scope="module")
def example():
    return load("rebuild_quadruped")


@pytest.fixture(scope="module")
def printed(example):
    return example.Printed.of(printed_model("quadruped"))


def unknowns(printed, structure: Any) -> np.ndarray:
    """The example's unknowns of a structure with mass-normalised shapes."""
    shapes = np.array([structure.row(point) for point in structure.points])
    factor = np.linalg.inv(shapes) / printed.scale
    return np.append(factor.ravel(), logit(structure.damping_ratios))


def test_hexapod_modes_describes_the_packaged_devices():
    example = load("hexapod_modes")
    model = printed_model("hexapod")
    form, (_, spread) = modal_form(model.matrices), example.rounding(model, 200)
    for name in ("hexapod", "hexapod-table"):
        device = ts.load_scene(name)
        printed, found = (example.described(device, model, form, spread).robot.structure, device.robot.structure)
        factors = np.array(found.damping_ratios) / printed.damping_ratios  # one calibrated factor for all modes
        np.testing.assert_allclose(factors, factors[0], rtol=1e-4)
        assert found.model_copy(update={"damping_ratios": printed.damping_ratios}) == printed


def test_hexapod_modes_finds_the_column_of_the_source_but_for_its_size():
    example = load("hexapod_modes")
    model = printed_model("hexapod")
    column = example.impact_columns(modal_form(model.matrices).shapes, 0.5)
    assert column == pytest.approx([-0.5, 0.948, 0.952, 0.503, 0.554, -0.658], abs=0.001)
    assert np.all(np.sign(column) == np.sign(model.restitution_column))


def test_slopes_are_the_derivative_of_the_residuals(example, printed):
    x = unknowns(printed, ts.load_scene("quadruped").robot.structure)
    along = np.random.default_rng(0).normal(size=x.size) * 1e-6
    moved = printed.residuals(x + along) - printed.residuals(x - along)
    assert moved == pytest.approx(2.0 * printed.slopes(x) @ along, abs=1e-6)


def test_the_quadruped_holds_every_printed_entry_and_the_table(example, printed):
    structure: Any = ts.load_scene("quadruped").robot.structure
    assert structure.frequencies == (15.0, 86.0, 181.0, 724.0, 893.0)
    model, back = printed.model, point_matrices(structure, tuple(structure.points))
    unit = structure.modal_masses[0]
    for what in ("mass", "damping", "stiffness"):
        matrix = getattr(back, what) / unit
        off = np.abs(matrix - getattr(model.matrices, what)) / getattr(model.half_widths, what)
        assert off.max() < 0.71, what
        assert np.linalg.eigvalsh(matrix / printed.scale / printed.scale[:, None])[0] > 0.0, what
    assert modal_form(back).frequencies == pytest.approx(structure.frequencies, rel=1e-5)
    assert np.ones(5) @ back.mass @ np.ones(5) == pytest.approx(2.7e-3, rel=2e-3)


def test_the_quadruped_is_the_centre_the_example_finds(example, printed):
    x = unknowns(printed, ts.load_scene("quadruped").robot.structure)
    value, found = example.centre(printed, x)
    assert value == pytest.approx(47.1235, abs=1e-3)
    assert example.barrier(printed, x)[0] == pytest.approx(value, abs=1e-3)
    assert printed.split(found)[1] == pytest.approx(printed.split(x)[1], rel=1e-3)


def test_walks_stay_within_the_rounding_and_move(example, printed):
    x = unknowns(printed, ts.load_scene("quadruped").robot.structure)
    met = example.wander(printed, np.array([x, x]), 200, np.random.default_rng(2))
    assert met.shape == (7, 2, 30)
    assert np.abs(printed.residuals(met)).max() < 1.0
    zeta = printed.split(met)[1].reshape(-1, 5)
    assert np.ptp(zeta[:, 0]) > 0.2  # hardly determined
    assert np.ptp(zeta[:, 1]) < 0.05  # well determined, as long as mode 2 carries the mass


@pytest.mark.full
def test_no_start_finds_a_better_centre_and_the_body_hardly_moves(example):
    rebuilt = example.rebuild(starts=4, steps=300, seed=3)
    assert len(rebuilt.centres) >= 3
    assert 47.123 < rebuilt.barriers[0] < 48.5  # which of the lowest few ten starts reach hangs on rounding
    shapes = np.abs(example.shapes(rebuilt.printed, rebuilt.met))
    assert (shapes[:, 2] / shapes.max(axis=1)).max() < 0.2


@pytest.mark.slow
def test_only_one_reading_of_the_asymmetric_pair_is_ever_reached(example):
    counts = example.readings_held(starts=8)
    assert counts[3.27e8] >= 4
    assert counts[3.21e8] == 0
