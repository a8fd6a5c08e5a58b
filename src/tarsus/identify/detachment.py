"""Detachments: the motion of the structure from the moment at which its foot leaves the ground.

Until the moment the foot stands still. A fit of the flight from there on tells the moment, the state at it, and with
them the pull (2.13) at which the foot let go; all flights together tell the film."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from tarsus.base.arrays import Floats
from tarsus.fit.normal_equations import Descent, NormalEquations, descend
from tarsus.identify.flight import (
    FilmConstants,
    FlightSide,
    FlownStretches,
    Moment,
    Stretches,
    Varied,
    equations_of,
)
from tarsus.identify.foot import FootModel
from tarsus.identify.traces import Hold, Trace, holds
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
_JOINT = Descent(rounds=30, far=1.0)
"""For flights and film together; beyond a factor of e the flights are not linear in the film."""
_BEGINNING = 48
"""Samples by which a guess of the moment is tried: they show the state at the release, at a part of the cost."""
_LANDING = 8
"""Samples before a contact by which the speed of its landing is judged."""
_TRIED = (0.0, 0.7, -0.7)
"""Samples by which the first guess of the moment of release is varied."""
PRIOR = (3.0, 2.0)
"""Standard deviations of log C/g0^3 and log g0 about the first guess, which only keep a fit from running away."""
_LIMITS = (np.log(1e-8), np.log(1e-2))
"""Film thicknesses [m] between which a fit searches, as logarithms."""
WORST = 5.0
"""Chi-squared per degree of freedom beyond which a flight is not that of this structure."""


@dataclass(frozen=True)
class FilmGuess:
    """Film by what the data determine: log of C / g0^3 [N s/m] and log of g0 [m]."""

    stiffness: float
    thickness: float

    @staticmethod
    def of(coefficient: float, thickness: float) -> FilmGuess:
        """From C [N m^2 s] and g0 [m]."""
        return FilmGuess(float(np.log(coefficient / thickness**3)), float(np.log(thickness)))

    @property
    def film(self) -> FilmConstants:
        """The law's own parameters, between the limits of a search."""
        g0 = float(np.exp(np.clip(self.thickness, *_LIMITS)))
        return FilmConstants(float(np.exp(self.stiffness)) * g0**3, g0)

    @property
    def law(self) -> Varied:
        """As flights feel it, with derivatives by these two."""
        moves = float(_LIMITS[0] < self.thickness < _LIMITS[1])
        return self.film.law(np.array([[1.0, 3.0 * moves], [0.0, moves]]))


@dataclass(frozen=True)
class Detachment(Moment):
    """One detachment in a record, with the hold before it; no sample before the moment is used."""

    hold: Hold

    @property
    def first(self) -> int:
        """First sample that is fitted."""
        return self.last + 1


@dataclass(frozen=True)
class FittedDetachments:
    """Detachments fitted together with one film.

    unknowns (nr, q): time [s] from the moment to the first sample, places and speeds of the free coordinates, force
    that the drive's law misses at the first sample [N] and its drift [N/s]; film; pull, pull_error (nr,) [N];
    duration (nr,) [s] of the hold before; chi (nr,): chi-squared per degree of freedom; information (nr, 2, 2) and
    score (nr, 2) about the film, all unknowns of a flight taken along; by_film (nr, 2): change of each pull with
    the film; residuals, flights: (nr) arrays
    (channels, samples); cost (nr,): chi-squared."""

    unknowns: Floats
    film: FilmGuess
    pull: Floats
    pull_error: Floats
    duration: Floats
    chi: Floats
    information: Floats
    score: Floats
    by_film: Floats
    residuals: tuple[Floats, ...]
    flights: tuple[Floats, ...]
    cost: Floats


def find_detachments(
    traces: Sequence[Trace], foot: str, level: float
) -> tuple[list[Detachment], list[Excluded]]:
    """Detachments in records, and those that cannot be used, with the reason."""
    found: list[Detachment] = []
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
                        trace.file,
                        foot,
                        f"the foot is back on the ground too soon after its release at {at:.5g} s",
                    )
                )
                continue
            found.append(Detachment(number, first - 1, 0, end - first, hold))
    return found, left


