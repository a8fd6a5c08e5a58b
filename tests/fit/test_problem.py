"""Fits of bouncing balls, whose motion is known in closed form, and of a walker."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import tarsus as ts
from tarsus.base.errors import InputError
from tarsus.fit import Limit, Prior, Problem, Reading, Samples, Unknown
from walking_scenes import trotter

SCENES = Path(__file__).parents[1] / "scenes"
E, G = "ground.restitution.coefficient", "ground.gravity.acceleration"
GAP = "robot.feet.ball.gap"


@pytest.fixture(scope="module")
def ball():
    return ts.read_scene(SCENES / "ball.toml")


def first_landing(events) -> float:
    return float(events["time"][events["kind"] < 6][0])


def second_landing(events) -> float:
    return float(events["time"][events["kind"] < 6][1])


def landings(**more):
    """Readings of the two landings of a ball of e = 0.8, g = 9.5 from 1 m and from 0.6 m, known to 1 ms."""
    out = []
    for h in (1.0, 0.6):
        fall = np.sqrt(2.0 * h / 9.5)
        under = {GAP: h}
        out += [Reading(first_landing, fall, 1e-3, under), Reading(second_landing, fall * 2.6, 1e-3, under)]
    return out


def test_residuals_and_their_jacobian_are_those_of_the_closed_form(ball):
    problem = Problem(ball, [Unknown(E, 0.5, 0.9), Unknown(G, 5.0, 20.0, "log")], landings(), 2.0)
    x = np.array([0.25, 0.6])
    e, g = problem.values(x).values()
    assert (e, g) == (pytest.approx(0.6), pytest.approx(5.0 * 4.0**0.6))
    assert ts.get_value(problem.scene_at(x), E) == e
    fall = np.repeat(np.sqrt(2.0 * np.array([1.0, 0.6]) / g), 2)
    times = fall * np.tile([1.0, 1.0 + 2.0 * e], 2)
    measured = np.repeat(np.sqrt(2.0 * np.array([1.0, 0.6]) / 9.5), 2) * np.tile([1.0, 2.6], 2)
    assert problem.residuals(x) == pytest.approx((times - measured) / 1e-3, rel=1e-7)
    by_e = fall * np.tile([0.0, 2.0], 2)
    wanted = np.column_stack([by_e * 0.4, -0.5 * times * np.log(4.0)]) / 1e-3
    np.testing.assert_allclose(problem.jacobian(x), wanted, rtol=1e-6, atol=1e-3)
    assert problem.gradient(x) == pytest.approx(wanted.T @ problem.residuals(x), rel=1e-6)
    assert problem.cost(x) == pytest.approx(0.5 * np.sum(problem.residuals(x) ** 2))
    assert problem.costs([x, x]) == pytest.approx([problem.cost(x)] * 2)


def test_samples_of_a_gap_have_the_slopes_of_the_parabola(ball):
    times = np.linspace(0.05, 0.9, 9)
    problem = Problem(
        ball, [Unknown(E, 0.5, 0.9), Unknown(G, 5.0, 20.0)], [Samples("ball", times, 0.0 * times, "1 mm")], 1.0
    )
    x = np.array([0.5, 0.4])
    e, g = problem.values(x).values()
    fall = np.sqrt(2.0 / g)
    late, speed = times - fall, np.sqrt(2.0 * g)
    gap = np.where(late < 0.0, 1.0 - 0.5 * g * times**2, e * speed * late - 0.5 * g * late**2)
    assert problem.residuals(x) == pytest.approx(gap / 1e-3, rel=1e-6)
    by_fall, by_speed = 0.5 * fall / g, 0.5 * speed / g  # fall = sqrt(2/g) falls, the speed grows
    by_g = np.where(
        late < 0.0, -0.5 * times**2, e * (by_speed * late + speed * by_fall) - 0.5 * late**2 - g * late * by_fall
    )
    by_e = np.where(late < 0.0, 0.0, speed * late)
    np.testing.assert_allclose(
        problem.jacobian(x), np.column_stack([0.4 * by_e, 15.0 * by_g]) / 1e-3, rtol=1e-6, atol=1e-4
    )


def test_priors_derived_numbers_and_limits_are_residuals_with_slopes(ball):
    problem = Problem(
        ball,
        [
            Unknown(name="share", low=0.2, high=0.4, prior=Prior(0.25, 0.05)),
            Unknown(G, 5.0, 20.0, prior=Prior(9.81, factor=1.1)),
        ],
        [Reading(second_landing, 1.0, 0.1), Limit(first_landing, 0.01, high=0.4)],
        2.0,
        derived=lambda known: {E: 2.0 * known["share"]},
    )
    x = np.array([0.5, 0.4])
    e, g, fall = 0.6, 11.0, np.sqrt(2.0 / 11.0)
    assert problem.residuals(x) == pytest.approx(
        [(fall * (1.0 + 2.0 * e) - 1.0) / 0.1, (fall - 0.4) / 0.01, 1.0, np.log(g / 9.81) / np.log(1.1)], rel=1e-7
    )
    wanted = [
        [fall * 2.0 * 2.0 * 0.2 / 0.1, -0.5 * fall * (1.0 + 2.0 * e) / g * 15.0 / 0.1],
        [0.0, -0.5 * fall / g * 15.0 / 0.01],
        [0.2 / 0.05, 0.0],
        [0.0, 15.0 / (g * np.log(1.1))],
    ]
    np.testing.assert_allclose(problem.jacobian(x), wanted, rtol=1e-6, atol=1e-6)
    met = np.array([0.5, 1.0])
    assert problem.residuals(met)[1] == 0.0 and not problem.jacobian(met)[1].any()


def test_functions_of_runs_stand_beside_other_terms(ball):
    times, times_of = np.linspace(0.05, 0.4, 5), Reading(first_landing, 0.45, 1e-3)
    record = Samples("ball", times, 0.0 * times, "1 mm")
    unknowns = [Unknown(E, 0.5, 0.9), Unknown(G, 5.0, 20.0)]
    both = Problem(ball, unknowns, [lambda run: run.states(times).gap[0] / 1e-3, times_of, record], 1.0)
    x = np.array([0.5, 0.4])
    own, reading, same = np.split(both.residuals(x), [5, 6])
    assert np.array_equal(own, same) and reading.size == 1 and both.records == [slice(0, 5), slice(6, 11)]
    scene = trotter()
    walks = Problem(scene, {"ground.friction.coefficient": (0.3, 0.5)}, [Reading("mean_speed", 0.0, "1 mm/s")], 0.05)
    assert np.isfinite(walks.jacobian([0.45])).all()


@pytest.mark.parametrize(
    ("unknowns", "terms", "said"),
    [
        ([], [Reading("peak", 1.0, 1.0)], "unknowns: expected at least one"),
        ([Unknown(E + "s", 0.1, 0.2)], [Reading("peak", 1.0, 1.0)], f"did you mean '{E}'"),
        ([Unknown(E, 0.5, 0.4)], [Reading("peek", 1.0, 1.0)], "the range from 0.5 to 0.4 is empty"),
        ([Unknown(E, 0.0, 0.4, "log")], [Reading("peak", 1.0, 1.0)], "above 0 on a logarithmic scale"),
        ([Unknown(E, 0.5, 0.9, prior=Prior(0.6, -0.1))], [Reading("peak", 1.0, 1.0)], "expected a positive spread"),
        (
            [Unknown(G, 5, 20, unit="mm/s^2")],
            [Reading("peak", 1.0, 1.0)],
            "its numbers are in m/s^2; write '50 mm/s^2'",
        ),
        (
            [Unknown(E, 0.5, 0.9, prior=Prior(-0.6, 0.1))],
            [Reading("peak", 1.0, 1.0)],
            "a median between the bounds, got -0.6",
        ),
        ([Unknown(E, 0.5, 1.4)], [Reading("peek", 1.0, 1.0)], "did you mean 'peak'"),
        ([Unknown(E, 0.5, 0.9)], [0.1], "term 1 (float): expected a reading, samples"),
        ([Unknown(E, 0.5, 0.9)], [], "terms: expected at least one"),
        ([Unknown(E, 0.5, 0.9)], [Reading("peak", "1 V", 1.0)], "expected a length"),
        ([Unknown(E, 0.5, 0.9)], [Reading("peak", 1.0, 0.0)], "error: expected a number above 0"),
        ([Unknown(E, 0.5, 0.9)], [Reading("peak", 1.0, 1.0, {E: 0.6})], "is unknown, and a condition"),
        ([Unknown(E, 0.5, 0.9)], [Samples("bal", [0.1], [0.0], 1.0)], "did you mean 'ball'"),
        ([Unknown(E, 0.5, 0.9)], [Samples("ball", [0.2, 0.1], [0.0, 0.0], 1.0)], "times in order"),
        ([Unknown(E, 0.5, 0.9)], [Limit("peak", 1.0)], "expected a lower or an upper bound"),
        ([Unknown(name="free", low=0.5, high=0.9)], [Reading("peak", 1.0, 1.0)], "expected a path of the scene"),
    ],
)
def test_what_does_not_fit_is_told(ball, unknowns, terms, said):
    with pytest.raises(InputError) as error:
        Problem(ball, unknowns, terms, 1.0)
    assert said in str(error.value)
    assert len(error.value.problems) == (2 if said == "the range from 0.5 to 0.4 is empty" else 1)


def test_names_of_earlier_versions_are_answered():
    with pytest.raises(ImportError, match="pymoo_problem is gone; use"):
        ts.fit.pymoo_problem  # noqa: B018
    assert ts.fit.RunResiduals is Problem
