"""Bounces: the motion on both sides of an impact of the foot, fitted together.

The foot is on the ground at the impact and its velocity changes there, together with the rest of the structure's by
the mass-weighted impact law; before and after it the structure flies free.

Where the ground is as seen from a record is known from the rest before it, some ten nanometres uncertain, and from the
common level of all records. At an impact the structure's modes accelerate the foot by thousands of m/s^2, so that its
velocity at the ground depends on it; the flights before and after the impact meet there, which determines it too.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tarsus.base.arrays import Floats
from tarsus.fit.normal_equations import Descent, Minimum, NormalEquations
from tarsus.identify.flight import (
    WORST,
    FlightProblem,
    FlightSide,
    SegmentStart,
    equations_of,
    ground_constants,
    known_law,
)
from tarsus.identify.foot import FootModel
from tarsus.identify.traces import Trace
from tarsus.identify.volts import jumps_of
from tarsus.impacts.detection import impacts_at_ground
from tarsus.records.excluded import Excluded
from tarsus.solve import Varied

LONGEST = 20
"""Samples on each side of an impact that are fitted at most."""

FEWEST = 5
"""Samples of free flight there must be on each side, so that no other contact hides between them."""

_STRENGTHS = [0, 2]
"""Places of C and C_e among the constants of the forces at the foot."""

_DESCENT = Descent(rounds=15)
"""Fifteen rounds: an impact that needs more is no single one, and `sound` looks whether it has settled."""


def find_bounces(traces: Sequence[Trace], foot: str, level: float) -> tuple[list[SegmentStart], list[Excluded]]:
    """Impacts with a rebound in records, and those that cannot be used, with the reason.

    An impact lies between two samples, at most two apart, at which the foot approaches and departs; between
    impacts, and between an impact and a stretch on the ground, there must be samples enough. A jump of the drive, whose
    moment no sample shows, ends what is fitted; one sample on that side is enough where the other has the rest, for all
    coordinates of the state are measured."""
    found: list[SegmentStart] = []
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
            free = _clear(contacts, i, len(v))
            fitted = (0, 0) if i in jumps else _clear(ends, i, len(v))
            few = min(free)
            if few >= FEWEST and min(fitted) > 0 and sum(fitted) >= 2 * FEWEST:
                found.append(SegmentStart(number, i, min(fitted[0], LONGEST), min(fitted[1], LONGEST)))
                continue
            side = "before" if free[0] < free[1] else "after"
            text = f"the impact at {trace.time[i]:.5g} s has only {few} samples of free flight {side} it"
            if few >= FEWEST:
                text = f"the drive jumps {min(fitted)} samples from the impact at {trace.time[i]:.5g} s"
            left.append(Excluded(trace.file, foot, text))
    return found, left


def _clear(ends: NDArray[np.intp], last: int, count: int) -> tuple[int, int]:
    """Samples before and after an impact, the last sample before which is given, to the nearest of some ends."""
    k = int(np.searchsorted(ends, last))
    before = last - int(ends[k - 1]) if k else last + 1
    k = int(np.searchsorted(ends, last, side="right"))
    return before, int(ends[k]) - last if k < len(ends) else count - 1 - last


@dataclass(frozen=True)
class BounceFit:
    """Impacts as fitted.

    unknowns (ni, q): moment [s] after the last sample before the impact, places and speeds of the free coordinates,
    where the impact law is free the velocities [m/s] it adds to the mass-weighted ones, approach and departure velocity
    of the foot [m/s]; inverse (ni, q, q): their covariance; chi (ni,): chi-squared per degree of freedom."""

    unknowns: Floats
    inverse: Floats
    chi: Floats

    @property
    def speeds(self) -> Floats:
        """Departure and approach velocity (ni, 2) along the normal."""
        return self.unknowns[:, [-1, -2]]

    @property
    def covariance(self) -> Floats:
        """Covariance (ni, 2, 2) of the two."""
        return np.asarray(self.inverse[:, [-1, -2]][:, :, [-1, -2]], dtype=np.float64)

    def chosen(self, keep: NDArray[np.bool_]) -> BounceFit:
        """Some of them."""
        return BounceFit(self.unknowns[keep], self.inverse[keep], self.chi[keep])


class Bounces(FlightProblem):
    """Flights to both sides of impacts of several records. Unknowns of each are the moment, counted from the last
    sample before, the state, the velocities that a free impact law adds to the mass-weighted ones, and the foot's
    approach and departure velocity.

    ``free``: the velocities of all coordinates jump freely; unless given, where the device has its own impact law,
    which need not be the mass-weighted one.
    """

    def __init__(
        self,
        traces: Sequence[Trace],
        items: Sequence[SegmentStart],
        level: float,
        model: FootModel,
        free: bool | None = None,
    ) -> None:
        self.jumps_freely = model.scene.ground.impact is not None if free is None else free
        super().__init__(traces, items, level, model)

    def of_sides(self) -> tuple[FlightSide, ...]:
        """Back from just before the impact, and onward from just after it."""
        n, m = self.free.shape
        extra = self.free if self.jumps_freely else self.free[:, :0]
        q = 3 + 2 * m + extra.shape[1]
        before = np.zeros((2 * n, q))
        before[:n, 1 : 1 + m] = before[n:, 1 + m : 1 + 2 * m] = self.free
        before[n:, q - 2] = self.model.row / float(self.model.row @ self.model.row)
        change = np.zeros((n, q))
        change[:, 1 + 2 * m : q - 2] = extra
        change[:, q - 2], change[:, q - 1] = -self.model.jump, self.model.jump
        after = before.copy()
        after[n:] += change
        self.changes = self.model.rows @ change
        return FlightSide(before, (0.0, 1.0), back=True), FlightSide(after, (-self.step, 1.0))

    def guess(self) -> Floats:
        """First unknowns (ni, q): the foot's lines through the samples around the impact meet there."""
        model, step, points = self.model, self.step, len(self.model.points)
        k, normal = model.points.index(model.foot_point), model.normal
        last = np.array([seen[:, one.before - 1] for one, seen in zip(self.items, self.measured, strict=True)]).T
        first = np.array([seen[points + k, one.before] for one, seen in zip(self.items, self.measured, strict=True)])
        approach, departure = normal * last[points + k], normal * first
        late = np.clip(-(model.gap + normal * last[k]) / approach, 0.05 * step, 0.95 * step)
        along = model.rows @ (model.row / float(model.row @ model.row))
        last[:points] -= (model.rows @ self.grounded)[:, None]
        last[points:] -= np.outer(along, approach)
        basis, extra = model.rows @ self.free, self.sides[0].rates.shape[1] - 3 - 2 * self.free.shape[1]
        at, speed = (np.linalg.lstsq(basis, one, rcond=None)[0].T for one in np.split(last, 2))
        return np.column_stack([late, at, speed, np.zeros((len(late), extra)), approach, departure])

    def fit(self, law: Floats | None = None, start: Floats | None = None) -> BounceFit:
        """Fit every impact, under the forces of the model's ground or others (5,), from unknowns (ni, q) if given."""
        begun = self.guess() if start is None else start
        forces = ground_constants(self.model) if law is None else law
        found = self.alone(begun, forces, _DESCENT)
        own, equations = found.own, found.equations
        lost = ~(equations.cost < WORST * equations.count)
        if start is None and lost.any() and forces[_STRENGTHS].any():
            again = self.chosen(lost)._from_afar(begun[lost], forces)
            better = again.equations.cost < equations.cost[lost]
            gained = np.flatnonzero(lost)[better]
            own[gained] = again.own[better]
            equations = equations.replaced(np.isin(np.arange(len(own)), gained), again.equations.chosen(better))
        return BounceFit(own, equations.covariance(), equations.cost / equations.count)

    def _from_afar(self, begun: Floats, forces: Floats) -> Minimum:
        """Impacts fitted from where they fit without forces at the foot: flights from a first guess may dip below the
        ground, where a thin film has a pole, and overflow."""
        bare = forces.copy()
        bare[_STRENGTHS] = 0.0
        return self.alone(self.alone(begun, bare, _DESCENT).own, forces, _DESCENT)

    def about(self, law: Varied, unknowns: Floats) -> NormalEquations:
        """Normal equations of impacts at their unknowns (ni, q) and what they share: the unknowns of the law, then the
        displacement offsets [m] of the points in every record with impacts."""
        residuals, slopes, _ = self.flown(unknowns, law)
        record = np.unique([one.trace for one in self.items], return_inverse=True)[1]
        points, every = len(self.model.points), []
        for one, number, slope, residual in zip(self.items, record, slopes, residuals, strict=True):
            common = np.zeros((points * (int(record.max()) + 1), *residual.shape))
            for k, noise in enumerate(self.traces[one.trace].noise_x):
                common[points * number + k, k] = -1.0 / noise
            every.append(np.concatenate([slope, common.reshape(len(common), -1)]))
        return equations_of(residuals, every, unknowns.shape[1])

    def moved(self, model: FootModel, fitted: BounceFit, level: float | None = None) -> Floats:
        """Departure and approach velocities (ni, 2) for a model, and above a ground [m], near the fitted ones, by one
        Gauss-Newton step."""
        return self._stepped(model, fitted, level)[1][:, [-1, -2]]

    def jumps(self, model: FootModel, fitted: BounceFit) -> Floats:
        """Changes of velocity (ni, np) of all points for a model, near the fitted ones, by one Gauss-Newton step."""
        problem, unknowns = self._stepped(model, fitted)
        return unknowns @ problem.changes.T

    def _stepped(self, model: FootModel, fitted: BounceFit, level: float | None = None) -> tuple[Bounces, Floats]:
        problem = self.by(model, level)
        return problem, fitted.unknowns + problem.equations(fitted.unknowns, known_law(model)).step()[0]


def known_offsets(bounces: Bounces, level_error: float) -> Floats:
    """Information (nr np, nr np) [1/m^2] about the zeros of the records with impacts, in the order of their numbers,
    from the rest of each and the common level [m]."""
    names = np.unique([one.trace for one in bounces.items])
    model = bounces.model
    shift = (model.rest(bounces.level + 1e-6) - model.rest(bounces.level)) / 1e-6
    own = np.concatenate([bounces.traces[int(name)].zero ** 2 for name in names])
    common = np.tile(shift, len(names)) * level_error
    return np.asarray(np.linalg.inv(np.diag(own) + np.outer(common, common)), dtype=np.float64)