class Detachments(Stretches[Detachment]):
    """Detachments of several records, ready to be fitted with any model."""

    none = "no record shows a foot that lets go of the ground and then flies long enough"

    def beginnings(self, foot: str) -> Floats:
        """How well the moments are known at which the contacts began (nr,) [s]: half a sample, or the time in which a
        foot that lands slowly crosses the noise."""
        out = []
        for one in self.items:
            trace = self.traces[one.trace]
            k = trace.point(foot)
            before = slice(max(one.hold.first - _LANDING, 0), max(one.hold.first - 1, 1))
            speed = max(float(np.median(np.abs(trace.v[k, before]))), float(trace.noise_v[k]))
            out.append(np.hypot(0.5 * self.step, STILL * trace.noise_x[k] / speed) / np.sqrt(3.0))
        return np.array(out)

    def fit(
        self,
        model: FootModel,
        film: FilmGuess,
        start: Floats | None = None,
        fixed: bool = False,
        about: FilmGuess | None = None,
    ) -> FittedDetachments:
        """Fit all flights with one film.

        Parameters
        ----------
        model
            Structure and drive.
        film
            First guess.
        start
            First unknowns (nr, q).
        fixed
            Whether the film stays as it is.
        about
            What is known of the film beforehand, within `PRIOR`; the first guess where there is nothing else.
        """
        released = Released(self, model)
        shared = np.array([film.stiffness, film.thickness])
        unknowns = released.under(self._tried(model, film), film) if start is None else start
        if not fixed:
            centre = shared if about is None else np.array([about.stiffness, about.thickness])
            found = descend(released.about, unknowns, shared, prior=(centre, weak()), how=_JOINT)
            unknowns, film = found.own, FilmGuess(*found.shared.tolist())
        return released.result(unknowns, film)

    def _tried(self, model: FootModel, film: FilmGuess) -> Floats:
        """Unknowns from the beginnings of the flights, each flight's best from several first guesses of the
        moment.

        Two moments less than a sample apart may fit as well, one with the foot still pressed to the ground. A
        pressed foot cannot let go: what its pull is below zero counts against a guess, by the pull's own error.
        """
        items = [replace(one, after=min(one.after, _BEGINNING)) for one in self.items]
        released = Released(Detachments(self.traces, items, self.level, self.volts), model)
        unknowns = released.guess()
        best, kept = np.full(len(unknowns), np.inf), unknowns
        for late in _TRIED:
            tried = unknowns.copy()
            tried[:, 0] += late * self.step
            tried = released.under(tried, film)
            found = released.result(tried, film)
            cost = found.cost + (np.minimum(found.pull, 0.0) / found.pull_error) ** 2
            kept = np.where((cost < best)[:, None], tried, kept)
            best = np.where(cost < best, cost, best)
        return kept

    def moved(self, model: FootModel, fitted: FittedDetachments, about: FilmGuess) -> tuple[Floats, Floats]:
        """Film (2,) and pulls (nr,) for a model near the fitted one, by one Gauss-Newton step; about: as in `fit`."""
        released, film = Released(self, model), fitted.film
        shared = np.array([film.stiffness, film.thickness])
        every = np.arange(len(self.items))
        pull = weak() @ (np.array([about.stiffness, about.thickness]) - shared)
        own, step = released.about(fitted.unknowns, shared, every).step(0.0, weak(), pull)
        return shared + step, released.pulls(fitted.unknowns + own)[0]


def weak() -> Floats:
    """Information (2, 2) about the logarithms of C / g0^3 and g0 that keeps a fit from running away."""
    return np.diag([PRIOR[0] ** -2, PRIOR[1] ** -2])


class Released(FlownStretches[Detachment]):
    """Flights of detachments by a model. Besides the moment, which counts back from the first sample, and the state
    each has two unknowns: the force that the drive's law misses at the first sample [N], and its drift [N/s]."""

    stretches: Detachments

    def of_sides(self) -> tuple[FlightSide, ...]:
        """Onward alone."""
        n, m = self.free.shape
        rates, offset = np.zeros((2 * n, 2 * m + 3)), np.zeros((2, 2 * m + 3))
        rates[:n, 1 : 1 + m] = rates[n:, 1 + m : 1 + 2 * m] = self.free
        offset[:, -2:] = np.eye(2)
        return (FlightSide(rates, (0.0, -1.0), offset=offset),)

    def guess(self) -> Floats:
        """First unknowns (nr, q)."""
        model, offs, basis = self.model, self.stretches, self.model.rows @ self.free
        out = []
        for one in offs.items:
            trace = offs.traces[one.trace]
            near = slice(max(one.hold.last - 4, one.hold.first), one.hold.last + 1)
            x = trace.x[:, near].mean(axis=1) + model.rest(offs.level)
            v = trace.v[:, near].mean(axis=1)
            at = np.linalg.lstsq(basis, x - model.rows @ self.grounded, rcond=None)[0]
            speed = np.linalg.lstsq(basis, v, rcond=None)[0]
            out.append([(one.first - one.hold.last - 0.5) * offs.step, *at, *speed, 0.0, 0.0])
        return np.array(out)

    def under(self, unknowns: Floats, film: FilmGuess) -> Floats:
        """Unknowns of every flight under one film, each by a descent of its own."""
        return descend(
            lambda own, _, part: self.equations(own, film.law, part).alone(), unknowns, how=_ROUGH
        ).own

    def about(self, unknowns: Floats, shared: Floats, part: NDArray[np.intp]) -> NormalEquations:
        """Normal equations of the flights of these numbers and the film (2,)."""
        return self.equations(unknowns, FilmGuess(*shared.tolist()).law, part)

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

    def result(self, unknowns: Floats, film: FilmGuess) -> FittedDetachments:
        """Pulls with their errors, at the end of a fit."""
        residuals, whole, flights = self.flown(unknowns, film.law)
        system = equations_of(residuals, whole, unknowns.shape[1])
        information, score = system.reduced()
        pull, slopes = self.pulls(unknowns)
        chi = system.cost / system.count
        error = np.sqrt(np.einsum("rq,rqp,rp->r", slopes, system.covariance(), slopes) * np.maximum(chi, 1.0))
        by_film = -np.einsum("rq,rqa->ra", slopes, np.linalg.solve(system.own, system.across))
        begun = (
            np.array([one.first - one.hold.first for one in self.stretches.items]) + 0.5
        ) * self.stretches.step
        return FittedDetachments(
            unknowns, film, pull, error, begun - unknowns[:, 0], chi, information, score, by_film, tuple(residuals),
            tuple(flights), system.cost,
        )  # fmt: skip
