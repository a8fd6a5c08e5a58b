"""A fit of a scene: unknown numbers of it, what its runs should do, and derivatives of that."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from copy import copy

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tarsus.base.arrays import Floats
from tarsus.base.errors import InputError
from tarsus.base.spec import get_value, with_values
from tarsus.files.library import SceneLike, as_scene
from tarsus.fit.residuals import FAILED, Residuals, RunsTried, differences
from tarsus.fit.terms import OfMeasure, Samples, Term, TermRole, TermRows, term_rows_of
from tarsus.fit.unknowns import Ranges, Unknown, Unknowns
from tarsus.model.scene import Scene, seconds_of
from tarsus.solve import SINGLE_RUN, Accuracy, Batch, Shared, simulate, simulate_batch

Values = Callable[[Floats], Mapping[str, float]]
"""Numbers of the scene by path, of SI values (nu,) of the unknowns."""
Derived = Callable[[Mapping[str, float]], Mapping[str, float]]
"""Further numbers of the scene by path, of the unknowns' SI values by name."""


STEP = 1e-4
"""Step of the differences of a scene's numbers by an unknown, in parts of its bounds: of arithmetic, not of runs; the
stencil of fourth order leaves 1e-16 of what is smooth over the bounds, and 1e-12 of rounding."""
_PLACES, _WEIGHTS = np.array([-2.0, -1.0, 1.0, 2.0]), np.array([1.0, -8.0, 8.0, -1.0]) / 12.0


def directions(values: Values, at: Floats, span: Floats) -> dict[str, dict[str, float]]:
    """How much each number of a scene moves with each of the unknowns at SI values (nu,), by the unknown's number and
    by path; span (nu,): width of the unknowns' bounds. A number that jumps or bends within `STEP` of there has the
    slope of its secant."""
    out = {}
    for i, unit in enumerate(np.eye(len(at))):
        four = [values(at + place * STEP * span * unit) for place in _PLACES]
        moved = {path: np.array([one[path] for one in four]) for path in four[0]}
        out[str(i)] = {
            path: float(_WEIGHTS @ column) / (STEP * span[i]) for path, column in moved.items() if np.ptp(column) > 0.0
        }
    return out


