"""Detachments: the motion of the structure from the moment at which its foot leaves the ground.

Until the moment the foot stands still. A fit of the flight from there on gives the moment, the state at it, and with
them the pull (2.13) at release; all flights together give the film."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from tarsus.base.arrays import Floats
from tarsus.fit.normal_equations import Descent
from tarsus.identify.flight import FlightFit, FlightParameters, FlightProblem, FlightSide, SegmentStart
from tarsus.identify.traces import Trace, holds
from tarsus.impacts.detection import STILL
from tarsus.records.excluded import Excluded

LONGEST = 0.025
"""Time [s] of a flight that is fitted at most."""

FEWEST = 24
"""Samples a flight must have."""

_SKIPPED = 2
"""Samples after the hold that are not fitted: the first may still be on the ground, the second smeared by a filter."""
_ROUGH = Descent(rounds=12, settled=0.1, damping=1e-2)
"""For flights under one film, which only begin a joint fit or choose among flights: a tenth of a standard error."""
JOINT = Descent(rounds=30, far=1.0)
"""For flights and film together; beyond a factor of e the flights are not linear in the film."""
_BEGINNING = 48
"""Samples by which a guess of the moment is tried: they show the state at the release, at a part of the cost."""
_LANDING = 8
"""Samples before a contact by which the speed of its landing is judged."""
_TRIED = (0.0, 0.7, -0.7)
"""Samples by which the first guess of the moment of release is varied."""


@dataclass(frozen=True)
class Pulls:
    """Pulls (nr,) [N] at the moments of release, with standard errors; duration (nr,) [s] of the hold before; by_film
    (nr, p): change of each pull with what the flights share."""

    pull: Floats
    error: Floats
    duration: Floats
    by_film: Floats


def find_detachments(traces: Sequence[Trace], foot: str, level: float) -> tuple[list[SegmentStart], list[Excluded]]:
    """Detachments in records, and those that cannot be used, with the reason."""
    found: list[SegmentStart] = []
    left: list[Excluded] = []
    for number, trace in enumerate(traces):
        k = trace.point(foot)
        height = trace.x[k] - level
        stays = holds(trace, foot, level)
        then = [*(one.first for one in stays), len(trace.time)][1:]
        for hold, following in zip(stays, then, strict=True):
            if hold.last >= len(trace.time) - FEWEST:
                continue
            first = hold.last + _SKIPPED
            # a hop that noise hides ends where the foot stands again
            end = min(first + round(LONGEST / trace.step), following)
            away = np.flatnonzero(height[first:end] > 3.0 * STILL * trace.noise_x[k])
            if len(away):
                back = np.flatnonzero(height[first + away[0] : end] < STILL * trace.noise_x[k])
                if len(back):
                    end = first + int(away[0]) + int(back[0]) - 2
            at = trace.time[hold.last]
            if not len(away) or end - first < FEWEST:
                left.append(
                    Excluded(
                        trace.file, foot, f"the foot is back on the ground too soon after its release at {at:.5g} s"
                    )
                )
                continue
            found.append(SegmentStart(number, first - 1, 0, end - first, hold))
    return found, left


class Detachments(FlightProblem):
    """Flights from detachments of several records. Besides the moment, which counts back from the first sample, and the
    state each has two unknowns: the force that the drive's law misses at the first sample [N], and its drift [N/s]."""

    def of_sides(self) -> tuple[FlightSide, ...]:
        """Onward alone."""
        n, m = self.free.shape
        rates, offset = np.zeros((2 * n, 2 * m + 3)), np.zeros((2, 2 * m + 3))
        rates[:n, 1 : 1 + m] = rates[n:, 1 + m : 1 + 2 * m] = self.free
        offset[:, -2:] = np.eye(2)
        return (FlightSide(rates, (0.0, -1.0), offset=offset),)

    def beginnings(self) -> Floats:
        """How well the moments are known at which the contacts began (nr,) [s]: half a sample, or the time in which a
        foot that lands slowly crosses the noise."""
        out = []
        for one in self.items:
            trace = self.traces[one.trace]
            k = trace.point(self.model.foot_point)
            before = slice(max(one.hold.first - _LANDING, 0), max(one.hold.first - 1, 1))
            speed = max(float(np.median(np.abs(trace.v[k, before]))), float(trace.noise_v[k]))
            out.append(np.hypot(0.5 * self.step, STILL * trace.noise_x[k] / speed) / np.sqrt(3.0))
        return np.array(out)

    def guess(self) -> Floats:
        """First unknowns (nr, q)."""
        model, basis = self.model, self.model.rows @ self.free
        begun, points = np.zeros(len(self.items)), len(self.model.points)
        motion = np.zeros((2, points, len(self.items)))
        for r, one in enumerate(self.items):
            trace, near = self.traces[one.trace], slice(max(one.hold.last - 4, one.hold.first), one.hold.last + 1)
            motion[:, :, r] = trace.x[:, near].mean(axis=1), trace.v[:, near].mean(axis=1)
            begun[r] = (one.first - one.hold.last - 0.5) * self.step
        motion[0] += (model.rest(self.level) - model.rows @ self.grounded)[:, None]
        at, speed = (np.linalg.lstsq(basis, one, rcond=None)[0].T for one in motion)
        return np.column_stack([begun, at, speed, np.zeros((len(begun), 2))])

    def under(self, parameters: FlightParameters, place: Floats, start: Floats | None = None) -> FlightFit:
        """All flights under one film, each by a descent of its own, from unknowns (nr, q) or the best of some."""
        law = parameters.law(self.model, place).value
        begun = self._tried(parameters, place) if start is None else start
        found = self.alone(begun, law, _ROUGH)
        return FlightFit(self, parameters, found.own, place, found.equations)

    def _tried(self, parameters: FlightParameters, place: Floats) -> Floats:
        """Unknowns from the beginnings of the flights, each flight's best from several first guesses of the
        moment.

        Two moments less than a sample apart may fit as well, one with the foot still pressed to the ground. A pressed
        foot cannot detach: what its pull is below zero counts against a guess, by the pull's own error.
        """
        begun = self.of([replace(one, after=min(one.after, _BEGINNING)) for one in self.items])
        unknowns = begun.guess()
        best, kept = np.full(len(unknowns), np.inf), unknowns
        for late in _TRIED:
            tried = unknowns.copy()
            tried[:, 0] += late * self.step
            found = begun.under(parameters, place, tried)
            pulls = begun.pulls_of(found)
            cost = found.system.cost + (np.minimum(pulls.pull, 0.0) / pulls.error) ** 2
            kept = np.where((cost < best)[:, None], found.unknowns, kept)
            best = np.where(cost < best, cost, best)
        return kept

    def pulls(self, unknowns: Floats) -> tuple[Floats, Floats]:
        """Pull of the structure (nr,) [N] at the moments of release, and its slopes (nr, q) by the unknowns."""
        late, near = unknowns[:, 0], self.near[0]
        last, flight = near.shape[1] - 1, np.arange(len(unknowns))
        place = np.clip(last - late / self.flows[0].step, 0.0, last - 1e-9)
        whole = place.astype(np.intp)
        rise = near[flight, whole + 1] - near[flight, whole]
        force = near[flight, whole] + (place - whole) * rise + unknowns[:, -2] - unknowns[:, -1] * late
        pull = self.model.pull(self.states(unknowns).T, force)
        by_force = np.zeros_like(unknowns)
        by_force[:, 0] = -rise / self.flows[0].step - unknowns[:, -1]
        by_force[:, -2], by_force[:, -1] = 1.0, -late
        rates, n = self.sides[0].rates, len(self.grounded)
        per_newton = float(self.model.row @ self.model.inputs[n:, 0]) / self.model.mobility
        return pull, self.model.pull(rates, np.zeros(rates.shape[1])) + by_force * per_newton

    def pulls_of(self, found: FlightFit) -> Pulls:
        """Pulls with their errors, at the end of a fit."""
        system, (pull, slopes) = found.system, self.pulls(found.unknowns)
        error = np.sqrt(np.einsum("rq,rqp,rp->r", slopes, system.covariance(), slopes) * np.maximum(found.chi, 1.0))
        by_film = -np.einsum("rq,rqa->ra", slopes, np.linalg.solve(system.own, system.across))
        begun = (np.array([one.first - one.hold.first for one in self.items]) + 0.5) * self.step
        return Pulls(pull, error, begun - found.unknowns[:, 0], by_film)
