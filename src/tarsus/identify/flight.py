"""Segments of records that fly free from a moment at which the state has few unknowns, fitted together.

At an impact, and at a release, the foot is on the ground, so that the state there has few unknowns: the moment, where
the rest of the structure is, and how fast; before its drive begins a device is at rest. From such a moment the
structure flies free under the drive's force and those at the foot (`tarsus.solve.flights`): onward, and back to what
was before. What every segment has of its own is eliminated (`tarsus.fit.normal_equations`); what is left are the
constants of the ground, which all share.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from copy import copy
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Self

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import null_space

from tarsus.base.arrays import Floats
from tarsus.base.errors import InputError
from tarsus.fit.normal_equations import Descent, Minimum, NormalEquations, descend
from tarsus.identify.covariance import scattered
from tarsus.identify.draws import DRAWS, carried
from tarsus.identify.estimates import Estimates
from tarsus.identify.foot import FootModel
from tarsus.identify.influence import EVENT, Influence, events_of, of_records
from tarsus.identify.step import Panel, Residual, StepResult, measured_and_fitted, over_noise
from tarsus.identify.traces import Hold, Trace
from tarsus.identify.volts import Stretches
from tarsus.solve import SUBSTEPS, Flow, Launches, Varied
from tarsus.tables.numbers import amount

FILM = ("ground.film.coefficient", "ground.film.thickness")
PULLS = ("ground.adhesion.initial", "ground.adhesion.rate")
ATTRACTION = ("ground.electrostatic.coefficient", "ground.electrostatic.offset")

WORST = 5.0
"""Chi-squared per degree of freedom beyond which a flight is not that of this structure."""
SAME_EVENT = 2e-3
"""Time [s] within which releases of two repeats are the same event: the foot is released at nearly the same volts."""
_REACH = 8
"""Samples next to a flight in which its moment may lie: more than a guess ever errs."""
_LIMITS = (np.log(1e-30), np.log(1.0))
"""Logarithms of constants [SI] within which exponentials neither overflow nor underflow; no film or attraction of the
field comes near."""


def ground_constants(model: FootModel) -> Floats:
    """Constants (5,) of the forces at the foot, as flights take them: C, g0, C_e, g_e and the film's exponent; a law
    that the ground has not damps and pulls nothing."""
    ground, out = model.scene.ground.acting, np.array([0.0, 1.0, 0.0, 1.0, 3.0])
    if ground.film is not None:
        out[:2] = ground.film.coefficient, ground.film.thickness
    if ground.electrostatic is not None:
        out[2:4] = ground.electrostatic.coefficient, ground.electrostatic.offset
    return out


def known_law(model: FootModel) -> Varied:
    """The same as flights take it that share no unknown."""
    return Varied(ground_constants(model), np.zeros((5, 0)))


@dataclass(frozen=True)
class FlightParameters:
    """Constants of the ground that flights tell, by p unknowns.

    names (k): paths of the constants; ways (k, p): their logarithms are ``ways @ unknowns``; centre (p,), information
    (p, p): what is known of the unknowns beforehand; low, high (p,): between which flights feel them.
    """

    names: tuple[str, ...]
    ways: Floats
    centre: Floats
    information: Floats
    low: Floats | float = -np.inf
    high: Floats | float = np.inf

    def constants(self, place: Floats) -> Floats:
        """The constants (..., k) [SI] at unknowns (..., p)."""
        return np.exp(np.clip(place @ self.ways.T, *_LIMITS))

    def law(self, model: FootModel, place: Floats) -> Varied:
        """Forces at a model's foot (5,) at unknowns (p,), with derivatives by these."""
        value, slopes = ground_constants(model), np.zeros((5, len(place)))
        at = [(*FILM, *ATTRACTION).index(name) for name in self.names]
        inside = np.clip(place, self.low, self.high)
        value[at] = self.constants(inside)
        slopes[at] = value[at][:, None] * self.ways * (inside == place)
        return Varied(value, slopes)

    def combinations(self, gap: float, place: Floats, drawn: Floats) -> dict[str, tuple[float, Floats, str]]:
        """What records tell better than the constants alone, damping and attraction at a gap [m], from unknowns (p,)
        and their draws (draws, p)."""
        out: dict[str, tuple[float, Floats, str]] = {}
        at = f" at g = {1e6 * gap:.3g} um" if gap else ""
        for path, power, label, unit in ((FILM[0], 3, "C", "N s/m"), (ATTRACTION[0], 2, "C_e", "N/V^2")):
            if path not in self.names:
                continue
            k, length = self.names.index(path), {3: "g0", 2: "g_e"}[power]
            value, draws = (
                one[..., k] / (gap + one[..., k + 1]) ** power for one in (self.constants(place), self.constants(drawn))
            )
            below = f"(g + {length})^{power}{at}" if gap else f"{length}^{power}"
            out[f"{label} / {below}"] = float(value), draws, unit
        return out

    def wide(self, name: str, seed: int) -> StepResult:
        """The constants as unknowns that no record shows: draws as wide as what is known beforehand."""
        spread = np.linalg.cholesky(np.linalg.inv(self.information))
        drawn = self.centre + np.random.default_rng([seed, 31]).standard_normal((DRAWS, len(spread))) @ spread.T
        return StepResult(
            name,
            self.names,
            self.constants(self.centre),
            self.constants(drawn),
            taken=self.names,
            combinations=self.combinations(0.0, self.centre, drawn),
        )


