"""A scene fitted to data in one call: unknowns, what runs should do, and how sure the numbers are."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tarsus.base.errors import InputError
from tarsus.files.library import SceneLike
from tarsus.fit.least_squares import least_squares_from
from tarsus.fit.problem import Problem
from tarsus.fit.ranges import Range
from tarsus.fit.residuals import FAILED, Found
from tarsus.fit.terms import OfRun, Term
from tarsus.fit.unknowns import Unknown
from tarsus.fit.verdict import verdict_of
from tarsus.model.scene import Scene
from tarsus.solve.engine import Accuracy
from tarsus.solve.run import Run
from tarsus.tables import Column, Table
from tarsus.tables.table import ROW

Floats = NDArray[np.float64]

NORMAL = 1.959964
"""Standard errors to either side that hold 95 % of a normal distribution."""
EVEN = 16
"""Points for each unknown, spread evenly, of which the best are starts: of a cost with one valley in a quarter of the
range of each of two unknowns, 32 points miss it in one case of nine."""
STARTS = 3
"""Starts of a descent: neighbouring valleys of runs whose events differ by one."""


@dataclass(frozen=True)
class FitResult:
    """A fitted scene: what was found, and the problem it was found for."""

    found: Found
    problem: Problem

    @property
    def values(self) -> dict[str, float]:
        """Best value of each unknown [SI], by name."""
        return self.found.values

    @property
    def cost(self) -> float:
        """Half the sum of the squared residuals."""
        return self.found.cost

    @property
    def scene(self) -> Scene:
        """The scene with the best values."""
        return self.problem.scene_at(self.found.x)

    @property
    def correlations(self) -> Floats:
        """Correlations (nu, nu) of the unknowns; NaN in the rows of those that the data do not determine."""
        assert self.found.uncertainty is not None
        return self.found.uncertainty.correlations

    @property
    def ranges(self) -> tuple[Range, ...]:
        """Of each unknown its value, its 95 % interval by the curvature of the cost, open where a bound cuts it or the
        data set no end, and the verdict."""
        assert self.found.uncertainty is not None
        unknowns, errors = self.problem.unknowns, self.found.uncertainty.errors
        slopes = np.abs(unknowns.slopes(self.found.x))
        out = []
        for i, (name, x) in enumerate(zip(unknowns.names, self.found.x.tolist(), strict=True)):
            half = NORMAL * errors[name] / slopes[i]
            ends = np.repeat(self.found.x[None], 2, axis=0)
            ends[:, i] = np.clip([x - half, x + half], 0.0, 1.0)
            cut = x - half <= 0.0, x + half >= 1.0
            low, high = unknowns.values(ends)[:, i].tolist()
            verdict = verdict_of((low, high), cut, size=unknowns.sizes[i])
            low, high = -np.inf if cut[0] else low, np.inf if cut[1] else high
            value = self.values[name]
            out.append(Range(value, low, high, name=name, unit=unknowns.units[i], verdict=verdict))
        return tuple(out)

    def table(self) -> Table:
        """Best values, intervals and verdicts."""
        columns = ("unknown", Column("best", ROW), "95 % interval", "the data say")
        ranges = self.ranges
        rows = [
            (one.name, one.value, one.text(), one.verdict.value if one.verdict else None) for one in ranges
        ]
        notes = (f"cost {self.cost:.4g}; {self.found.evaluations} runs; {self.found.message}",)
        notes += tuple(
            f"{name}: no number in the best run; a residual of {FAILED:g} stands for it"
            for name in self.problem.absent(self.found.x[None])
        )
        notes += () if self.found.uncertainty is None else self.found.uncertainty.notes
        return Table("fit", columns, rows, notes, units=[one.unit for one in ranges])

    def to_dict(self) -> dict[str, object]:
        """All of it as plain data, SI."""
        return {
            "cost": self.cost,
            "unknowns": {
                one.name: {
                    "best": one.value, "low": one.low, "high": one.high, "unit": one.unit,
                    "determined": one.verdict.value if one.verdict else None,
                }
                for one in self.ranges
            },
        }  # fmt: skip

    def __str__(self) -> str:
        return self.table().text()

    def _repr_html_(self) -> str:
        return self.table().html()


def fit(
    scene: SceneLike,
    unknowns: Sequence[Unknown],
    residuals: Sequence[Term] | Callable[[Run], ArrayLike],
    duration: float | str | None = None,
    *,
    accuracy: Accuracy | None = None,
    seed: int = 1,
) -> FitResult:
    """Fit numbers of a scene to data: least squares from the best of points spread evenly over the bounds.

    Parameters
    ----------
    scene
        The scene, or a device's name or a scene file's path.
    unknowns
        Numbers of it with their bounds.
    residuals
        Records, readings and limits (`Samples`, `Reading`, `Limit`), which have exact derivatives; or a function that
        takes a `Run` and gives (model - data) / error, as many numbers of every run.
    duration
        Of every run [s], or a text with a unit; the scene's own by default.
    accuracy
        Of every run.
    seed
        Of the points to start from.

    Returns
    -------
    FitResult
        Values, ranges with verdicts, correlations, the scene, and `.table()`.

    Raises
    ------
    InputError
        With everything that does not fit, and with every residual that is no number in any run over the bounds.

    Examples
    --------
    >>> import numpy as np
    >>> import tarsus as ts
    >>> times = np.linspace(0.0, 4e-3, 20)
    >>> truth = ts.with_values(ts.load_scene("cantilever"), {"robot.feet.tip.gap": "71 um"})
    >>> record = ts.simulate(truth, 4e-3).states(times).gap[0]
    >>> gap = ts.Unknown("robot.feet.tip.gap", "60 um", "80 um")
    >>> found = ts.fit("cantilever", [gap], [ts.fit.Samples("tip", times, record, "0.1 um")], "4 ms")
    >>> print(f"{1e6 * found.values['robot.feet.tip.gap']:.3f} um, {found.ranges[0].verdict}")
    71.000 um, determined
    """
    terms = [OfRun(residuals)] if callable(residuals) else residuals
    problem = Problem(scene, unknowns, terms, duration, accuracy)
    points = problem.unknowns.draws(EVEN * len(problem.unknowns), seed)
    costs = problem.costs(points)
    if absent := problem.absent(points):
        raise InputError(
            [f"{name}: no number in any of {len(points)} runs over the bounds" for name in absent]
        )
    starts = points[np.argsort(costs, kind="stable")[:STARTS]]
    every = least_squares_from(problem, starts)
    best = min(every, key=lambda one: one.cost)
    asked = len(points) + sum(one.evaluations for one in every)
    return FitResult(
        Found(best.x, best.values, best.cost, asked, best.slopes, best.message, best.uncertainty), problem
    )
