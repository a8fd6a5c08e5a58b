"""A scene fitted to data in one call: unknowns, what runs should do, and how sure the numbers are."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from copy import copy
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from tarsus.base.arrays import Floats
from tarsus.base.errors import InputError
from tarsus.base.spec import with_values
from tarsus.files.library import SceneLike, as_scene
from tarsus.fit.doubts import Doubts, as_deep, doubts_of
from tarsus.fit.input_noise import Inputs, input_errors, recorded_inputs
from tarsus.fit.least_squares import least_squares_from
from tarsus.fit.problem import Problem
from tarsus.fit.ranges import Range
from tarsus.fit.residuals import FAILED, Found, Residuals, RunsTried, differences
from tarsus.fit.terms import Term
from tarsus.fit.unknowns import Ranges, Unknown, Unknowns
from tarsus.fit.verdict import verdict_of
from tarsus.model.scene import Scene, seconds_of
from tarsus.solve import SINGLE_RUN, Accuracy, Run, Shared, simulate_batch
from tarsus.tables.table import ROW, Column, Table, Tabled

NORMAL = 1.959964
"""Standard errors to either side that hold 95 % of a normal distribution."""
EVEN = 16
"""Points for each unknown, spread evenly, of which the best are starts: of a cost with one valley in a quarter of the
range of each of two unknowns, 32 points miss it in one case of nine."""
LEVEL = 1e-9
"""Costs that differ by less than this part lie on one plateau: rounding leaves as much of runs that are the same."""
ALIKE = 1e-9
"""Costs that differ by less lie within 5e-5 of a standard deviation: of such descents the first is taken, for which is
lower hangs on rounding."""
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
        self.seconds, self.accuracy, self._shared = (seconds_of(self.scene, duration), accuracy or SINGLE_RUN, Shared())
        self.tried, self._count = RunsTried(), 1
        self._priors = np.array([one is not None for one in self.unknowns.priors])

    @property
    def records(self) -> list[slice]:
        """Rows of the residuals in the order that the function gives them in: all of a run's."""
        return [slice(0, self._count)]

    def scene_at(self, x: ArrayLike) -> Scene:
        """The scene at a point (nu,) of the cube."""
        return with_values(self.scene, self.unknowns.by_path(self.unknowns.values(self.point(x))))

    def on(self, scene: Scene) -> RunResiduals:
        """The same of another scene."""
        other = copy(self)
        other.scene = scene
        return other

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
    """A fitted scene: what was found, and the problem it was found for.

    doubts: what the residuals and the noise of inputs leave of its certainty; valleys: ends of other descents that are
    as good.
    """

    found: Found
    problem: Problem | RunResiduals
    doubts: Doubts
    valleys: tuple[Found, ...] = ()

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
        """Of each unknown its value, its 95 % interval and the verdict.

        The interval is that of the curvature of the cost, widened by the doubts, about every valley that is as deep;
        it is open where a bound cuts it or the data set no end. A number that the model misses by more than the stated
        errors say is preferred, and not determined.
        """
        unknowns, doubts = self.problem.unknowns, self.doubts
        out = []
        for i, name in enumerate(unknowns.names):
            halves = [(float(self.found.x[i]), NORMAL * doubts.errors[i])]
            halves += [(float(one.x[i]), NORMAL * float(stated_errors(one, unknowns)[i])) for one in self.valleys]
            first = min(x - half for x, half in halves)
            last = max(x + half for x, half in halves)
            ends = np.repeat(self.found.x[None], 2, axis=0)
            ends[:, i] = np.clip([first, last], 0.0, 1.0)
            cut = first <= 0.0, last >= 1.0
            low, high = unknowns.values(ends)[:, i].tolist()
            verdict = verdict_of((low, high), cut, size=unknowns.sizes[i], doubted=bool(doubts.failed[i]))
            low, high = -np.inf if cut[0] else low, np.inf if cut[1] else high
            value = self.values[name]
            out.append(Range(value, low, high, name=name, unit=unknowns.units[i], verdict=verdict))
        return tuple(out)

    def table(self) -> Table:
        """Best values, intervals and verdicts."""
        columns = ("unknown", Column("best", ROW), "95 % interval", "the data say")
        ranges = self.ranges
        rows = [(one.name, one.value, one.text(), one.verdict.value if one.verdict else None) for one in ranges]
        notes = (f"cost {self.cost:.4g}; {self.found.evaluations} runs; {self.found.message}",)
        notes += () if self.found.uncertainty is None else self.found.uncertainty.notes
        notes += self.doubts.notes
        if self.valleys:
            count = len(self.valleys)
            notes += (f"{count} of {STARTS} descents ended elsewhere as deep: intervals reach over their ends",)
        if stopped := self.problem.tried.sentence():
            notes += (f"{stopped}: they count as far from the data, and the fit keeps to where runs do.",)
        return Table("fit", columns, rows, notes, units=[one.unit for one in ranges])

    def to_dict(self) -> dict[str, object]:
        """All of it as plain data, SI."""
        return {
            "cost": self.cost,
            "doubts": list(self.doubts.notes),
            "unknowns": {
                one.name: {
                    "best": one.value,
                    "low": one.low,
                    "high": one.high,
                    "unit": one.unit,
                    "determined": one.verdict.value if one.verdict else None,
                }
                for one in self.ranges
            },
        }