NO_HOLD = Hold(0, -1)
"""Of no sample."""


@dataclass(frozen=True)
class SegmentStart:
    """A moment in a record from which flights go: the last sample before it, how many samples are used before and after
    it, and the stretch in which the foot stood still before, of a detachment."""

    trace: int
    last: int
    before: int
    after: int
    hold: Hold = NO_HOLD

    @property
    def first(self) -> int:
        """First sample after it."""
        return self.last + 1


@dataclass(frozen=True)
class FlightSide:
    """Flights to one side of moments.

    back: to what was before; rates (2n, q): of the state at the moment by the unknowns; begin [s]: the moment is
    begin[0] + begin[1] times the first unknown after the first sample of this side; offset (2, q): rates of a force
    added to the drive's at the first sample [N], and of its drift [N/s].
    """

    rates: Floats
    begin: tuple[float, float]
    back: bool = False
    offset: Floats | None = None


class FlightProblem:
    """Segments of records about moments, flown by a model.

    The unknowns (nr, q) of each: the moment [s], places (m,) and velocities (m,) of the coordinates that a foot on the
    ground leaves free, and what its kind has besides.

    Parameters
    ----------
    traces
        The records.
    items
        Their moments.
    level
        Contact level from the rest [m].
    model
        Structure, drive and ground.

    Raises
    ------
    InputError
        Without moments, and for records that are sampled at different rates.
    """

    def __init__(self, traces: Sequence[Trace], items: Sequence[SegmentStart], level: float, model: FootModel) -> None:
        self.traces, self.level = tuple(traces), level
        self.volts = {k: self.traces[k].between for k in {one.trace for one in items}}
        self.stretches: Stretches | None = None
        self._prepare(items, model)

    def _prepare(self, items: Sequence[SegmentStart], model: FootModel) -> None:
        """Everything that depends on model and moments, but not on the unknowns."""
        self.items, self.model = tuple(items), model
        if not items:
            raise InputError("none of the motions that these records show can be fitted")
        rates = {round(self.traces[one.trace].step, 12): self.traces[one.trace].file for one in items}
        if len(rates) > 1:
            named = ", ".join(f"{file} at {amount(1.0 / step, 'Hz', 6)}" for step, file in sorted(rates.items()))
            raise InputError(f"records that are fitted together are sampled at different rates: {named}")
        self.step = self.traces[items[0].trace].step
        self.free = null_space(model.row[None, :])
        self.grounded = -model.gap * model.row / float(model.row @ model.row)  # coordinates, the shortest ones
        self.output = np.asarray(np.kron(np.eye(2), model.rows), dtype=np.float64)
        self.sides = self.of_sides()
        steps = [(-1.0 if one.back else 1.0) * self.step / SUBSTEPS for one in self.sides]
        self.flows = [Flow(model.flow, model.inputs, model.row, step) for step in steps]
        self.counts = [np.array([one.before if s.back else one.after for one in items]) for s in self.sides]
        self.squares: Floats | None = None
        self.measured, self.noise = list[Floats](), list[Floats]()
        for one in items:
            trace, first = self.traces[one.trace], one.first - one.before
            part = slice(first, first + one.before + one.after)
            self.measured.append(np.concatenate([trace.x[:, part] + self.rest(trace)[:, None], trace.v[:, part]]))
            self.noise.append(np.concatenate([trace.noise_x, trace.noise_v]))
        pairs = list(zip(self.measured, (one.before for one in items), strict=True))
        self.seen = [
            np.concatenate([seen[:, :n][:, ::-1].T if side.back else seen[:, n:].T for seen, n in pairs])
            for side in self.sides
        ]
        self.weights = [np.repeat(1.0 / np.array(self.noise), counts, axis=0) for counts in self.counts]
        self._drive()
        self.gaps = np.array([self.gap(self.traces[one.trace]) for one in items])

    def _drive(self) -> None:
        """Force of the drive along the flights, and next to their first samples; held before and after the record."""
        firsts = [max(one.first - one.before - _REACH, 0) for one in self.items]
        if self.stretches is None:
            self.stretches = Stretches(
                [
                    (self.volts[one.trace], first, one.last + 1 + one.after - first)
                    for one, first in zip(self.items, firsts, strict=True)
                ]
            )
        force, reach = self.stretches.force(self.model.law, self.model.history), SUBSTEPS * _REACH
        low, high = (ends[:, None] for ends in self.stretches.ends)
        begun = np.array([one.first for one in self.items])[:, None] - np.array(firsts)[:, None]
        self.drive, self.near = list[Floats](), list[Floats]()
        for side, counts in zip(self.sides, self.counts, strict=True):
            way = -1 if side.back else 1
            at = low + SUBSTEPS * (begun - side.back)
            along = at + way * np.arange(SUBSTEPS * (int(counts.max()) - 1) + 1)
            near = at + way * np.arange(-reach, 1)
            self.drive.append(force[np.clip(along, low, high)])
            self.near.append(force[np.clip(near, low, high)])

    def squared(self) -> Floats:
        """Squared volts (nr, steps + 1) [V^2] along the flights onward."""
        out = np.zeros_like(self.drive[-1])
        for r, one in enumerate(self.items):
            level = self.volts[one.trace].fine[SUBSTEPS * one.first :][: out.shape[1]]
            out[r, : len(level)] = level**2
        return out

    def by(self, model: FootModel, level: float | None = None) -> Self:
        """The same by another model, and above a ground at another level [m]."""
        out = copy(self)
        out.level = self.level if level is None else level
        out._prepare(self.items, model)
        return out

    def among(self, traces: Sequence[Trace], level: float, model: FootModel) -> tuple[Self, NDArray[np.bool_]]:
        """The moments in other records of the same files, and which of them (nr,) are there."""
        places = {one.file: k for k, one in enumerate(traces)}
        at = [places.get(self.traces[one.trace].file, -1) for one in self.items]
        items = [replace(one, trace=k) for one, k in zip(self.items, at, strict=True) if k >= 0]
        return type(self)(traces, items, level, model), np.array(at) >= 0

    def of(self, items: Sequence[SegmentStart]) -> Self:
        """The same of other moments of the same records."""
        out = copy(self)
        out.stretches = None
        out._prepare(items, self.model)
        return out

    def chosen(self, keep: NDArray[np.bool_]) -> Self:
        """Some of the segments."""
        return self.of([one for one, yes in zip(self.items, keep, strict=True) if yes])

    def files(self, keep: NDArray[np.bool_] | None = None) -> frozenset[str]:
        """Files of which there is a segment, or one of some."""
        kept = np.ones(len(self.items), dtype=bool) if keep is None else keep
        return frozenset(self.traces[one.trace].file for one, yes in zip(self.items, kept, strict=True) if yes)

    def of_sides(self) -> tuple[FlightSide, ...]:
        """To which sides flights go, earlier samples first."""
        raise NotImplementedError

    def rest(self, trace: Trace) -> Floats:
        """Displacements (np,) [m] of the points from the neutral position where those of a record are zero."""
        return self.model.rest(self.level)

    def gap(self, trace: Trace) -> float:
        """Gap at the neutral position in a record [m]."""
        return self.model.gap

    def states(self, unknowns: Floats, side: int = -1) -> Floats:
        """States (nr, 2n) at the moments."""
        base = np.concatenate([self.grounded, np.zeros(len(self.grounded))])
        return base + unknowns @ self.sides[side].rates.T

    def launches(self, unknowns: Floats, law: Varied, part: NDArray[np.intp] | slice, side: int = -1) -> Launches:
        """Flights of these numbers to one side, with derivatives by their unknowns and those p of the law (5,)."""
        one, (count, q) = self.sides[side], unknowns.shape
        assert law.slopes is not None
        offset = np.zeros((2, q)) if one.offset is None else one.offset
        begin = one.begin[0] + one.begin[1] * unknowns[:, :1].sum(axis=1)
        return Launches(
            Varied(self.states(unknowns, side), one.rates),
            Varied(begin, one.begin[1] * np.eye(1, q)[0]),
            Varied(unknowns @ offset.T, offset),
            Varied(np.tile(law.value, (count, 1)), np.pad(law.slopes, ((0, 0), (q, 0)))),
            self.gaps[part],
            self.near[side][part],
            self.flows[side].step,
        )

    def _flown(
        self, k: int, unknowns: Floats, law: Varied, part: NDArray[np.intp]
    ) -> tuple[Floats, Floats, list[slice]]:
        """Of side k of the segments of these numbers, one flight after the other from its moment on: slopes of what is
        flown and, last, what was measured less it (samples, channels, q + p + 1), over the noise; the flights (samples,
        channels); and which samples are each segment's."""
        counts, every = self.counts[k][part], len(part) == len(self.items)
        chosen = slice(None) if every else part
        squares = None if self.squares is None else self.squares[chosen]
        launches = self.launches(unknowns, law, chosen, k)
        values, slopes = self.flows[k].fly(launches, self.drive[k][chosen], counts, self.output, squares)
        ends = np.cumsum(counts)
        seen, weight = self.seen[k], self.weights[k]
        if not every:
            at = np.arange(len(values)) + np.repeat(np.cumsum(self.counts[k])[part] - ends, counts)
            seen, weight = seen[at], weight[at]
        both = np.empty((*values.shape, slopes.shape[2] + 1))
        np.multiply(slopes, weight[:, :, None], out=both[:, :, :-1])
        np.multiply(seen - values, weight, out=both[:, :, -1])
        own = [slice(end - count, end) for end, count in zip(ends.tolist(), counts.tolist(), strict=True)]
        return both, values, own

    def flown(self, unknowns: Floats, law: Varied) -> tuple[list[Floats], list[Floats], list[Floats]]:
        """What was measured less what is flown, over the noise (channels, samples), slopes (q + p, channels times
        samples) of what is flown, and the flights (channels, samples)."""
        every = np.arange(len(self.items))
        sides = [self._flown(k, unknowns, law, every) for k in range(len(self.sides))]
        turns = [-1 if side.back else 1 for side in self.sides]
        left, rows, flights = list[Floats](), list[Floats](), list[Floats]()
        for r in every.tolist():
            parts = [
                (both[own[r]][::turn], v[own[r]][::turn]) for (both, v, own), turn in zip(sides, turns, strict=True)
            ]
            both, values = (np.concatenate(some) for some in zip(*parts, strict=True))
            left.append(both[:, :, -1].T)
            rows.append(both[:, :, :-1].transpose(2, 1, 0).reshape(both.shape[2] - 1, -1))
            flights.append(values.T)
        return left, rows, flights

    def equations(self, unknowns: Floats, law: Varied, part: NDArray[np.intp] | None = None) -> NormalEquations:
        """Normal equations of the segments of these numbers, which share the unknowns of the law."""
        part = np.arange(len(self.items)) if part is None else part
        assert law.slopes is not None
        q, size = unknowns.shape[1], unknowns.shape[1] + law.slopes.shape[1]
        products = np.zeros((len(part), size + 1, size + 1))  # of the slopes and, last, of what is left
        for k in range(len(self.sides)):
            both, _, own = self._flown(k, unknowns, law, part)
            for r, one in enumerate(own):
                rows = both[one].reshape(-1, size + 1)
                products[r] += rows.T @ rows
        normal, right, cost = products[:, :-1, :-1], products[:, :-1, -1], products[:, -1, -1]
        count = np.array([self.measured[r].size - q for r in part], dtype=float)
        return NormalEquations.split(normal, right, cost, count, q)

    def alone(self, unknowns: Floats, law: Floats, how: Descent) -> Minimum:
        """Every segment by a descent of its own under a known law (5,)."""
        known = Varied(law, np.zeros((len(law), 0)))
        return descend(lambda own, _, part: self.equations(own, known, part), unknowns, how=how)

    def together(self, unknowns: Floats, parameters: FlightParameters, place: Floats, how: Descent) -> FlightFit:
        """All segments with what they share, from a place (p,)."""
        found = descend(
            lambda own, shared, part: self.equations(own, parameters.law(self.model, shared), part),
            unknowns,
            place,
            prior=(parameters.centre, parameters.information),
            how=how,
        )
        return FlightFit(self, parameters, found.own, found.shared, found.equations)


