"""A fit of a scene: unknown numbers of it, and what its runs should do."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from copy import copy

import numpy as np
from numpy.typing import ArrayLike

from tarsus.base.arrays import Floats
from tarsus.base.errors import InputError
from tarsus.base.spec import get_value, with_values
from tarsus.files.library import SceneLike, as_scene
from tarsus.fit.residuals import FAILED, Residuals, RunsTried
from tarsus.fit.terms import RunFunction, Term, term_rows_of
from tarsus.fit.unknowns import Ranges, Unknown, Unknowns
from tarsus.model.scene import Scene, seconds_of
from tarsus.solve import SINGLE_RUN, Accuracy, Shared, simulate_batch

Derived = Callable[[Mapping[str, float]], Mapping[str, float]]
"""Further numbers of the scene by path, of the unknowns' SI values by name."""


class Problem(Residuals):
    """Unknown numbers of a scene and what its runs should do; the Jacobian is one of differences of runs.

    Parameters
    ----------
    scene
        The scene, or a device's name or a scene file's path; what is not unknown is its own.
    unknowns
        Each a number of the scene or of `derived`; or bounds by path, ``{"volts": (5, 7)}``.
    terms
        Readings, samples, limits, and functions of a `Run` that give (model - data) / error, as many numbers of every
        run; or one such function. Terms under the same conditions share a run.
    duration
        Of every run [s], or a text with a unit; the scene's own by default.
    accuracy
        Of every run; by default that of single runs.
    derived
        Numbers of the scene that follow from the unknowns.

    Raises
    ------
    InputError
        With everything that does not fit.
    """

    def __init__(
        self,
        scene: SceneLike,
        unknowns: Sequence[Unknown] | Ranges,
        terms: Sequence[Term] | RunFunction,
        duration: float | str | None = None,
        accuracy: Accuracy | None = None,
        *,
        derived: Derived | None = None,
    ) -> None:
        self.scene = as_scene(scene)
        self.terms: tuple[Term, ...] = (terms,) if callable(terms) else tuple(terms)
        self.seconds, self.accuracy = seconds_of(self.scene, duration), accuracy or SINGLE_RUN
        self._derived, self._shared, self.tried = derived, Shared(), RunsTried()
        problems: list[str] = []
        targets: set[str] = set()
        try:
            self.unknowns = Unknowns.of(self.scene, unknowns)
            if derived is None and not all(self.unknowns.targets):
                raise InputError("unknowns: expected a path of the scene for each")
            targets = {path for one in self.unknowns.targets for path in one}
            with_values(self.scene, self._values({}, self.unknowns.values(np.full(len(self.unknowns), 0.5))))
        except InputError as error:
            problems += error.problems
        try:
            self._terms = term_rows_of(self.scene, self.terms, self.seconds)
            twice = sorted({path for one in self._terms for path in one.under} & targets)
            problems += [f"{path}: is unknown, and a condition under which a term holds" for path in twice]
        except InputError as error:
            problems += error.problems
        if problems:
            raise InputError(problems)
        self._unders = list({tuple(sorted(one.under.items())): one.under for one in self._terms}.values())
        self._priors = np.array([one is not None for one in self.unknowns.priors])
        self._counts = [1 if one.level is None else len(one.level) for one in self._terms]

    def _values(self, under: Mapping[str, float], at: Floats) -> dict[str, float]:
        """Numbers of the scene under conditions, of the unknowns' SI values (nu,)."""
        known = dict(zip(self.unknowns.names, at.tolist(), strict=True))
        return {**under, **self.unknowns.by_path(at), **(self._derived(known) if self._derived else {})}

    @property
    def records(self) -> list[slice]:
        """Rows of the residuals that are in order of time, of each record and of each function."""
        ends = np.cumsum([0, *self._counts]).tolist()
        return [slice(a, b) for a, b, one in zip(ends, ends[1:], self._terms, strict=False) if one.ordered]

    def scene_at(self, x: ArrayLike) -> Scene:
        """The scene at a point (nu,) of the cube."""
        return with_values(self.scene, self._values({}, self.unknowns.values(self.point(x))))

    def on(self, scene: Scene) -> Problem:
        """The same of another scene."""
        other = copy(self)
        other.scene = scene
        return other

    def residuals_at(self, points: Floats) -> Floats:
        at = self.unknowns.values(points)
        values = [self._values(under, one) for under in self._unders for one in at]
        paths = list(dict.fromkeys(path for one in values for path in one))
        own = {path: float(get_value(self.scene, path)) for path in paths}
        vary = {path: np.array([one.get(path, own[path]) for one in values]) for path in paths}
        batch = simulate_batch(self.scene, vary, self.seconds, accuracy=self.accuracy, shared=self._shared)
        self.tried.note(batch)
        names = {one.read for one in self._terms if isinstance(one.read, str)}
        measures = {name: one.value for name, one in batch.measured(names).items()} if names else {}
        parts = []
        for k, one in enumerate(self._terms):
            first = self._unders.index(one.under) * len(at)
            runs = range(first, first + len(at))
            if isinstance(one.read, str):
                numbers = measures[one.read][runs.start : runs.stop, None]
            else:
                made = {i: _numbers(one.read(batch.run(i))) for i in runs if batch.done[i]}
                if made:
                    self._counts[k] = _count(one.level is None, list(made.values()))
                numbers = np.array([made.get(i, np.full(self._counts[k], np.nan)) for i in runs])
            rows = one.rows(numbers)
            parts.append(np.where(np.isfinite(rows), rows, FAILED))
        return np.concatenate([*parts, self.unknowns.prior_residuals(points)[:, self._priors]], axis=1)


def _numbers(given: ArrayLike) -> Floats:
    """What a function gives of a run, as one row. Raises InputError where it gives nothing."""
    if given is None:
        raise InputError("residuals: the function returns nothing; it needs a `return` of numbers")
    return np.ravel(np.asarray(given, dtype=float))


def _count(own: bool, made: Sequence[Floats]) -> int:
    """How many numbers each run gave; raises InputError where a function's (own) are not as many of every run, or one
    is NaN in all."""
    if len({len(one) for one in made}) > 1:
        raise InputError("residuals: expected as many numbers of every run")
    if own and (absent := np.flatnonzero(np.isnan(made).all(axis=0))).size:
        numbers = ", ".join(str(k + 1) for k in absent)
        raise InputError(f"residuals: number {numbers} is NaN in all of {len(made)} runs")
    return len(made[0])