def fit(
    scene: SceneLike,
    unknowns: Sequence[Unknown] | Ranges,
    residuals: Sequence[Term] | Callable[[Run], ArrayLike],
    duration: float | str | None = None,
    *,
    accuracy: Accuracy | None = None,
    seed: int = 1,
    noise: Mapping[str, float | str] | None = None,
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
    noise
        Of recorded inputs: standard deviation of every sample, by the path of a `sampled` signal. Intervals are widened
        by what the numbers move with it.

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
    inputs = recorded_inputs(problem.scene, noise or {})
    points = problem.unknowns.draws(EVEN * len(problem.unknowns), seed)
    costs = problem.costs(points)
    if problem.tried.stopped.total() == problem.tried.count:
        raise InputError([f"{problem.tried.sentence()}: nothing is fitted; look at one with ts.simulate"])
    starts = points[_starts(costs)]
    every = least_squares_from(problem, starts)
    asked = len(points) + sum(one.evaluations for one in every)
    return _result(problem, every, asked, inputs, seed)


def _result(
    problem: Problem | RunResiduals, every: Sequence[Found], asked: int, inputs: Inputs, seed: int
) -> FitResult:
    """The best of all descents, with its doubts, and those of the others that are as deep and lie elsewhere."""
    least = min(one.cost for one in every)
    best = next(one for one in every if one.cost <= least + ALIKE)
    left, errors = problem.residuals(best.x), stated_errors(best, problem.unknowns)
    if inputs:
        errors = np.hypot(errors, input_errors(problem, best.x, inputs, seed))
    doubts = doubts_of(left, problem.jacobian(best.x), problem.records, errors)
    scale = 2.0 * best.cost / max(len(left) - len(best.x), 1)
    near = (every[k] for k in as_deep([one.cost for one in every], best.cost, scale))
    valleys = tuple(one for one in near if np.any(np.abs(one.x - best.x) > NORMAL * errors))
    found = Found(best.x, best.values, best.cost, asked, best.slopes, best.message, best.uncertainty)
    return FitResult(found, problem, doubts, valleys)


def _starts(costs: Floats) -> list[int]:
    """The points of lowest cost to start from: of those on one plateau, whose costs are equal but for rounding, one."""
    order = np.argsort(costs, kind="stable")
    steps = np.diff(costs[order]) > LEVEL * np.abs(costs[order[1:]])
    first = np.concatenate([[True], steps])
    return order[first][:STARTS].tolist()


def stated_errors(found: Found, unknowns: Unknowns) -> Floats:
    """Standard errors (nu,) in the cube by the stated errors of the data; infinite of numbers that they do not tell."""
    assert found.uncertainty is not None
    return np.array(list(found.uncertainty.errors.values())) / np.abs(unknowns.slopes(found.x))
