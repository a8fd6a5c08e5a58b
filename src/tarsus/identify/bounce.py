"""Bounces: the motion on both sides of an impact of the foot, fitted together.

The foot is on the ground at the impact and its velocity changes there, together with the rest of the structure's by
the mass-weighted impact law; before and after it the structure flies free.

Where the ground is as seen from a record is known from the rest before it, some ten nanometres uncertain, and from the
common level of all records. At an impact the structure's modes accelerate the foot by thousands of m/s^2, so that its
velocity at the ground hangs on that; the flights before and after the impact meet there, which tells it as well.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tarsus.base.arrays import Floats
from tarsus.fit.normal_equations import Descent, NormalEquations, descend
from tarsus.identify.draws import DRAWS
from tarsus.identify.flight import FilmConstants, FlightSide, FlownStretches, Moment, Stretches, equations_of
from tarsus.identify.foot import FootModel
from tarsus.identify.traces import Trace
from tarsus.identify.volts import jumps_of
from tarsus.impacts.detection import impacts_at_ground
from tarsus.records.excluded import Excluded

LONGEST = 20
"""Samples on each side of an impact that are fitted at most."""

FEWEST = 5
"""Samples of free flight there must be on each side, so that no other contact hides between them."""

_DESCENT = Descent(rounds=15)
"""Fifteen rounds: an impact that needs more is no single one, and `sound` looks whether it has settled."""


def find_bounces(traces: Sequence[Trace], foot: str, level: float) -> tuple[list[Moment], list[Excluded]]:
    """Impacts with a rebound in records, and those that cannot be used, with the reason.

    An impact lies between two samples, at most two apart, at which the foot approaches and departs; between
    impacts, and between an impact and a stretch on the ground, there must be samples enough. A jump of the drive, whose
    moment no sample tells, ends what is fitted; one sample on that side is enough where the other has the rest, for
    all coordinates of the state are measured."""
    found: list[Moment] = []
    left: list[Excluded] = []
    for number, trace in enumerate(traces):
        k = trace.point(foot)
        x, v = trace.x[k] - level, trace.v[k]
        impacts, slow = impacts_at_ground(x, v, trace.noise_x[k], trace.noise_v[k], trace.step)
        # a place on the ground or an impact ends the flight on either side, a jump of the drive what is fitted of it
        contacts = np.unique(np.concatenate([impacts, np.flatnonzero(slow)]))
        jumps = jumps_of(trace.volts)
        ends = np.unique(np.concatenate([contacts, jumps]))
        for i in impacts.tolist():
            free = _beside(contacts, i, len(v))
            fitted = (0, 0) if i in jumps else _beside(ends, i, len(v))
            few = min(free)
            if few >= FEWEST and min(fitted) > 0 and sum(fitted) >= 2 * FEWEST:
                found.append(Moment(number, i, min(fitted[0], LONGEST), min(fitted[1], LONGEST)))
                continue
            side = "before" if free[0] < free[1] else "after"
            text = f"the impact at {trace.time[i]:.5g} s has only {few} samples of free flight {side} it"
            if few >= FEWEST:
                text = f"the drive jumps {min(fitted)} samples from the impact at {trace.time[i]:.5g} s"
            left.append(Excluded(trace.file, foot, text))
    return found, left


def _beside(ends: NDArray[np.intp], last: int, count: int) -> tuple[int, int]:
    """Samples before and after an impact, the last sample before which is given, to the nearest of some ends."""
    k = int(np.searchsorted(ends, last))
    before = last - int(ends[k - 1]) if k else last + 1
    k = int(np.searchsorted(ends, last, side="right"))
    return before, int(ends[k]) - last if k < len(ends) else count - 1 - last


@dataclass(frozen=True)
class BounceFit:
    """Impacts as fitted.

    unknowns (ni, q): moment [s] after the last sample before the impact, places and speeds of the free coordinates,
    where the impact map is free the velocities [m/s] it adds to the mass-weighted one, approach and departure
    velocity of the foot [m/s]; speeds (ni, 2): departure and approach velocity along the normal; covariance (ni, 2,
    2) of the two; chi (ni,): chi-squared per degree of freedom; residuals: (ni) arrays; changes (np, q): the
    points' changes of velocity from the unknowns; inverse (ni, q, q): covariance of the unknowns."""

    unknowns: Floats
    speeds: Floats
    covariance: Floats
    chi: Floats
    residuals: tuple[Floats, ...]
    changes: Floats
    inverse: Floats

    def free(self, model: FootModel) -> bool:
        """Whether the velocities of all coordinates jumped as they like."""
        return self.unknowns.shape[1] > 1 + 2 * (len(model.row) - 1) + 2


