"""The descent of a calibration: its residuals are the cost, its Jacobian is theirs, and it reaches the bottom."""

from __future__ import annotations

import numpy as np
import pytest

from calibrate.toys import ball_study, cells, problem, search, true_rows, unknowns
from tarsus.calibrate.calibrating import calibrate
from tarsus.calibrate.lowering import lower_study
from tarsus.calibrate.objective import SoftLimit
from tarsus.calibrate.problem import Archive, HypothesisFit
from tarsus.calibrate.search import search_hypotheses
from tarsus.calibrate.studyfile import load_study
from tarsus.fit import Prior, least_squares

TRUTH = {"e": 0.8, "push": 0.6}


def lowered(folder):
    """A study of the ball whose rows were read from the true numbers."""
    return lower_study(load_study(ball_study(folder, true_rows(folder, TRUTH))))


def slopes_by_differences(fit: HypothesisFit, x: np.ndarray, step: float) -> np.ndarray:
    beside = np.concatenate([x + step * np.eye(len(x)), x - step * np.eye(len(x))])
    rows = fit.residuals_at(beside)
    return ((rows[: len(x)] - rows[len(x) :]) / (2.0 * step)).T


def test_residuals_of_a_branch_are_its_cost_and_have_its_slopes():
    """Windows that scatter, a constraint of which one sample decides, a prior, and existence that never moves."""

    def function(run, x):
        a, b = x
        row = np.array([[3.0 + a, 2.0 * b, 0.0], [1.0 + a * b, 1.0, 0.0], [0.0, 0.0, 5.0 + a]])
        return row[:, :, None] * (1.0 + np.array([0.0, 0.05 * a, -0.02]))

    table = cells([[3.2, 1.1], [1.4, 1.2]], absolute=0.05, relative=0.1, exists=True)
    numbers = unknowns("ab", priors=(None, Prior(0.4, 0.2)))
    one = problem(table, function, numbers, limits=(SoftLimit("high", (0,), 2, 0.0, 5.2, 0.1),), extra_rows=1)

    archive = Archive(one)
    fit = HypothesisFit(archive, 0)
    x = np.array([0.6, 0.7])
    readings = archive.evaluate(0, x[None])
    costs = fit.pieces(readings)
    total = costs.rows[0].sum() + sum(one[0] for one in costs.limits) + (numbers.prior_residuals(x) ** 2).sum()
    assert np.sum(fit.residuals(x) ** 2) == pytest.approx(total, rel=1e-12) and costs.limits[0][0] > 1.0
    np.testing.assert_allclose(fit.jacobian(x), slopes_by_differences(fit, x, 1e-5), rtol=1e-5, atol=1e-5)


def test_heights_of_a_ball_have_slopes_and_counts_have_none(tmp_path):
    found = lowered(tmp_path)
    one, x = found.problem, np.array([0.61, 0.43])
    for number in range(len(one.hypotheses)):
        fit = HypothesisFit(Archive(one), number)
        told, wanted = fit.jacobian(x), slopes_by_differences(fit, x, 2e-4)
        rates, heights = slice(0, 6, 2), slice(1, 6, 2)  # row by row
        assert number < 2 and np.abs(told[heights]).max() > 1.0
        np.testing.assert_allclose(told[heights], wanted[heights], rtol=0.01, atol=0.02)
        assert not told[rates].any(), "counts have no slope"


def test_the_polish_reaches_the_truth_in_few_sets_and_is_read_back(tmp_path):
    one = lowered(tmp_path).problem
    average = next(n for n, each in enumerate(one.hypotheses) if each.options["height"] == "average")
    archive = Archive(one)
    found = least_squares(HypothesisFit(archive, average), one.unknowns.cube(np.array([0.81, 0.57])), 12, 0.03)
    assert found.values["e"] == pytest.approx(0.8, rel=2e-3) and found.values["push"] == pytest.approx(0.6, rel=0.02)
    assert archive.sets <= 12 and found.slopes <= found.evaluations


def test_a_search_ends_lower_with_the_polish_and_resumes_to_the_same_bytes(tmp_path):
    folder = tmp_path / "study"
    folder.mkdir()
    plain, polished = (search(short=0, generations=0, spread=0, local_search=steps) for steps in (0, 10))
    one = lowered(folder).problem
    costs = [min(f.cost for f in search_hypotheses(Archive(one), how)[0].values()) for how in (plain, polished)]
    assert costs[1] < 0.95 * costs[0]
    file = folder / "ball.py"
    calibrate(file, tmp_path / "out", threads=1)
    parts = sorted((tmp_path / "out" / "units").rglob("*.npz"))
    parts[-3].unlink()
    before = (tmp_path / "out" / "calibration.json").read_bytes()
    calibrate(file, tmp_path / "out", threads=2, resume=True)
    assert (tmp_path / "out" / "calibration.json").read_bytes() == before
