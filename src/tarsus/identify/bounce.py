"""Bounces: the motion on both sides of an impact of the foot, fitted together.

The foot is on the ground at the impact and its velocity changes there, together with the rest of the structure's by
the mass-weighted impact law; before and after it the structure flies free under the drive's force and the film's.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import null_space

from tarsus.base.errors import InputError
from tarsus.fit.normal_equations import Descent, NormalEquations, descend
from tarsus.identify.flight import SUBSTEPS, FilmConstants, Flow, Launches, Varied, observed, of_model
from tarsus.identify.foot import FootModel
from tarsus.identify.traces import Trace
from tarsus.identify.volts import Volts, jumps_of
from tarsus.impacts.detection import impacts_at_ground
from tarsus.records.excluded import Excluded

Floats = NDArray[np.float64]

LONGEST = 20
"""Samples on each side of an impact that are fitted at most."""

FEWEST = 5
"""Samples there must be on each side."""

_DESCENT = Descent(rounds=15)
"""Fifteen rounds: an impact that needs more is no single one, and `sound` looks whether it has settled."""


@dataclass(frozen=True)
class Bounce:
    """One impact in a record: last sample before it, and how many samples are used before and after it."""

    trace: int
    last: int
    before: int
    after: int


def find_bounces(traces: Sequence[Trace], foot: str, level: float) -> tuple[list[Bounce], list[Excluded]]:
    """Impacts with a rebound in records, and those that cannot be used, with the reason.

    An impact lies between two samples, at most two apart, at which the foot approaches and departs; between
    impacts, and between an impact and a stretch on the ground, there must be samples enough."""
    found: list[Bounce] = []
    left: list[Excluded] = []
    for number, trace in enumerate(traces):
        k = trace.point(foot)
        x, v = trace.x[k] - level, trace.v[k]
        impacts, slow = impacts_at_ground(x, v, trace.noise_x[k], trace.noise_v[k], trace.step)
        # a place on the ground, an impact or a jump of the drive ends the flight on either side
        ends = np.unique(np.concatenate([impacts, np.flatnonzero(slow), jumps_of(trace.volts)]))
        for i in impacts:
            earlier, later = ends[ends < i], ends[ends > i]
            before = int(i - earlier[-1]) if len(earlier) else int(i) + 1
            after = int(later[0] - i) if len(later) else len(v) - 1 - int(i)
            if min(before, after) < FEWEST:
                side = "before" if before < after else "after"
                text = (
                    f"the impact at {trace.time[i]:.5g} s has only {min(before, after)} samples of free "
                    f"flight {side} it"
                )
                left.append(Excluded(trace.file, foot, text))
                continue
            found.append(Bounce(number, int(i), min(before, LONGEST), min(after, LONGEST)))
    return found, left


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


class Bounces:
    """Impacts of several records, ready to be fitted with any model and film."""

    def __init__(self, traces: Sequence[Trace], items: Sequence[Bounce], level: float) -> None:
        if not items:
            raise InputError("no record shows a rebound with samples enough on both sides")
        self.traces, self.items, self.level = tuple(traces), tuple(items), level
        self.step = self.traces[items[0].trace].step
        self.volts = {one.trace: Volts.of(self.traces[one.trace].volts) for one in items}

    def chosen(self, keep: NDArray[np.bool_]) -> Bounces:
        """Some of them."""
        return Bounces(
            self.traces, [one for one, yes in zip(self.items, keep, strict=True) if yes], self.level
        )

    def fit(
        self,
        model: FootModel,
        film: FilmConstants,
        start: Floats | None = None,
        free: bool = False,
    ) -> BounceFit:
        """Fit every impact; ``free``: the velocities of all coordinates jump as they like, rather than by the
        mass-weighted law."""
        ready = _Ready(self, model, film, free)
        found = descend(ready.equations, ready.guess() if start is None else start, how=_DESCENT)
        residuals = ready.slopes(found.own)[1]
        inverse = found.equations.covariance()
        covariance = np.asarray(inverse[:, [-1, -2]][:, :, [-1, -2]], dtype=np.float64)
        chi = found.equations.cost / found.equations.count
        return BounceFit(
            found.own, found.own[:, [-1, -2]], covariance, chi, tuple(residuals), ready.changes, inverse
        )

    def about(
        self,
        model: FootModel,
        film: FilmConstants,
        unknowns: Floats,
        free: bool,
        offsets: Floats | None = None,
    ) -> NormalEquations:
        """Normal equations of impacts at their unknowns (ni, q) and what they share: the logarithms of the film's
        coefficient and thickness, then the displacement offsets [m] of the points in every record with impacts."""
        slopes, residuals = _Ready(self, model, film, free).slopes(unknowns, by_film=True)
        record = np.unique([one.trace for one in self.items], return_inverse=True)[1]
        points = len(model.points)
        left, every = [], []
        for one, number, slope, residual in zip(self.items, record, slopes, residuals, strict=True):
            common = np.zeros((points * (int(record.max()) + 1), *residual.shape))
            for k, noise in enumerate(self.traces[one.trace].noise_x):
                common[points * number + k, k] = -1.0 / noise
            whole = np.concatenate([slope, common])
            left.append(-residual.ravel())
            every.append(whole.reshape(len(whole), -1).T)
        return NormalEquations.of(left, every, unknowns.shape[1])

    def moved(self, model: FootModel, film: FilmConstants, fitted: BounceFit) -> Floats:
        """Departure and approach velocities (ni, 2) for a model near the fitted one, by one Gauss-Newton step."""
        ready = _Ready(self, model, film, fitted.free(model))
        step = ready.equations(fitted.unknowns, np.zeros(0), np.arange(len(self.items))).step()[0]
        return (fitted.unknowns + step)[:, [-1, -2]]


class _Ready:
    """Everything of bounces that depends on the model but not on the unknowns."""

    def __init__(self, bounces: Bounces, model: FootModel, film: FilmConstants, free: bool = False) -> None:
        self.bounces, self.model, self.film = bounces, model, film
        step = bounces.step / SUBSTEPS
        self.onward, self.backward = of_model(model, step), of_model(model, -step)
        self.free = null_space(model.row[None, :])
        self.beside = self.free if free else self.free[:, :0]
        self.grounded = -model.gap * model.row / float(model.row @ model.row)
        points = len(model.points)
        m, k = self.free.shape[1], self.beside.shape[1]
        self.changes = np.zeros((points, 3 + 2 * m + k))
        self.changes[:, 1 + 2 * m : 1 + 2 * m + k] = model.rows @ self.beside
        self.changes[:, -1] = model.rows @ model.jump
        self.changes[:, -2] = -self.changes[:, -1]
        self.output = observed(model)
        rest = model.rest(bounces.level)
        self.measured, self.white = [], []
        before = SUBSTEPS * (max(one.before for one in bounces.items) - 1) + 1
        after = SUBSTEPS * (max(one.after for one in bounces.items) - 1) + 1
        self.past, self.next = np.zeros((len(bounces.items), before)), np.zeros((len(bounces.items), after))
        self.between = np.zeros((len(bounces.items), 2))
        for r, one in enumerate(bounces.items):
            trace = bounces.traces[one.trace]
            start = one.last - one.before + 1
            force = bounces.volts[one.trace].force(model.law, model.history, start, one.before + one.after)
            split = SUBSTEPS * (one.before - 1)
            earlier, later = force[: split + 1][::-1], force[split + SUBSTEPS :]
            self.past[r, : len(earlier)], self.next[r, : len(later)] = earlier, later
            self.between[r] = force[split], force[split + SUBSTEPS]
            part = slice(start, start + one.before + one.after)
            self.measured.append(np.concatenate([trace.x[:, part] + rest[:, None], trace.v[:, part]]))
            self.white.append(np.concatenate([trace.noise_x, trace.noise_v])[:, None])

    def guess(self) -> Floats:
        """First unknowns (ni, q): the foot's lines through the samples around the impact meet there."""
        out, k = [], self.model.points.index(self.model.foot_point)
        points, normal = len(self.model.points), self.model.normal
        basis = self.model.rows @ self.free
        for one, measured in zip(self.bounces.items, self.measured, strict=True):
            last = measured[:, one.before - 1]
            approach = normal * last[points + k]
            departure = normal * measured[points + k, one.before]
            height = self.model.gap + normal * last[k]
            late = float(np.clip(-height / approach, 0.05 * self.bounces.step, 0.95 * self.bounces.step))
            shift = self.model.rows @ self.grounded
            at = np.linalg.lstsq(basis, last[:points] - shift, rcond=None)[0]
            along = self.model.rows @ (self.model.row / float(self.model.row @ self.model.row))
            speed = np.linalg.lstsq(basis, last[points:] - along * approach, rcond=None)[0]
            out.append([late, *at, *speed, *np.zeros(self.beside.shape[1]), approach, departure])
        return np.array(out)

    def _states(self, unknowns: Floats) -> tuple[Varied, Varied]:
        """States (ni, 2n) just before and just after the impacts, with derivatives by the unknowns and the film."""
        count, q = unknowns.shape
        n, m = self.free.shape
        rates = np.zeros((2, 2 * n, q + 2))  # states are linear in the unknowns
        rates[:, :n, 1 : 1 + m] = rates[:, n:, 1 + m : 1 + 2 * m] = self.free
        rates[0, n:, q - 2] = self.model.row / float(self.model.row @ self.model.row)
        rates[1, n:, q - 2] = rates[0, n:, q - 2] - self.model.jump
        rates[1, n:, q - 1] = self.model.jump
        rates[1, n:, 1 + 2 * m : q - 2] = self.beside
        base = np.concatenate([self.grounded, np.zeros(n)])
        before, after = (
            Varied(base + unknowns @ one[:, :q].T, np.broadcast_to(one, (count, *one.shape))) for one in rates
        )
        return before, after

    def equations(self, unknowns: Floats, _: Floats, part: NDArray[np.intp]) -> NormalEquations:
        """Normal equations of the impacts of these numbers."""
        slopes, residuals = self.slopes(unknowns, part)
        own = unknowns.shape[1]
        return NormalEquations.of(
            [-one.ravel() for one in residuals], [one.reshape(own, -1).T for one in slopes], own
        )

    def slopes(
        self, unknowns: Floats, part: NDArray[np.intp] | None = None, *, by_film: bool = False
    ) -> tuple[list[Floats], list[Floats]]:
        """Derivatives (q, channels, samples) of the motion of all impacts, or of those of these numbers, over the
        noise, and residuals over the noise; by_film: behind them those by the logarithms of the film's coefficient
        and thickness."""
        q, step, late = unknowns.shape[1], self.bounces.step, unknowns[:, 0]
        numbers = np.arange(len(self.measured)) if part is None else part
        before, after = self._states(unknowns)
        between, items = self.between[numbers], [self.bounces.items[r] for r in numbers]
        past = self._flown(
            self.backward, before, late, between[:, ::-1], self.past[numbers], [one.before for one in items]
        )
        coming = self._flown(
            self.onward, after, late - step, between, self.next[numbers], [one.after for one in items]
        )
        slopes, residuals = [], []
        for k, r in enumerate(numbers.tolist()):
            values, by_unknown = (
                np.concatenate([one[k][::-1], other[k]]) for one, other in zip(past, coming, strict=True)
            )
            residuals.append((self.measured[r] - values.T) / self.white[r])
            slopes.append(by_unknown.transpose(2, 1, 0)[: q + 2 * by_film] / self.white[r])
        return slopes, residuals

    def _flown(
        self, flow: Flow, states: Varied, begin: Floats, near: Floats, drive: Floats, samples: Sequence[int]
    ) -> tuple[list[Floats], list[Floats]]:
        """Of every impact's flight to one side, so many samples (samples, channels) and derivatives (samples, channels,
        q + 2)."""
        near_step = np.sign(flow.step) * self.bounces.step
        assert states.slopes is not None
        count, columns = len(begin), states.slopes.shape[-1]
        by_begin, by_log = np.zeros((count, columns)), np.zeros((2, columns))
        by_begin[:, 0] = by_log[0, -2] = by_log[1, -1] = 1.0
        launches = Launches(
            states, Varied(begin, by_begin), Varied(np.zeros((count, 2))),
            self.film.column(count, by_log=(by_log[0], by_log[1])), np.full(count, self.model.gap), near, near_step,
        )  # fmt: skip
        values, slopes = flow.fly(launches, drive, np.array(samples), self.output)
        cuts = np.cumsum(samples)[:-1]
        return np.split(values, cuts), np.split(slopes, cuts)


def fewer(bounces: Sequence[Bounce], most: int) -> list[Bounce]:
    """At most ``most`` of the bounces, evenly from all."""
    if len(bounces) <= most:
        return list(bounces)
    picked = np.unique(np.linspace(0, len(bounces) - 1, most).round().astype(int))
    return [replace(bounces[int(i)]) for i in picked]
