"""Detachments: the motion of the structure from the moment at which its foot leaves the ground.

Until the moment the foot stands still, so that the state at it has few unknowns: where the rest of the structure
is, and how fast. From there on the structure flies free, under the drive's force and the film's. A fit of that
flight tells the moment, the state at it, and with them the pull (2.13) at which the foot let go; all flights
together tell the film."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import null_space

from tarsus.base.errors import InputError
from tarsus.fit.normal_equations import Descent, NormalEquations, descend
from tarsus.identify.flight import SUBSTEPS, FilmConstants, Launches, Varied, observed, of_model
from tarsus.identify.foot import FootModel
from tarsus.identify.traces import Hold, Trace, holds
from tarsus.identify.volts import Volts
from tarsus.impacts.detection import STILL
from tarsus.records.excluded import Excluded

Floats = NDArray[np.float64]

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
_LOOKING_BACK = 8
"""Samples before the flight in which the moment may lie: more than a guess is ever off."""
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
        """The law's own parameters."""
        g0 = float(np.exp(self.thickness))
        return FilmConstants(float(np.exp(self.stiffness)) * g0**3, g0)


@dataclass(frozen=True)
class Detachment:
    """One detachment in a record: the hold before it, first sample that is fitted, number of samples (n)."""

    trace: int
    hold: Hold
    first: int
    count: int


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
        for hold in holds(trace, foot, level):
            if hold.last >= len(trace.time) - FEWEST:
                continue
            first = hold.last + _SKIPPED
            end = min(first + round(LONGEST / trace.step), len(trace.time))
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
            found.append(Detachment(number, hold, first, end - first))
    return found, left


class Detachments:
    """Detachments of several records, ready to be fitted with any model.

    Parameters
    ----------
    traces
        The records.
    items
        Their detachments.
    level
        Contact level from the rest [m].
    """

    def __init__(
        self,
        traces: Sequence[Trace],
        items: Sequence[Detachment],
        level: float,
        volts: Mapping[int, Volts] | None = None,
    ) -> None:
        if not items:
            raise InputError("no record shows a foot that lets go of the ground and then flies long enough")
        self.traces, self.items, self.level = tuple(traces), tuple(items), level
        steps = {round(self.traces[one.trace].step, 12) for one in items}
        if len(steps) > 1:
            raise InputError("the records of detachments are sampled at different rates")
        self.step = self.traces[items[0].trace].step
        needed = {one.trace for one in items}
        self.volts = {k: Volts.of(self.traces[k].volts) for k in needed} if volts is None else volts

    def chosen(self, keep: NDArray[np.bool_]) -> Detachments:
        """Some of them."""
        kept = [one for one, yes in zip(self.items, keep, strict=True) if yes]
        return Detachments(self.traces, kept, self.level, self.volts)

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

    def guess(self, model: FootModel) -> Floats:
        """First unknowns (nr, q)."""
        free = null_space(model.row[None, :])
        out = []
        for one in self.items:
            trace = self.traces[one.trace]
            near = slice(max(one.hold.last - 4, one.hold.first), one.hold.last + 1)
            x = trace.x[:, near].mean(axis=1) + model.rest(self.level)
            v = trace.v[:, near].mean(axis=1)
            basis = model.rows @ free
            at = np.linalg.lstsq(basis, x - model.rows @ _grounded(model), rcond=None)[0]
            speed = np.linalg.lstsq(basis, v, rcond=None)[0]
            out.append([(one.first - one.hold.last - 0.5) * self.step, *at, *speed, 0.0, 0.0])
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
        prepared = _Prepared(self, model)
        shared = np.array([film.stiffness, film.thickness])
        unknowns = self._tried(model, shared) if start is None else start
        if start is None:
            unknowns = _under(prepared, unknowns, shared)
        if not fixed:
            centre = shared if about is None else np.array([about.stiffness, about.thickness])
            found = descend(prepared.equations, unknowns, shared, prior=(centre, weak()), how=_JOINT)
            unknowns, shared = found.own, found.shared
        return prepared.result(unknowns, FilmGuess(float(shared[0]), float(shared[1])))

    def _tried(self, model: FootModel, shared: Floats) -> Floats:
        """Unknowns from the beginnings of the flights, each flight's best from several first guesses of the
        moment.

        Two moments less than a sample apart may fit as well, one with the foot still pressed to the ground. A
        pressed foot cannot let go: what its pull is below zero counts against a guess, by the pull's own error.
        """
        items = [replace(one, count=min(one.count, _BEGINNING)) for one in self.items]
        begun = Detachments(self.traces, items, self.level, self.volts)
        prepared, unknowns = _Prepared(begun, model), self.guess(model)
        best, kept = np.full(len(unknowns), np.inf), unknowns
        for late in _TRIED:
            tried = unknowns.copy()
            tried[:, 0] += late * self.step
            tried = _under(prepared, tried, shared)
            found = prepared.result(tried, FilmGuess(float(shared[0]), float(shared[1])))
            cost = found.cost + (np.minimum(found.pull, 0.0) / found.pull_error) ** 2
            kept = np.where((cost < best)[:, None], tried, kept)
            best = np.where(cost < best, cost, best)
        return kept

    def moved(self, model: FootModel, fitted: FittedDetachments, about: FilmGuess) -> tuple[Floats, Floats]:
        """Film (2,) and pulls (nr,) for a model near the fitted one, by one Gauss-Newton step; about: as in `fit`."""
        prepared = _Prepared(self, model)
        shared = np.array([fitted.film.stiffness, fitted.film.thickness])
        every = np.arange(len(self.items))
        pull = weak() @ (np.array([about.stiffness, about.thickness]) - shared)
        own, step = prepared.equations(fitted.unknowns, shared, every).step(0.0, weak(), pull)
        return shared + step, prepared.pulls(fitted.unknowns + own)


