"""Profile likelihoods: how far a number, or a product of powers, can move before the data contradict it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import brentq, minimize
from scipy.stats import chi2, qmc

from tarsus.base.errors import InputError
from tarsus.fit.verdict import LEVEL
from tarsus.identify.coordinates import Coordinates
from tarsus.identify.ranges import Range

__all__ = ["LogLikelihood", "Profile", "Profiler", "one_by_one"]

Floats = NDArray[np.float64]
LogLikelihood = Callable[[Floats], Floats]
"""From parameters (n, np) to log-likelihoods (n,), up to a constant; -inf where parameters are impossible."""

_WALL = 1e12
_REACH = float(np.log(1e6))
_NEAR = float(np.log(100.0))
_MOST_STEPS = 80
_APART = 0.05
_TOUCH = 1e-6
_NUDGE = 1e-3


def one_by_one(likelihood: Callable[[Floats], float]) -> LogLikelihood:
    """A log-likelihood of one set of parameters (np,) as one of many sets."""
    return lambda x: np.array([float(likelihood(row)) for row in np.atleast_2d(x)])


@dataclass(frozen=True)
class Profile:
    """What the data allow along one direction of the pure parameters (see `Coordinates`).

    direction (np,); low, high: ends of what is allowed, along the direction from the best point, infinite where the
    search came to its limit first; pieces: parts, where it is not one; ridge (m, np): best points along the way that
    are allowed, with ``drop`` (m,): twice the loss of log-likelihood there.
    """

    direction: Floats
    low: float
    high: float
    pieces: tuple[tuple[float, float], ...]
    ridge: Floats
    drop: Floats


class Profiler:
    """Profiles of one log-likelihood.

    The largest likelihood is looked for from the given values and from points spread (Sobol) over the limits, but no
    further than a factor of 100, or three sizes, from the values. A profile
    walks away from every maximum that is allowed, in steps that adapt, all other parameters being fitted again at each,
    until the likelihood ratio exceeds the quantile of chi-square with one degree of freedom; the crossing is bracketed
    and found by Brent's method. Residual curvature is used nowhere.

    Parameters
    ----------
    likelihood
        Of many sets of parameters at a time. It must know its noise: a scale that was fitted to the same data makes
        ranges too narrow where these are few.
    coordinates
        Parameters, their values (the start) and which are logarithms.
    limits
        (low, high) by name where the search ends, SI; by default a factor of a million to either side, or a thousand
        sizes. A limit is no evidence: where it is reached first, the range is open. Limits that were given bind the
        other parameters; where one of these runs into a limit that was not given, the range is open as well.
    level
        Of the ranges.
    starts
        Points spread (a power of 2); 0 for none. Of these the best five are climbed from.
    seed
        Of their spread.
    step
        Difference of the pure parameters for slopes. Larger for a likelihood that is not smooth.

    Raises
    ------
    InputError
        If the likelihood is not finite at the given values, or they lie outside the limits.
    """

    def __init__(
        self,
        likelihood: LogLikelihood,
        coordinates: Coordinates,
        limits: Mapping[str, tuple[float, float]] | None = None,
        *,
        level: float = LEVEL,
        starts: int = 64,
        seed: int = 0,
        step: float = 1e-4,
    ) -> None:
        self.coordinates = coordinates
        self.level = level
        self.allowance = float(chi2.ppf(level, 1))
        self.calls = 0
        self._likelihood = likelihood
        self._limits = dict(limits or {})
        self._step = step
        self._low, self._high = _box(coordinates, limits or {})
        self._given = np.array([name in (limits or {}) for name in coordinates.names])
        zero = np.zeros(len(coordinates.names))
        first = float(self._deviances(zero[None])[0])
        if first >= _WALL:
            raise InputError("the likelihood of the given values is not finite: there is nothing to profile")
        self.best, self.lowest = zero, first
        self._maxima = [zero]
        self._search(starts, seed)

    @property
    def values(self) -> Floats:
        """Parameters (np,) of the largest likelihood found, SI."""
        return self.coordinates.outward(self.best)

    def along(self, direction: ArrayLike) -> Profile:
        """Profile of the combination ``direction @ u`` of pure parameters, with all others fitted again."""
        way = np.asarray(direction, dtype=float)
        for _ in range(4):
            found = self._walked(way)
            if found is not None:
                return found
        raise InputError("the likelihood keeps rising along its own profile: it is too rough to be profiled")

    def of(self, j: int) -> Profile:
        """Profile of parameter number j."""
        return self.along(np.eye(len(self.best))[j])

    def range_of(self, j: int, profile: Profile) -> Range:
        """Range of parameter number j, SI."""
        ends = [self.coordinates.one_outward(j, u) for u in (profile.low, profile.high)]
        parts = [sorted(self.coordinates.one_outward(j, u) for u in piece) for piece in profile.pieces]
        pieces = tuple(sorted((low, high) for low, high in parts))
        return Range(float(self.values[j]), min(ends), max(ends), self.level, pieces)

    def range_of_product(self, exponents: Floats, profile: Profile) -> Range:
        """Range of the product of powers ``exponents`` (np,) of the parameters' magnitudes, SI."""
        used = exponents != 0.0
        base = float(np.sum(exponents[used] * np.log(np.abs(self.coordinates.values[used]))))
        low, high = (np.exp(base + end) if np.isfinite(end) else end for end in (profile.low, profile.high))
        pieces = tuple((float(np.exp(base + a)), float(np.exp(base + b))) for a, b in profile.pieces)
        return Range(float(np.exp(base + exponents @ self.best)), float(low), float(high), self.level, pieces)

    def range_of_sum(self, j: int, k: int, weight: float) -> Range:
        """Range of ``x_j + weight x_k``, SI: a profile in the parameters themselves instead of their logarithms."""
        names, values = self.coordinates.names, self.values
        sizes = {name: abs(float(v)) for name, v in zip(names, values, strict=True)}
        sizes |= {n: float(s) for n, s in zip(names, self.coordinates.sizes, strict=True) if np.isfinite(s)}
        keep_sign: dict[str, tuple[float, float]] = {
            name: (min(0.0, 1e6 * float(v)), max(0.0, 1e6 * float(v)))
            for name, v, logarithmic in zip(names, values, self.coordinates.logarithmic, strict=True)
            if logarithmic
        }
        straight = Coordinates.of(names, values, sizes)
        inner = Profiler(
            self._likelihood,
            straight,
            {**keep_sign, **self._limits},
            level=self.level,
            starts=0,
            step=self._step,
        )
        way = np.zeros(len(names))
        way[[j, k]] = straight.sizes[j], weight * straight.sizes[k]
        found = inner.along(way)
        middle = float(values[j] + weight * values[k])
        pieces = tuple((middle + low, middle + high) for low, high in found.pieces)
        best = float(inner.values[j] + weight * inner.values[k])
        return Range(best, middle + found.low, middle + found.high, self.level, pieces)

    def _deviances(self, u: Floats) -> Floats:
        """Minus twice the log-likelihoods (n,) of pure parameters (n, np)."""
        self.calls += len(u)
        values = np.asarray(self._likelihood(self.coordinates.outward(u)), dtype=float)
        return np.where(np.isfinite(values), -2.0 * values, _WALL)

    def _search(self, starts: int, seed: int) -> None:
        """Find the maxima that are allowed, the largest first."""
        points = self.best[None]
        if starts:
            near = np.where(self.coordinates.logarithmic, _NEAR, 3.0)
            low, high = np.maximum(self._low, -near), np.minimum(self._high, near)
            shares = qmc.Sobol(len(low), seed=seed).random(starts)  # pyright: ignore[reportCallIssue]
            spread = low + shares * (high - low)
            order = np.argsort(self._deviances(spread), kind="stable")[:5]
            points = np.vstack([points, spread[order]])
        climbed = [self._descend(point) for point in points]
        climbed.sort(key=lambda one: one[1])
        self.best, self.lowest = climbed[0]
        self._maxima = []
        for u, deviance in climbed:
            apart = all(np.abs(u - other).max() > _APART for other in self._maxima)
            if deviance - self.lowest <= self.allowance and apart:
                self._maxima.append(u)

    def _descend(self, start: Floats, way: Floats | None = None, along: float = 0.0) -> tuple[Floats, float]:
        """Lowest deviance from a start; with ``way`` among the points where ``way @ u`` is ``along``."""
        count = len(start)
        held = -1 if way is None else int(np.argmax(np.abs(way)))
        free = np.array([k for k in range(count) if k != held], dtype=int)

        def whole(v: Floats) -> Floats:
            u = np.zeros((len(v), count))
            u[:, free] = v
            if way is not None:
                u[:, held] = (along - u[:, free] @ way[free]) / way[held]
            return u

        def deviances(v: Floats) -> Floats:
            u = whole(v)
            inside = np.clip(u, self._low, self._high)
            outside = np.abs(u - inside).max(axis=1)
            return self._deviances(inside) + np.where(outside > 0.0, 1e3 * outside * (1.0 + outside), 0.0)

        if not len(free):
            u = whole(np.zeros((1, 0)))
            return u[0], float(deviances(np.zeros((1, 0)))[0])
        low, high = self._low[free], self._high[free]

        def value_and_slope(v: Floats) -> tuple[float, Floats]:
            steps = self._step * np.eye(len(v))
            up, down = np.clip(v + steps, low, high), np.clip(v - steps, low, high)
            values = deviances(np.vstack([v[None], up, down]))
            above, below = values[1 : len(v) + 1], values[len(v) + 1 :]
            above, below = (np.where(side >= _WALL, values[0], side) for side in (above, below))
            return float(values[0]), (above - below) / np.diag(up - down)

        off = _NUDGE * np.cos(1.0 + np.arange(len(free)))  # off a saddle that symmetry would hold it on
        begin = np.clip(start[free] + off, low, high)
        found = minimize(value_and_slope, begin, jac=True, method="L-BFGS-B", bounds=list(zip(low, high, strict=True)),
                         options={"maxiter": 200, "ftol": 1e-12, "gtol": 1e-6})  # fmt: skip
        v, value = np.asarray(found.x), float(found.fun)
        if way is None:  # once more without slopes, for a likelihood that is not smooth
            rough = minimize(lambda v: float(deviances(np.clip(v, low, high)[None])[0]), v, method="Nelder-Mead",
                             options={"maxfev": 60 * len(free), "initial_simplex": _simplex(v)})  # fmt: skip
            if rough.fun < value:
                v, value = np.clip(rough.x, low, high), float(rough.fun)
        return whole(v[None])[0], value

    def _walked(self, way: Floats) -> Profile | None:
        """Profile from every maximum; None when a larger likelihood was met, from which to begin again."""
        ends: list[tuple[float, float]] = []
        ridge: list[Floats] = []
        drops: list[float] = []
        for maximum in self._maxima:
            here = [float(way @ maximum)] * 2
            if any(low <= here[0] <= high for low, high in ends):
                continue  # on a way that was gone already
            for side in (-1.0, 1.0):
                walk = self._walk(way, maximum, side)
                if walk is None:
                    return None
                here[int(side > 0.0)], points, drop = walk
                ridge += points
                drops += drop
            ends.append((here[0], here[1]))
        ends.sort()
        merged = [ends[0]]
        for low, high in ends[1:]:
            if low <= merged[-1][1]:
                merged[-1] = (merged[-1][0], max(merged[-1][1], high))
            else:
                merged.append((low, high))
        pieces = tuple(merged) if len(merged) > 1 else ()
        return Profile(way, merged[0][0], merged[-1][1], pieces, np.array(ridge), np.array(drops))

    def _walk(
        self, way: Floats, maximum: Floats, side: float
    ) -> tuple[float, list[Floats], list[float]] | None:
        """Where the profile leaves what is allowed on one side of a maximum (infinite: nowhere), and the way there."""
        here = float(way @ maximum)
        last = self._limit(way, side)
        point, drop = maximum, float(self._deviances(maximum[None])[0]) - self.lowest
        points, drops = [point], [drop]
        slope = np.zeros_like(maximum)
        step = self._first_step(way, maximum, side)

        def at(along: float, guess: Floats) -> tuple[Floats, float]:
            tries = [self._descend(guess, way, along)]
            if tries[0][1] - self.lowest > 0.25 * self.allowance:
                tries.append(self._descend(point, way, along))
            return min(tries, key=lambda one: one[1])

        for _ in range(_MOST_STEPS):
            there = here + side * step
            if side * (there - last) >= 0.0:
                there = last
            new, deviance = at(there, point + slope * (there - here))
            new_drop = deviance - self.lowest
            if new_drop < -1e-3:
                self.best, self.lowest = new, deviance
                self._refine()
                return None
            if new_drop > self.allowance:
                if new_drop > 4.0 * self.allowance and abs(there - here) > 1e-6:
                    step = 0.5 * abs(there - here)
                    continue
                if self._ran_away(new, maximum, way):
                    return side * np.inf, points, drops
                return self._crossing(at, point, slope, (here, drop), (there, new_drop)), points, drops
            if there == last:
                return side * np.inf, [*points, new], [*drops, new_drop]
            slope = (new - point) / (there - here)
            rise = new_drop - drop
            here, point, drop = there, new, new_drop
            points.append(point)
            drops.append(drop)
            if rise < 0.1 * self.allowance:
                step *= 2.0
            elif rise > 0.4 * self.allowance:
                step *= 0.6
        return side * np.inf, points, drops

    def _crossing(
        self, at: Callable[[float, Floats], tuple[Floats, float]], point: Floats, slope: Floats,
        inside: tuple[float, float], outside: tuple[float, float],
    ) -> float:  # fmt: skip
        """Where between two points of a profile the allowance is used up."""
        (here, drop), (there, beyond) = inside, outside
        known = {here: drop - self.allowance, there: beyond - self.allowance}

        def excess(along: float) -> float:
            if along not in known:
                known[along] = at(along, point + slope * (along - here))[1] - self.lowest - self.allowance
            return known[along]

        if known[here] >= 0.0:
            return here
        return float(brentq(excess, here, there, xtol=1e-3 * abs(there - here), rtol=1e-6))  # pyright: ignore

    def _ran_away(self, point: Floats, maximum: Floats, way: Floats) -> bool:
        """Whether a parameter that is fitted again was stopped by a limit that nobody gave, and would go on."""
        fitted = ~self._given & ((way == 0.0) | (np.count_nonzero(way) > 1))
        for k in np.flatnonzero(fitted):
            for limit, beyond in ((self._low[k], -1.0), (self._high[k], 1.0)):
                if abs(point[k] - limit) < _TOUCH < abs(maximum[k] - limit):
                    further = np.repeat(point[None], 5, axis=0)
                    further[1:, k] += beyond * np.array([1e-3, 1e-2, 1e-1, 1.0])
                    here, *there = self._deviances(further)
                    if min(there) < here - 0.01 * self.allowance:
                        return True
        return False

    def _first_step(self, way: Floats, maximum: Floats, side: float) -> float:
        """A step that uses up part of the allowance along the straight line, from 1e-4 to 0.25."""
        straight = side * way / float(way @ way)
        lengths = np.geomspace(1e-4, 0.25, 12)
        points = np.clip(maximum + lengths[:, None] * straight, self._low, self._high)
        fine = self._deviances(points) - self.lowest < 0.5 * self.allowance
        return float(lengths[np.flatnonzero(fine)[-1]]) if fine.any() else float(lengths[0])

    def _limit(self, way: Floats, side: float) -> float:
        """Largest value of ``way @ u`` within the limits (smallest for side -1)."""
        towards = np.where(side * way > 0.0, self._high, self._low)
        return float(np.sum(way[way != 0.0] * towards[way != 0.0]))

    def _refine(self) -> None:
        """Climb from a better point met on the way, and keep the maxima that are still allowed."""
        self.best, self.lowest = self._descend(self.best)
        kept = [u for u in self._maxima if np.abs(u - self.best).max() > _APART]
        rest = [u for u in kept if float(self._deviances(u[None])[0]) - self.lowest <= self.allowance]
        self._maxima = [self.best, *rest]