def equations_of(residuals: Sequence[Floats], slopes: Sequence[Floats], own: int) -> NormalEquations:
    """Of segments: what was measured less what was flown, and slopes (q + p, n) of the flights, over the noise."""
    return NormalEquations.of([-one.ravel() for one in residuals], [one.T for one in slopes], own)


@dataclass(frozen=True)
class FlightFit:
    """Segments fitted with what they share: own unknowns (nr, q); place (p,) of the shared ones; system: normal
    equations there."""

    problem: FlightProblem
    parameters: FlightParameters
    unknowns: Floats
    place: Floats
    system: NormalEquations

    @cached_property
    def flown(self) -> tuple[list[Floats], list[Floats], list[Floats]]:
        """What `FlightProblem.flown` says of the segments: residuals over the noise, slopes and flights."""
        return self.problem.flown(self.unknowns, self.parameters.law(self.problem.model, self.place))

    @property
    def chi(self) -> Floats:
        """Chi-squared (nr,) per degree of freedom."""
        return self.system.cost / self.system.count

    def moved(self, model: FootModel, level: float) -> tuple[FlightProblem, Floats, Floats]:
        """The segments by a model, and above a ground [m], near the fitted ones, with their unknowns and place there:
        one Gauss-Newton step."""
        there, parameters = self.problem.by(model, level), self.parameters
        pull = parameters.information @ (parameters.centre - self.place)
        equations = there.equations(self.unknowns, parameters.law(model, self.place))
        own, step = equations.step(0.0, parameters.information, pull)
        return there, self.unknowns + own, self.place + step

    @property
    def influence(self) -> Influence:
        """What each segment says of the unknowns of the place."""
        problem = self.problem
        information, score = self.system.reduced()
        traces = [problem.traces[one.trace] for one in problem.items]
        when = [trace.time[one.last] for trace, one in zip(traces, problem.items, strict=True)]
        levels, covariates = of_records(problem.traces, [one.trace for one in problem.items])
        levels[EVENT] = events_of([one.set for one in traces], when, SAME_EVENT)
        names = tuple(f"unknown {k + 1}" for k in range(len(self.place)))
        return Influence(names, information, score, np.ones(len(names)), levels, covariates)

    def drawn(
        self, known: Estimates, level: Floats, seed: int, also: Callable[[FlightProblem, Floats], Floats] | None = None
    ) -> tuple[Floats, Floats]:
        """Deviations of the place (draws, p) by the scatter between records, and those by what earlier steps do not
        know, the level (draws,) [m] among it, the latter with those of further numbers of segments and their unknowns
        (draws, p + ...)."""
        nothing = np.zeros((DRAWS, 0))
        own = scattered(self.influence, seed, self.parameters.information) if self.parameters.names else nothing

        def again(values: Floats) -> Floats:
            there, unknowns, place = self.moved(known.model(values[:-1]), float(values[-1]))
            return place if also is None else np.concatenate([place, also(there, unknowns)])

        samples = np.column_stack([known.samples, level])
        return own, carried(again, np.append(known.values, self.problem.level), samples)

    def step(self, name: str, logs: Floats, gap: float, panels: tuple[Panel, ...]) -> StepResult:
        """What a step found: the constants with draws of the place (draws, p), and combinations at a gap [m]."""
        by_record: dict[int, list[Floats]] = {}
        for one, left in zip(self.problem.items, self.flown[0], strict=True):
            by_record.setdefault(one.trace, []).append(left.ravel())
        residuals: list[Residual] = [
            over_noise(self.problem.traces[k].file, np.concatenate(left)) for k, left in sorted(by_record.items())
        ]
        names = self.parameters.names
        return StepResult(
            name,
            names,
            self.parameters.constants(self.place),
            self.parameters.constants(logs),
            combinations=self.parameters.combinations(gap, self.place, logs),
            residuals=tuple(residuals),
            files=self.problem.files(),
            panels=panels,
            influence=self.influence.of(names, self.parameters.ways, self.parameters.constants(self.place))
            if names
            else None,
        )

    def panel(self, r: int, title: str, axis: str, since: float) -> Panel:
        """Gap of a segment, measured and fitted, over the time [s] since a moment of the record."""
        problem, one = self.problem, self.problem.items[r]
        model, trace = problem.model, problem.traces[one.trace]
        k, time = model.points.index(model.foot_point), trace.time[one.first : one.first + one.after] - since
        gap = model.normal * self.flown[2][r][k] + problem.gaps[r]
        left = model.normal * self.flown[0][r][k] * trace.noise_x[k]
        return measured_and_fitted(title, (axis, "s", "gap", "m"), time, gap, left)
