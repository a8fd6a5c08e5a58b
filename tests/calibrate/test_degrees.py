"""Degrees of freedom of a fit: what a prior or the bounds hold is no unknown that was fitted."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from calibrate.toys import cells, problem, unknowns
from tarsus.calibrate.degrees import Freedom, effective_unknowns, freedom_of_best
from tarsus.calibrate.objective import Hypothesis
from tarsus.calibrate.problem import Archive, HypothesisFit
from tarsus.fit import Prior

X = np.array([1.0, 2.0, 3.0, 4.0])


def linear(slopes: np.ndarray, precision: list[float], noise: float = 0.0) -> float:
    """Effective unknowns of pulls that are linear in the unknowns, about sets drawn evenly."""
    rng = np.random.default_rng(1)
    points = rng.random((400, slopes.shape[0]))
    pulls = (points - 0.5) @ slopes + noise * rng.normal(size=(400, slopes.shape[1]))
    return effective_unknowns(points, pulls, (pulls**2).sum(axis=1), np.array(precision))


def test_it_is_the_trace_of_the_hat_matrix():
    slopes = np.array([[30.0, 0.0, 4.0], [0.0, 6.0, 1.0]])
    gram, known = slopes @ slopes.T, np.diag([12.0, 50.0])
    by_hand = np.trace(np.linalg.solve(gram + known, gram))
    assert linear(slopes, [12.0, 50.0]) == pytest.approx(by_hand, abs=1e-6)


def test_slopes_that_only_noise_makes_are_no_fit():
    assert linear(np.zeros((3, 6)), [12.0] * 3, noise=3.0) < 0.3


def test_the_scale_never_divides_by_less_than_a_quarter_of_the_cells():
    assert Freedom(6, 3.0, 12.0).scale == 4.0
    assert Freedom(6, 9.0, 12.0).scale == 8.0
    assert Freedom(6, 3.0, 0.1).scale == 1.0


def test_a_prior_that_holds_an_unknown_makes_residuals_smaller():
    """Four cells a straight line misses by 10, 10, 10 and 10 tolerances in turn, up and down."""
    table = cells((0.3 + 0.6 * X + 0.1 * np.array([1.0, -1.0, -1.0, 1.0]))[:, None])

    def straight(run: int, one: np.ndarray) -> np.ndarray:
        return (one[0] + one[1] * X + 0.0 * one[2:].sum())[:, None, None]

    scales = []
    for names, priors in (("ab", ()), ("abcd", (None, None, Prior(0.5, 0.01), None))):
        one = problem(table, straight, unknowns(names, priors=priors), robust=1e3)
        archive = Archive(one)
        sets = np.random.default_rng(2).random((300, len(names)))
        sets[0, :2] = 0.3, 0.6
        sets[0, 2:] = 0.5
        archive.evaluate(0, sets)
        scales.append(freedom_of_best([HypothesisFit(archive, 0)], {0: 0.0}).scale)
    assert scales[0] == pytest.approx(200.0, rel=0.05), "400 tolerances squared over 4 - 2"
    assert scales[1] == pytest.approx(scales[0], rel=0.05), "two more unknowns that no cell sees"


def test_a_column_without_weight_makes_residuals_no_smaller():
    """Four cells that a constant misses by 10 tolerances, beside four that cost nothing."""
    misses = 0.5 + 0.1 * np.array([1.0, -1.0, -1.0, 1.0])
    table = replace(cells(np.column_stack([misses, misses])), weight=np.array([1.0, 0.0]))
    one = problem(table, lambda run, one: np.full((4, 2, 1), one[0]), unknowns("a"), robust=1e3)
    one = replace(one, hypotheses=(Hypothesis({}, 0, (0, 1)),))
    archive = Archive(one)
    archive.evaluate(0, np.linspace(0.0, 1.0, 41)[:, None])
    assert freedom_of_best([HypothesisFit(archive, 0)], {0: 0.0}).scale == pytest.approx(400.0 / 3.0, rel=0.1)


def test_scatter_from_window_to_window_is_no_misfit():
    """Windows that scatter by 20 tolerances about the right value leave nothing to explain."""
    table = cells([[1.0]])

    def scattered(run: int, one: np.ndarray) -> np.ndarray:
        return (1.0 + 0.2 * np.array([-1.0, 1.0, -1.0, 1.0]) + 0.0 * one[0])[None, None]

    one = problem(table, scattered, unknowns("a"))
    archive = Archive(one)
    archive.evaluate(0, np.linspace(0.0, 1.0, 40)[:, None])
    assert freedom_of_best([HypothesisFit(archive, 0)], {0: 0.0}).scale == 1.0