class Bounces(Stretches[Moment]):
    """Impacts of several records, ready to be fitted with any model and film."""

    none = "no record shows a rebound with samples enough on both sides"

    def fit(
        self,
        model: FootModel,
        film: FilmConstants,
        start: Floats | None = None,
        free: bool = False,
    ) -> BounceFit:
        """Fit every impact; ``free``: the velocities of all coordinates jump as they like, rather than by the
        mass-weighted law."""
        bounced = Bounced(self, model, free)
        guess = bounced.guess() if start is None else start
        found = descend(
            lambda own, _, part: bounced.equations(own, film.law(), part).alone(), guess, how=_DESCENT
        )
        residuals = bounced.flown(found.own, film.law())[0]
        inverse = found.equations.covariance()
        covariance = np.asarray(inverse[:, [-1, -2]][:, :, [-1, -2]], dtype=np.float64)
        chi = found.equations.cost / found.equations.count
        return BounceFit(
            found.own, found.own[:, [-1, -2]], covariance, chi, tuple(residuals), bounced.changes, inverse
        )

    def about(self, model: FootModel, film: FilmConstants, unknowns: Floats, free: bool) -> NormalEquations:
        """Normal equations of impacts at their unknowns (ni, q) and what they share: the logarithms of the film's
        coefficient and thickness, then the displacement offsets [m] of the points in every record with impacts."""
        residuals, slopes, _ = Bounced(self, model, free).flown(unknowns, film.law())
        record = np.unique([one.trace for one in self.items], return_inverse=True)[1]
        points, every = len(model.points), []
        for one, number, slope, residual in zip(self.items, record, slopes, residuals, strict=True):
            common = np.zeros((points * (int(record.max()) + 1), *residual.shape))
            for k, noise in enumerate(self.traces[one.trace].noise_x):
                common[points * number + k, k] = -1.0 / noise
            every.append(np.concatenate([slope, common.reshape(len(common), -1)]))
        return equations_of(residuals, every, unknowns.shape[1])

    def moved(self, model: FootModel, film: FilmConstants, fitted: BounceFit) -> Floats:
        """Departure and approach velocities (ni, 2) for a model near the fitted one, by one Gauss-Newton step."""
        bounced = Bounced(self, model, fitted.free(model))
        system = bounced.equations(fitted.unknowns, film.law()).alone()
        return (fitted.unknowns + system.step()[0])[:, [-1, -2]]


