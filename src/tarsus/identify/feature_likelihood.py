"""How likely parameters make the features of records: a batch of simulations a record."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tarsus.base.errors import InputError
from tarsus.base.workers import Workers
from tarsus.identify.features import Features, Instrument, simulated
from tarsus.identify.limits import field_limits
from tarsus.model.scene import Scene
from tarsus.solve import Accuracy

__all__ = ["FeatureLikelihood", "Observed"]

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Observed:
    """Features of a record, and the scene that it was taken of: signal, gap and all that is not asked for.

    duration [s] of the record; skip: drive periods dropped as transient, None for a third.
    """

    scene: Scene
    features: Features
    duration: float
    skip: int | None = None


class FeatureLikelihood:
    """Gaussian log-likelihood of parameters, given features of records: a simulation for each record and set.

    ``sum -(f - f_sim)^2 / (2 s^2) - log s``, where ``s^2`` adds the errors of the record and those of the simulation
    (its spread over its periods). A feature that the record has and the simulation lacks, or the other way round,
    counts as ``absent`` standard deviations. Runs that do not reach their end, and parameters outside the limits, have
    -inf.

    Parameters
    ----------
    observed
        The records.
    paths
        Of the parameters in the scenes, np.
    limits
        (low, high) by path, narrower than what the descriptions allow.
    instrument
        Of the records.
    absent
        Standard deviations that a feature on one side only counts for.

    Raises
    ------
    InputError
        For an unknown path, or no record.
    """

    def __init__(
        self,
        observed: Sequence[Observed],
        paths: Sequence[str],
        *,
        limits: Mapping[str, tuple[float, float]] | None = None,
        instrument: Instrument | None = None,
        absent: float = 4.0,
        threads: Workers = None,
        accuracy: Accuracy | None = None,
    ) -> None:
        if not observed:
            raise InputError("a likelihood needs at least one record")
        self.observed = tuple(observed)
        self.paths = tuple(paths)
        self.instrument = instrument or Instrument()
        self.absent = absent
        self._threads, self._accuracy = threads, accuracy
        ends = []
        for path in self.paths:
            own, given = field_limits(observed[0].scene, path), (limits or {}).get(path, (-np.inf, np.inf))
            ends.append((max(own[0], given[0]), min(own[1], given[1])))
        self.limits = dict(zip(self.paths, ends, strict=True))
        self._low, self._high = np.array(ends).T

    def __call__(self, parameters: Floats) -> Floats:
        """Log-likelihoods (n,) of parameters (n, np)."""
        rows = np.atleast_2d(np.asarray(parameters, dtype=float))
        out = np.full(len(rows), -np.inf)
        inside = np.flatnonzero(np.all((rows >= self._low) & (rows <= self._high), axis=1))
        if len(inside):
            vary = {path: rows[inside, j] for j, path in enumerate(self.paths)}
            out[inside] = sum(self._of_record(one, vary) for one in self.observed)
        return out

    def _of_record(self, one: Observed, vary: Mapping[str, Floats]) -> Floats:
        kinds = tuple(dict.fromkeys(name.split(".")[0] for name in one.features.names))
        found = simulated(
            one.scene, vary, one.duration, kinds, skip=one.skip, resolution=self.instrument.rebound,
            threads=self._threads, accuracy=self._accuracy,
        )  # fmt: skip
        columns = [found.names.index(name) for name in one.features.names]
        values, spread = found.values[:, columns], found.spread[:, columns]
        measured = one.features.values
        variance = one.features.error(self.instrument) ** 2 + np.nan_to_num(spread) ** 2 / found.periods
        both = np.isfinite(values) & np.isfinite(measured)
        one_only = np.isfinite(values) != np.isfinite(measured)
        off = np.where(both, (values - measured) ** 2 / variance, 0.0)
        off += np.where(one_only, self.absent**2, 0.0)
        log = np.where(both, np.log(variance), np.log(one.features.error(self.instrument) ** 2))
        ended = np.isfinite(values).any(axis=1)
        return np.where(ended, -0.5 * np.sum(off + log, axis=1), -np.inf)