def weak() -> Floats:
    """Information (2, 2) about the logarithms of C / g0^3 and g0 that keeps a fit from running away."""
    return np.diag([PRIOR[0] ** -2, PRIOR[1] ** -2])


def _under(prepared: _Prepared, unknowns: Floats, shared: Floats) -> Floats:
    """Unknowns of every flight under one film (2,), each by a descent of its own."""

    def alone(own: Floats, _: Floats, part: NDArray[np.intp]) -> NormalEquations:
        residuals, slopes, _flights = prepared.flown(own, shared, part)
        return _equations(residuals, [one[: own.shape[1]] for one in slopes], own.shape[1])

    return descend(alone, unknowns, how=_ROUGH).own


def _equations(residuals: Sequence[Floats], slopes: Sequence[Floats], own: int) -> NormalEquations:
    """Of flights: what was measured less what was flown, and slopes (q + p, n) of the flights, over the noise."""
    return NormalEquations.of([-one.ravel() for one in residuals], [one.T for one in slopes], own)


def _grounded(model: FootModel) -> Floats:
    """Coordinates (n,) with the foot on the ground, the shortest ones."""
    return -model.gap * model.row / float(model.row @ model.row)


class _Prepared:
    """Everything of detachments that depends on the model but not on the unknowns."""

    def __init__(self, offs: Detachments, model: FootModel) -> None:
        self.offs, self.model = offs, model
        self.flow = of_model(model, offs.step / SUBSTEPS)
        self.free = null_space(model.row[None, :])
        self.grounded = _grounded(model)
        rest = model.rest(offs.level)
        count = len(offs.items)
        self.counts = np.array([one.count for one in offs.items])
        self.drive = np.zeros((count, SUBSTEPS * (int(self.counts.max()) - 1) + 1))
        self.near = np.zeros((count, SUBSTEPS * _LOOKING_BACK + 1))
        self.measured: list[Floats] = []
        self.white: list[Floats] = []
        for r, one in enumerate(offs.items):
            trace = offs.traces[one.trace]
            force = offs.volts[one.trace].force(model.law, model.history, one.first, one.count)
            back = min(one.first, _LOOKING_BACK)
            before = offs.volts[one.trace].force(model.law, model.history, one.first - back, back + 1)
            self.near[r, self.near.shape[1] - len(before) :] = before
            self.near[r, : self.near.shape[1] - len(before)] = before[0]
            self.drive[r, : len(force)] = force
            part = slice(one.first, one.first + one.count)
            self.measured.append(np.concatenate([trace.x[:, part] + rest[:, None], trace.v[:, part]]))
            self.white.append(np.concatenate([trace.noise_x, trace.noise_v]))
        self.output = observed(model)

    def states(self, unknowns: Floats) -> Floats:
        """States (2n, nr) at the moments of release."""
        m = self.free.shape[1]
        x = self.grounded[:, None] + self.free @ unknowns[:, 1 : 1 + m].T
        v = self.free @ unknowns[:, 1 + m : 1 + 2 * m].T
        return np.concatenate([x, v])

    def pulls(self, unknowns: Floats) -> Floats:
        """Pull of the structure (nr,) [N] at the moments of release."""
        late = unknowns[:, 0]
        force = self._before(late) + unknowns[:, -2] - unknowns[:, -1] * late
        return self.model.pull(self.states(unknowns), force)

    def _before(self, late: Floats) -> Floats:
        """Drive force [N] by the law at times ``late`` (nr,) [s] before the first samples."""
        last = self.near.shape[1] - 1
        place = np.clip(last - late / self.flow.step, 0.0, last - 1e-9)
        whole = place.astype(np.intp)
        part, flight = place - whole, np.arange(len(late))
        return (1.0 - part) * self.near[flight, whole] + part * self.near[flight, whole + 1]

    def launches(self, unknowns: Floats, shared: Floats, numbers: NDArray[np.intp]) -> Launches:
        """Flights of these numbers at the unknowns (nr, q) and the film (2,), with derivatives by both."""
        count, q = unknowns.shape
        n, m = self.free.shape
        state, begin, offset = (np.zeros((count, *shape, q + 2)) for shape in ((2 * n,), (), (2,)))
        state[:, :n, 1 : 1 + m] = state[:, n:, 1 + m : 1 + 2 * m] = self.free
        begin[:, 0] = -1.0
        offset[:, 0, q - 2] = offset[:, 1, q - 1] = 1.0
        by_log = np.zeros((2, q + 2))
        moves = float(_LIMITS[0] < shared[1] < _LIMITS[1])
        by_log[0, q:], by_log[1, q + 1] = (1.0, 3.0 * moves), moves
        thickness = float(np.exp(np.clip(shared[1], *_LIMITS)))
        film = FilmConstants(float(np.exp(shared[0])) * thickness**3, thickness)
        return Launches(
            Varied(self.states(unknowns).T, state), Varied(-unknowns[:, 0], begin), Varied(unknowns[:, -2:], offset),
            film.column(count, by_log=(by_log[0], by_log[1])), np.full(count, self.model.gap), self.near[numbers],
            self.flow.step,
        )  # fmt: skip

    def flown(
        self, unknowns: Floats, shared: Floats, part: NDArray[np.intp]
    ) -> tuple[list[Floats], list[Floats], list[Floats]]:
        """Of the flights of these numbers at the unknowns (nr, q) and the film (2,): what they leave over the noise
        (channels, samples), its slopes (q + 2, channels times samples) by the flight's unknowns and the film, and the
        flights (channels, samples)."""
        q, counts = unknowns.shape[1], self.counts[part]
        launches = self.launches(unknowns, shared, part)
        values, by_unknown = self.flow.fly(launches, self.drive[part], counts, self.output)
        residuals, slopes, flights = [], [], []
        for r, end, count in zip(part.tolist(), np.cumsum(counts), counts, strict=True):
            own, white = slice(end - count, end), self.white[r][:, None]
            flights.append(values[own].T)
            residuals.append((self.measured[r] - flights[-1]) / white)
            slopes.append((by_unknown[own].transpose(2, 1, 0) / white).reshape(q + 2, -1))
        return residuals, slopes, flights

    def equations(self, unknowns: Floats, shared: Floats, part: NDArray[np.intp]) -> NormalEquations:
        """Normal equations of the flights of these numbers and the film."""
        residuals, slopes, _ = self.flown(unknowns, shared, part)
        return _equations(residuals, slopes, unknowns.shape[1])

    def result(self, unknowns: Floats, film: FilmGuess) -> FittedDetachments:
        """Pulls with their errors, at the end of a fit."""
        shared = np.array([film.stiffness, film.thickness])
        residuals, whole, flights = self.flown(unknowns, shared, np.arange(len(self.counts)))
        system = _equations(residuals, whole, unknowns.shape[1])
        information, score = system.reduced()
        steps = np.maximum(np.abs(unknowns).max(axis=0), 1e-12) * 1e-6
        slopes = np.empty_like(unknowns)
        for k in range(unknowns.shape[1]):
            up, down = unknowns.copy(), unknowns.copy()
            up[:, k] += steps[k]
            down[:, k] -= steps[k]
            slopes[:, k] = (self.pulls(up) - self.pulls(down)) / (2.0 * steps[k])
        chi = system.cost / system.count
        covariance = np.linalg.inv(system.own)
        error = np.sqrt(np.einsum("rq,rqp,rp->r", slopes, covariance, slopes) * np.maximum(chi, 1.0))
        by_film = -np.einsum("rq,rqa->ra", slopes, np.linalg.solve(system.own, system.across))
        begun = (np.array([one.first - one.hold.first for one in self.offs.items]) + 0.5) * self.offs.step
        return FittedDetachments(
            unknowns,
            film,
            self.pulls(unknowns),
            error,
            begun - unknowns[:, 0],
            chi,
            information,
            score,
            by_film,
            tuple(residuals),
            tuple(flights),
            system.cost,
        )
