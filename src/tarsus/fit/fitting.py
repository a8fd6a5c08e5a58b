"""A scene fitted to data in one call: unknowns, what runs should do, and how sure the numbers are."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from tarsus.base.arrays import Floats
from tarsus.base.errors import InputError
from tarsus.files.library import SceneLike
from tarsus.fit.doubts import Doubts, as_deep, doubts_of
from tarsus.fit.input_noise import Inputs, input_errors, recorded_inputs
from tarsus.fit.least_squares import least_squares_from
from tarsus.fit.problem import Problem
from tarsus.fit.ranges import Range
from tarsus.fit.residuals import Found
from tarsus.fit.terms import RunFunction, Term
from tarsus.fit.unknowns import Ranges, Unknown, Unknowns
from tarsus.fit.verdict import verdict_of
from tarsus.model.scene import Scene
from tarsus.solve import Accuracy
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
lower depends on rounding."""
STARTS = 3
"""Starts of a descent: neighbouring valleys of runs whose events differ by one."""


@dataclass(frozen=True, repr=False)
class FitResult(Tabled):
    """A fitted scene: what was found, and the problem it was found for.

    doubts: what the residuals and the noise of inputs leave of its certainty; valleys: ends of other descents that are
    as good.
    """

    found: Found
    problem: Problem
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
    residuals: Sequence[Term] | RunFunction,
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
        A function that takes a `Run` and gives (model - data) / error, as many numbers of every run; or a list of such
        functions, records, readings and limits (`Samples`, `Reading`, `Limit`).
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


def _result(problem: Problem, every: Sequence[Found], asked: int, inputs: Inputs, seed: int) -> FitResult:
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