class Bounced(FlownStretches[Moment]):
    """Flights to both sides of impacts by a model. Besides the moment, which counts from the last sample before, and
    the state each has the velocities that the impact adds beside the mass-weighted ones where these are free, and the
    foot's approach and departure velocity."""

    def __init__(self, bounces: Bounces, model: FootModel, free: bool) -> None:
        self.jumps_freely = free
        super().__init__(bounces, model)

    def of_sides(self) -> tuple[FlightSide, ...]:
        """Back from just before the impact, and onward from just after it."""
        n, m = self.free.shape
        beside = self.free if self.jumps_freely else self.free[:, :0]
        q = 3 + 2 * m + beside.shape[1]
        before = np.zeros((2 * n, q))
        before[:n, 1 : 1 + m] = before[n:, 1 + m : 1 + 2 * m] = self.free
        before[n:, q - 2] = self.model.row / float(self.model.row @ self.model.row)
        change = np.zeros((n, q))
        change[:, 1 + 2 * m : q - 2] = beside
        change[:, q - 2], change[:, q - 1] = -self.model.jump, self.model.jump
        after = before.copy()
        after[n:] += change
        self.changes = self.model.rows @ change
        return FlightSide(before, (0.0, 1.0), back=True), FlightSide(after, (-self.stretches.step, 1.0))

    def guess(self) -> Floats:
        """First unknowns (ni, q): the foot's lines through the samples around the impact meet there."""
        out, k, step = [], self.model.points.index(self.model.foot_point), self.stretches.step
        points, normal = len(self.model.points), self.model.normal
        basis, beside = self.model.rows @ self.free, self.sides[0].rates.shape[1] - 3 - 2 * self.free.shape[1]
        for one, measured in zip(self.stretches.items, self.measured, strict=True):
            last = measured[:, one.before - 1]
            approach = normal * last[points + k]
            departure = normal * measured[points + k, one.before]
            height = self.model.gap + normal * last[k]
            late = float(np.clip(-height / approach, 0.05 * step, 0.95 * step))
            at = np.linalg.lstsq(basis, last[:points] - self.model.rows @ self.grounded, rcond=None)[0]
            along = self.model.rows @ (self.model.row / float(self.model.row @ self.model.row))
            speed = np.linalg.lstsq(basis, last[points:] - along * approach, rcond=None)[0]
            out.append([late, *at, *speed, *np.zeros(beside), approach, departure])
        return np.array(out)


@dataclass(frozen=True)
class RecordOffsets:
    """What is to be added to the displacements of each record's points.

    by_offset (ni, 2, nr np): change of departure and approach velocity of each impact with it [1/s]; values (nr, np)
    [m]; samples (draws, nr, np)."""

    by_offset: Floats
    values: Floats
    samples: Floats

    def moved(self, speeds: Floats, values: Floats) -> Floats:
        """Departure and approach velocities (ni, 2) for offsets (nr, np)."""
        return speeds + self.by_offset @ values.ravel()


def known_offsets(model: FootModel, bounces: Bounces, level_error: float) -> Floats:
    """Information (nr np, nr np) [1/m^2] about the zeros of the records with impacts, in the order of their numbers,
    from the rest of each and the common level [m]."""
    names = np.unique([one.trace for one in bounces.items])
    shift = (model.rest(bounces.level + 1e-6) - model.rest(bounces.level)) / 1e-6
    own = np.concatenate([bounces.traces[int(name)].zero ** 2 for name in names])
    common = np.tile(shift, len(names)) * level_error
    return np.asarray(np.linalg.inv(np.diag(own) + np.outer(common, common)), dtype=np.float64)


def offsets_of_records(
    model: FootModel, bounces: Bounces, equations: NormalEquations, level_error: float, seed: int
) -> RecordOffsets:
    """Least squares of all records together: each record's offsets are known to the error of its rest, the ground to
    that of the level, and the impacts tell the rest.

    equations: of the impacts about the film and the offsets (`Bounces.about`); the film is known.
    """
    system = equations.gathered(2, known_offsets(model, bounces, level_error))
    covariance, values = system.covariance()[0], system.step(held=True)[0][0]
    random = np.random.default_rng([seed, 19])
    drawn = random.multivariate_normal(values, 0.5 * (covariance + covariance.T), DRAWS, method="cholesky")
    shape = -1, len(model.points)
    by_offset = np.asarray(
        -np.linalg.solve(equations.own, equations.across)[:, [-1, -2], 2:], dtype=np.float64
    )
    return RecordOffsets(by_offset, values.reshape(shape), drawn.reshape(DRAWS, *values.reshape(shape).shape))