def _simplex(v: Floats) -> Floats:
    """A simplex (n + 1, n) of half a percent about a point."""
    return np.vstack([v, v + 5e-3 * np.eye(len(v))])


def _box(coordinates: Coordinates, limits: Mapping[str, tuple[float, float]]) -> tuple[Floats, Floats]:
    """Limits (np,), (np,) of the pure parameters."""
    wide = np.where(coordinates.logarithmic, _REACH, 1e3)
    low, high = -wide, wide
    problems = [
        f"limits: '{name}' is none of the parameters" for name in limits if name not in coordinates.names
    ]
    for j, name in enumerate(coordinates.names):
        if name not in limits:
            continue
        ends = np.tile(coordinates.values, (2, 1))
        ends[:, j] = limits[name]
        inward = np.sort(coordinates.inward(ends)[:, j])
        inward[0] = -wide[j] if np.isnan(inward[0]) or np.isneginf(inward[0]) else inward[0]
        inward[1] = wide[j] if np.isnan(inward[1]) or np.isposinf(inward[1]) else inward[1]
        if not inward[0] <= 0.0 <= inward[1]:
            problems.append(
                f"{name}: its value {coordinates.values[j]:g} lies outside its limits {limits[name]}"
            )
        low[j], high[j] = inward
    if problems:
        raise InputError(problems)
    return low, high