class Problem(Residuals):
    """Unknown numbers of a scene and what its runs should do.

    Parameters
    ----------
    scene
        The scene, or a device's name or a scene file's path; what is not unknown is its own.
    unknowns
        Each a number of the scene or of `derived`; or bounds by path, ``{"volts": (5, 7)}``.
    terms
        Readings, samples, goals and limits; those under the same conditions share a run.
    duration
        Of every run [s], or a text with a unit; the scene's own by default.
    accuracy
        Of every run; by default that of single runs.
    derived
        Numbers of the scene that follow from the unknowns, arithmetic that is smooth.

    Raises
    ------
    InputError
        With everything that does not fit.
    """

    def __init__(
        self,
        scene: SceneLike,
        unknowns: Sequence[Unknown] | Ranges,
        terms: Sequence[Term],
        duration: float | str | None = None,
        accuracy: Accuracy | None = None,
        *,
        derived: Derived | None = None,
    ) -> None:
        scene = as_scene(scene)
        self.scene, self.terms = scene, tuple(terms)
        self.seconds, self.accuracy = seconds_of(scene, duration), accuracy or SINGLE_RUN
        self._derived, self._shared, self.tried = derived, Shared(), RunsTried()
        problems: list[str] = []
        self._targets: set[str] = set()
        for make in (lambda: self._set_unknowns(unknowns), self._set_terms):
            try:
                make()
            except InputError as error:
                problems += error.problems
        if problems:
            raise InputError(problems)
        roles = [one.role for one in self._terms for _ in one.level]
        self._goals = np.array([role is TermRole.GOAL for role in roles])
        self._limits = np.array([role is TermRole.LIMIT for role in roles])
        self._priors = np.array([one is not None for one in self.unknowns.priors])
        self._last: tuple[bytes, Floats] = (b"", np.zeros((0, 0)))
        self._kept_slopes: tuple[bytes, Floats, tuple[str, ...]] = (b"", np.zeros((0, 0)), ())

    def _set_unknowns(self, unknowns: Sequence[Unknown] | Ranges) -> None:
        self.unknowns = Unknowns.of(self.scene, unknowns)
        self._targets = {path for one in self.unknowns.targets for path in one}
        middle = self.unknowns.values(np.full(len(self.unknowns), 0.5))
        with_values(self.scene, self._values({})(middle))

    def _set_terms(self) -> None:
        self._terms = term_rows_of(self.scene, self.terms, self.seconds)
        twice = sorted({path for one in self._terms for path in one.under} & self._targets)
        if twice:
            raise InputError([f"{path}: is unknown, and a condition under which a term holds" for path in twice])
        self._unders = list({tuple(sorted(one.under.items())): one.under for one in self._terms}.values())

    def _values(self, under: Mapping[str, float]) -> Callable[[Floats], dict[str, float]]:
        """Numbers of the scene under conditions, of the unknowns' SI values."""

        def values(at: Floats) -> dict[str, float]:
            out = {**under, **self.unknowns.by_path(at)}
            if self._derived is not None:
                out.update(self._derived(dict(zip(self.unknowns.names, at.tolist(), strict=True))))
            return out

        return values

    @property
    def records(self) -> list[slice]:
        """Rows of the residuals that are samples of one record, in order of time."""
        found, start = [], 0
        for term, one in zip(self.terms, self._terms, strict=True):
            if one.role is TermRole.GOAL:
                continue
            if isinstance(term, Samples):
                found.append(slice(start, start + len(one.level)))
            start += len(one.level)
        return found

    def scene_at(self, x: ArrayLike) -> Scene:
        """The scene at a point (nu,) of the cube."""
        return with_values(self.scene, self._values({})(self.unknowns.values(self.point(x))))

    def on(self, scene: Scene) -> Problem:
        """The same of another scene."""
        other = copy(self)
        other.scene = scene
        other._last, other._kept_slopes = (b"", np.zeros((0, 0))), (b"", np.zeros((0, 0)), ())
        return other

    def residuals_at(self, points: Floats) -> Floats:
        rows = self._rows(points)
        rows[:, self._limits] = np.maximum(rows[:, self._limits], 0.0)
        priors = self.unknowns.prior_residuals(points)[:, self._priors]
        return np.concatenate([rows[:, ~self._goals], priors], axis=1)

    def goals_at(self, points: Floats) -> Floats:
        return self._rows(points)[:, self._goals]

    def constraints_at(self, points: Floats) -> Floats:
        return self._rows(points)[:, self._limits]

    def jacobian(self, x: ArrayLike) -> Floats:
        at = self.point(x)
        slopes = self._slopes(at)[0].copy()
        met = self._limits & (self._rows(at[None])[0] <= 0.0)
        slopes[met] = 0.0
        priors = np.diag(self.unknowns.prior_slopes(at))[self._priors]
        return np.concatenate([slopes[~self._goals], priors])

    def goals_jacobian(self, x: ArrayLike) -> Floats:
        return self._slopes(self.point(x))[0][self._goals] if self._goals.any() else super().goals_jacobian(x)

    def flags(self, x: ArrayLike) -> tuple[str, ...]:
        """Why some derivatives at a point (nu,) of the cube are differences of runs; nothing where all are exact."""
        return self._slopes(self.point(x))[1]

    def _rows(self, points: Floats) -> Floats:
        """Rows (n, nr) of all terms at points (n, nu), from one batch; the last ones are kept."""
        if not len(points):
            return np.zeros((0, len(self._goals)))
        key = np.ascontiguousarray(points, dtype=float).tobytes()
        if self._last[0] != key:
            self._last = key, self._simulated(self.unknowns.values(points))
        return self._last[1].copy()

    def _simulated(self, at: Floats) -> Floats:
        """Rows (n, nr) at SI values (n, nu)."""
        values = [self._values(under)(one) for under in self._unders for one in at]
        paths = list(dict.fromkeys(path for one in values for path in one))
        own = {path: float(get_value(self.scene, path)) for path in paths}
        vary = {path: np.array([one.get(path, own[path]) for one in values]) for path in paths}
        batch = simulate_batch(self.scene, vary, self.seconds, accuracy=self.accuracy, shared=self._shared)
        self.tried.note(batch)
        names = {one.reader.name for one in self._terms if isinstance(one.reader, OfMeasure)}
        measures = {name: one.value for name, one in batch.measured(names).items()} if names else {}
        parts = []
        for one in self._terms:
            first = self._unders.index(one.under) * len(at)
            runs = np.arange(first, first + len(at))
            rows = one.rows(_numbers(one, batch, runs, measures))
            parts.append(np.where(np.isfinite(rows), rows, FAILED))
        return np.concatenate(parts, axis=1)

    def _slopes(self, x: Floats) -> tuple[Floats, tuple[str, ...]]:
        """Derivatives (nr, nu) of the rows at a point (nu,) by the cube's coordinates, and flags; the last are kept."""
        key = x.tobytes()
        if self._kept_slopes[0] == key:
            return self._kept_slopes[1:]
        at, span = self.unknowns.values(x), self.unknowns.high - self.unknowns.low
        parts: dict[int, Floats] = {}
        flags: list[str] = []
        for under in self._unders:
            own = [n for n, one in enumerate(self._terms) if one.under == under]
            values = self._values(under)
            scene, moved = with_values(self.scene, values(at)), directions(values, at, span)
            try:
                run = simulate(scene, self.seconds, self.accuracy, shared=self._shared, gradients=moved)
            except InputError as error:
                run = None
                flags.append(f"the engine has no derivatives of these runs: {'; '.join(error.problems)}")
            for n in own:
                reader, nothing = self._terms[n].reader, np.full((self._terms[n].reader.count, len(at)), np.nan)
                slopes, why = (nothing, {}) if run is None else reader.slopes(run)
                parts[n] = self._terms[n].slopes(slopes)
                flags += [text for texts in why.values() for text in texts]
        found = np.concatenate([parts[n] for n in range(len(parts))]) * self.unknowns.slopes(x)
        missing = np.isnan(found)
        if missing.any():
            columns = np.flatnonzero(missing.any(axis=0))
            runs = differences(lambda points: self._simulated(self.unknowns.values(points)), x, columns)
            found[:, columns] = np.where(missing[:, columns], runs, found[:, columns])
        self._kept_slopes = key, found, tuple(dict.fromkeys(flags))
        return self._kept_slopes[1:]


def _numbers(asked: TermRows, batch: Batch, runs: NDArray[np.intp], measures: Mapping[str, Floats]) -> Floats:
    """Numbers (n, k) of some runs of a batch; NaN of those that did not reach their end."""
    if isinstance(asked.reader, OfMeasure):
        return measures[asked.reader.name][runs, None]
    nothing = np.full(asked.reader.count, np.nan)
    return np.array([asked.reader.numbers(batch.run(i)) if batch.done[i] else nothing for i in runs.tolist()])
