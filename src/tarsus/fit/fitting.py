"""A scene fitted to data in one call: unknowns, what runs should do, and how sure the numbers are."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from tarsus.base.arrays import Floats
from tarsus.base.errors import InputError
from tarsus.base.spec import with_values
from tarsus.files.library import SceneLike, as_scene, seconds_of
from tarsus.fit.least_squares import least_squares_from
from tarsus.fit.problem import Problem
from tarsus.fit.ranges import Range
from tarsus.fit.residuals import FAILED, Found, Residuals, RunsTried, differences
from tarsus.fit.terms import Term
from tarsus.fit.unknowns import Ranges, Unknown, Unknowns
from tarsus.fit.verdict import verdict_of
from tarsus.model.scene import Scene
from tarsus.solve import SINGLE_RUN, Accuracy, Run, Shared, simulate_batch
from tarsus.tables.table import ROW, Column, Table, Tabled

NORMAL = 1.959964
"""Standard errors to either side that hold 95 % of a normal distribution."""
EVEN = 16
"""Points for each unknown, spread evenly, of which the best are starts: of a cost with one valley in a quarter of the
range of each of two unknowns, 32 points miss it in one case of nine."""
STARTS = 3
"""Starts of a descent: neighbouring valleys of runs whose events differ by one."""


class RunResiduals(Residuals):
    """Residuals that a function makes of a run, in units of their errors; their Jacobian by differences of runs.

    Parameters
    ----------
    scene, unknowns, duration, accuracy
        As `Problem` takes them.
    function
        Takes a `Run`, gives residuals (nr,): as many of every run.
    """

    def __init__(
        self,
        scene: SceneLike,
        unknowns: Sequence[Unknown] | Ranges,
        function: Callable[[Run], ArrayLike],
        duration: float | str | None = None,
        accuracy: Accuracy | None = None,
    ) -> None:
        self.scene, self.function = as_scene(scene), function
        self.unknowns = Unknowns.of(self.scene, unknowns)
        if any(not own for own in self.unknowns.targets):
            raise InputError("unknowns: expected a path of the scene for each")
        self.seconds, self.accuracy, self._shared = (
            seconds_of(self.scene, duration),
            accuracy or SINGLE_RUN,
            Shared(),
        )
        self.tried, self._count = RunsTried(), 1
        self._priors = np.array([one is not None for one in self.unknowns.priors])

    def scene_at(self, x: ArrayLike) -> Scene:
        """The scene at a point (nu,) of the cube."""
        return with_values(self.scene, self.unknowns.by_path(self.unknowns.values(self.point(x))))

    def residuals_at(self, points: Floats) -> Floats:
        if not len(points):
            return np.zeros((0, 0))
        values = self.unknowns.values(points)
        vary = {path: values[:, i] for i, own in enumerate(self.unknowns.targets) for path in own}
        batch = simulate_batch(self.scene, vary, self.seconds, accuracy=self.accuracy, shared=self._shared)
        self.tried.note(batch)
        made = {
            i: np.atleast_1d(np.asarray(self.function(batch.run(i)), dtype=float))
            for i in np.flatnonzero(batch.done).tolist()
        }
        counts = {len(one) for one in made.values()} or {self._count}
        if len(counts) > 1:
            raise InputError("residuals: expected as many numbers of every run")
        (self._count,) = counts
        rows = np.full((len(points), self._count), np.nan)
        for i, one in made.items():
            rows[i] = one
        absent = np.flatnonzero(np.isnan(rows[batch.done]).all(axis=0)) if made else ()
        if len(absent):
            numbers = ", ".join(str(k + 1) for k in absent)
            raise InputError(f"residuals: number {numbers} is NaN in all of {len(made)} runs")
        priors = self.unknowns.prior_residuals(points)[:, self._priors]
        return np.concatenate([np.where(np.isfinite(rows), rows, FAILED), priors], axis=1)

    def jacobian(self, x: ArrayLike) -> Floats:
        return differences(self.residuals_at, self.point(x), np.arange(len(self.unknowns)))


@dataclass(frozen=True)
class FitResult(Tabled):
    """A fitted scene: what was found, and the problem it was found for."""

    found: Found
    problem: Problem | RunResiduals

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
        notes += () if self.found.uncertainty is None else self.found.uncertainty.notes
        if stopped := self.problem.tried.sentence():
            notes += (f"{stopped}: they count as far from the data, and the fit keeps to where runs do.",)
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


def fit(
    scene: SceneLike,
    unknowns: Sequence[Unknown] | Ranges,
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
        Numbers of it with their bounds, each an `Unknown`; or bounds by path or short word, ``{"volts": (5, 7)}``.
    residuals
        Records, readings and limits (`Samples`, `Reading`, `Limit`), which have derivatives; or a function that
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
        With everything that does not fit, and where no run at the points to start from reaches its end.

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
    if callable(residuals):
        problem: Problem | RunResiduals = RunResiduals(scene, unknowns, residuals, duration, accuracy)
    else:
        problem = Problem(scene, unknowns, residuals, duration, accuracy)
    points = problem.unknowns.draws(EVEN * len(problem.unknowns), seed)
    costs = problem.costs(points)
    if problem.tried.stopped.total() == problem.tried.count:
        raise InputError([f"{problem.tried.sentence()}: nothing is fitted; look at one with ts.simulate"])
    starts = points[np.argsort(costs, kind="stable")[:STARTS]]
    every = least_squares_from(problem, starts)
    best = min(every, key=lambda one: one.cost)
    asked = len(points) + sum(one.evaluations for one in every)
    return FitResult(
        Found(best.x, best.values, best.cost, asked, best.slopes, best.message, best.uncertainty), problem
    )
