"""Costs of readings: residuals in tolerances, scatter, existence and constraints, checked by hand."""

from __future__ import annotations

import numpy as np
import pytest

from calibrate.toys import cells
from tarsus.calibrate.objective import FAILED, Hypothesis, Objective, SoftLimit

ONE = Hypothesis({}, 0, (0,))


def readings(*windows: float) -> np.ndarray:
    return np.array(windows, dtype=float).reshape(1, 1, 1, -1)


def test_a_residual_is_the_error_in_tolerances():
    """Twice and half are equally far, and zero is compared by the absolute tolerance."""
    objective = Objective(cells([[2.0]], absolute=0.0, relative=0.1))
    found = objective.pieces(readings(2.02), ONE)
    assert found.mean[0, 0, 0] == pytest.approx(np.log(1.01) / 0.1)
    assert found.rows[0, 0] == pytest.approx(9.0 * np.log1p((np.log(1.01) / 0.1) ** 2 / 9.0))
    up, down = (objective.pieces(readings(v), ONE).mean[0, 0, 0] for v in (4.0, 1.0))
    assert up == pytest.approx(-down) and up == pytest.approx(np.log(2.0) / 0.1)
    none = Objective(cells([[0.0]], absolute=0.5)).pieces(readings(0.5), ONE)
    assert none.mean[0, 0, 0] == pytest.approx(np.log(2.0))


def test_the_discrepancy_sees_an_error_from_the_models_side():
    objective = Objective(cells([[3.0]], absolute=1.0))
    found = objective.pieces(readings(0.0), ONE)
    assert found.mean[0, 0, 0] == pytest.approx(-4.0 * np.log(4.0))
    assert found.missed[0, 0, 0] == pytest.approx(np.log(4.0)), "(v + a) / tau(v) is 1 at v = 0"
    both = Objective(cells([[3.0]], absolute=1.0, relative=0.5)).pieces(readings(1.0), ONE)
    assert both.missed[0, 0, 0] == pytest.approx(np.log(2.0) * 2.0 / np.hypot(1.0, 0.5))


def test_scatter_over_windows_loosens_a_cell_and_costs_its_own():
    objective = Objective(cells([[1.0]], absolute=0.0, relative=0.1))
    u = np.array([np.log(1.3), np.log(0.9)]) / 0.1
    found = objective.pieces(readings(1.3, 0.9), ONE)
    variance = u.var()
    expected = 9.0 * np.log1p(u.mean() ** 2 / ((1.0 + variance) * 9.0)) + np.log1p(variance)
    assert found.rows[0, 0] == pytest.approx(expected)


def test_existence_is_a_likelihood_of_the_windows():
    table = cells([[1.0]], absolute=1e9, exists=True)
    found = Objective(table).pieces(readings(0.0, 1.0, 2.0), ONE)
    assert found.wrong[0, 0, 0] == pytest.approx(1.0 / 3.0)
    assert found.rows[0, 0] == pytest.approx(-2.0 * np.log(2.5 / 4.0), abs=1e-6)
    none = Objective(cells([[0.0]], absolute=1e9, exists=True)).pieces(readings(0.0, 1.0, 2.0), ONE)
    assert none.rows[0, 0] == pytest.approx(-2.0 * np.log(1.5 / 4.0), abs=1e-6)


def test_unknown_cells_cost_nothing_and_failed_runs_more_than_any_other():
    objective = Objective(cells([[np.nan, 1.0]]))
    both = Hypothesis({}, 0, (0, 0))
    assert objective.pieces(readings(1.0), both).rows[0, 0] == pytest.approx(0.0)
    failed = objective.pieces(readings(np.inf), both)
    assert failed.mean[0, 0, 1] == FAILED and np.isnan(failed.missed[0, 0, 0])


@pytest.mark.parametrize(("value", "excess"), [(0.5, 0.0), (1.4, 2.0), (-0.6, 3.0)])
def test_a_constraint_costs_its_excess_in_softness(value, excess):
    limit = SoftLimit("between", (0,), 0, 0.0, 1.0, 0.2)
    both = np.concatenate([readings(1.0, 1.0), readings(value, 0.5)], axis=1)  # a row of the table, and its own
    found = Objective(cells([[np.nan]]), (limit,)).pieces(both, ONE)
    assert found.limits[0][0] == pytest.approx(9.0 * np.log1p(excess**2 / 9.0))
