"""Least squares of a fit with its Jacobian, from one start or from many side by side."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tarsus.base.arrays import Floats
from tarsus.fit.normal_equations import Descent, NormalEquations, descend
from tarsus.fit.residuals import Found, Residuals
from tarsus.fit.uncertainty import uncertainty_of

SETTLED = 1e-6
"""A descent ends where the next step is shorter than this part of a standard error: with slopes that are right to six
digits the last steps shrink a millionfold, so that six digits more than any interval shows cost one step."""


def least_squares(
    problem: Residuals, start: ArrayLike | None = None, rounds: int = 50, settled: float = SETTLED
) -> Found:
    """The least sum of squared residuals by damped Gauss-Newton steps with the problem's Jacobian, within its bounds.

    Parameters
    ----------
    problem
        What is fitted.
    start
        Point (nu,) of the unit cube of the unknowns, its middle unless given.
    rounds
        Steps tried at most.
    settled
        It ends where the next step is shorter than so many standard errors.

    Returns
    -------
    Found
        The point, its values [SI], its cost, and standard errors with correlations.

    Examples
    --------
    >>> import tarsus as ts
    >>> scene = ts.with_values(ts.load_scene("cantilever"), {"robot.feet.tip.gap": "71 um"})
    >>> times = [2e-4, 5e-4, 8e-4]
    >>> record = ts.simulate(scene, 4e-3).states(times).gap[0]
    >>> problem = ts.fit.Problem(scene, [ts.fit.Unknown("robot.feet.tip.gap", "60 um", "80 um")],
    ...                          [ts.fit.Samples("tip", times, record, error="0.1 um")], duration=4e-3)
    >>> found = ts.fit.least_squares(problem)
    >>> bool(abs(found.values["robot.feet.tip.gap"] - 71e-6) < 1e-9)
    True
    >>> found.uncertainty.errors["robot.feet.tip.gap"] < 1e-7
    True
    """
    return least_squares_from(problem, problem.point(start)[None], rounds, settled)[0]


def least_squares_from(
    problem: Residuals, starts: ArrayLike, rounds: int = 50, settled: float = SETTLED
) -> list[Found]:
    """The same from several starts (n, nu), points of the unit cube, whose trials share a batch; in their order."""
    own = np.array([problem.point(one) for one in np.atleast_2d(np.asarray(starts, dtype=float))])
    asked, slopes = np.zeros(len(own), dtype=int), np.zeros(len(own), dtype=int)
    last: dict[int, Floats] = {}
    there: dict[int, Floats] = {}

    def costs(points: Floats, _: Floats, part: NDArray[np.intp]) -> Floats:
        asked[part] += 1
        found = problem.residuals_at(points)
        last.update(zip(part.tolist(), found, strict=True))
        return (found**2).sum(axis=1)

    def equations(points: Floats, _: Floats, part: NDArray[np.intp]) -> NormalEquations:
        if any(number not in last for number in part.tolist()):
            costs(points, _, part)
        there.update((number, problem.jacobian(one)) for number, one in zip(part.tolist(), points, strict=True))
        slopes[part] += 1
        numbers = part.tolist()
        return NormalEquations.of([last[k] for k in numbers], [there[k] for k in numbers], len(problem.unknowns))

    low, high = problem.bounds
    end = descend(equations, own, costs=costs, how=Descent(rounds, settled, low=low, high=high))
    out = []
    for n, (x, cost) in enumerate(zip(end.own, end.equations.cost, strict=True)):
        sure = uncertainty_of(there[n], problem.unknowns, x)
        why = "settled" if end.settled[n] else f"ended after {end.rounds} rounds"
        out.append(Found(x, problem.values(x), 0.5 * float(cost), int(asked[n]), int(slopes[n]), why, sure))
    return out
