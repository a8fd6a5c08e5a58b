"""E6 to E10: faults of the printed robot matrices (appendix B of the source)."""

from __future__ import annotations

import tomllib
from importlib.resources import files

import numpy as np
import pytest
from scipy.linalg import eigh


@pytest.fixture(scope="module")
def robots() -> dict:
    return tomllib.loads(files("tarsus_reproduce").joinpath("data", "appendix_b.toml").read_text(encoding="utf-8"))


def matrices(robot: dict) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    return np.array(robot["M"]), np.array(robot["C"]), np.array(robot["K"])


def test_e6_printed_quadruped_impact_drives_the_foot_into_the_ground(robots):
    # gap rate after = +0.39 times the gap rate before: an approaching foot goes on approaching.
    assert robots["quadruped"]["R_first_column"][0] * -1.0 < 0.0
    assert robots["hexapod"]["R_first_column"][0] * -1.0 > 0.0


def test_e6_a_negative_restitution_is_refused():
    from tarsus.base.errors import InputError
    from tarsus.model.laws import Restitution

    assert Restitution(coefficient=0.39).parameters() == (0.39,)
    for wrong in (-0.5, 1.01):
        with pytest.raises(InputError, match="from 0 to 1"):
            Restitution(coefficient=wrong)


def test_e7_hexapod_impact_matrix_is_its_first_column_beside_the_identity(robots):
    column = np.array(robots["hexapod"]["R_first_column"])
    assert column.shape == (6,)
    whole = np.eye(6)
    whole[:, 0] = column
    # The last printed row, (-0.42, 0, 0, 0, 1), is this one with a zero lost.
    assert whole[5].tolist() == [-0.42, 0.0, 0.0, 0.0, 0.0, 1.0]


def test_e7_the_printed_impact_matrix_can_create_energy(robots):
    mass, _, _ = matrices(robots["hexapod"])
    impact = np.eye(6)
    impact[:, 0] = robots["hexapod"]["R_first_column"]
    gain = eigh(impact.T @ mass @ impact, mass, eigvals_only=True)[-1]
    assert gain == pytest.approx(22.7, abs=0.1)


def test_e8_quadruped_stiffness_is_not_symmetric_in_one_pair(robots):
    _, _, stiffness = matrices(robots["quadruped"])
    rows, columns = np.nonzero(stiffness != stiffness.T)
    assert set(zip(rows.tolist(), columns.tolist(), strict=True)) == {(1, 3), (3, 1)}
    assert (stiffness[1, 3], stiffness[3, 1]) == (3.27e8, 3.21e8)


def test_e9_quadruped_mass_matrix_is_not_one_and_is_refused(robots):
    from tarsus.base.errors import InputError
    from tarsus.model.structure import Lumped

    mass, damping, stiffness = matrices(robots["quadruped"])
    assert np.count_nonzero(np.linalg.eigvalsh(mass) < 0.0) == 2
    assert np.linalg.eigvalsh(damping)[0] < 0.0
    symmetric = (stiffness + stiffness.T) / 2.0
    assert np.linalg.eigvalsh(symmetric)[0] < 0.0
    with pytest.raises(InputError, match="mass"):
        Lumped(
            mass=mass.tolist(),
            stiffness=symmetric.tolist(),
            damping=damping.tolist(),
            coordinates=["a", "b", "c", "d", "body"],
        )


def test_e10_hexapod_matrices_and_frequency_table_disagree(robots):
    mass, _, stiffness = matrices(robots["hexapod"])
    frequencies = np.sqrt(eigh(stiffness, mass, eigvals_only=True)) / (2.0 * np.pi)
    np.testing.assert_allclose(frequencies, [117.2, 136.1, 329.2, 342.2, 678.1, 2866.0], rtol=1e-3)
    table = np.array(robots["hexapod"]["table_3_3_hz"])
    np.testing.assert_allclose(np.max(np.abs(frequencies / table - 1.0)), 0.31, atol=0.005)


def test_e10_the_rounding_of_the_printed_matrices_covers_the_frequency_table():
    from tarsus_reproduce.printed import interval, printed_model, rounding

    model = printed_model("hexapod")
    low, high = interval(rounding(model, 4000)[1].frequencies)
    assert np.all((low < model.table_frequencies) & (model.table_frequencies < high))
    # One by one; the next test has all six at once.


def test_e10_one_model_holds_the_printed_digits_and_the_frequency_table():
    from scipy.special import logit

    from example_files import load
    from tarsus_reproduce.printed import modal_form, printed_model

    example = load("rebuild_quadruped")
    model = printed_model("hexapod")
    printed, form = example.Printed.of(model), modal_form(model.matrices)
    start = np.append((np.linalg.inv(form.shapes) / printed.scale).ravel(), logit(form.damping_ratios))
    assert example.worst(printed, start) > 1.0
    found = example.feasible(printed, np.random.default_rng(0), start)
    assert found is not None
    back = modal_form(example.matrices(printed, found))
    np.testing.assert_allclose(back.frequencies, model.table_frequencies, rtol=1e-6)
    assert back.coupling < 1e-6  # damping is modal, as (3.1) says
    for what in ("mass", "damping", "stiffness"):
        off = np.abs(getattr(example.matrices(printed, found), what) - getattr(model.matrices, what))
        assert np.all(off <= getattr(model.half_widths, what)), what
