"""A closed hysteresis operator with minor loops and an inverse: generalised Prandtl-Ishlinskii."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydantic import model_validator

from tarsus.base.arrays import Floats
from tarsus.base.columns import columns, dot
from tarsus.base.errors import InputError
from tarsus.base.linear import product
from tarsus.base.messages import PathErrors
from tarsus.base.spec import Amount, Amounts, quantity
from tarsus.model.drive.crossings import bracketed_root
from tarsus.model.drive.law import VoltageLaw
from tarsus.model.drive.parts import Parts
from tarsus.model.drive.plays import play_states, remembered, states_along, visited
from tarsus.model.drive.track import Track

_NEAR = 1e-13
"""Part of a stretch (of 2) from its end, or from another play's, within which a play engages there: a root is found to
a few 1e-16, times the slope at which the voltage leaves its turn."""
_ROUNDING = 1e-15
"""Of voltages, what their sums round by, several times: a play that is reached by no more is not."""


class PrandtlIshlinskii(VoltageLaw):
    """Force = constant + linear V + quadratic V^2 + cubic V^3 + sum_i weights[i] play_i(V).

    play_i is the play operator of threshold `thresholds[i]` (see `tarsus.model.drive.plays`), 0 at birth. Loops
    between two voltages close, minor loops included, and an excursion wipes out the memory of smaller ones
    before it; this is what erratum E5 misses in (2.9). With a quadratic and a cubic term minor loops are
    congruent up to these terms.
    """

    kind: Literal["prandtl_ishlinskii"] = "prandtl_ishlinskii"
    constant: Amount = quantity("N", "force at 0 V with all plays at 0", default=0.0)
    linear: Amount = quantity("N/V", "gain on V")
    quadratic: Amount = quantity("N/V^2", "gain on V^2", default=0.0)
    cubic: Amount = quantity("N/V^3", "gain on V^3", default=0.0)
    thresholds: Amounts = quantity("V", "threshold of each play, half its width", default=(), ge=0)
    weights: Amounts = quantity("N/V", "weight of each play", default=())

    @model_validator(mode="after")
    def _check_lengths(self) -> PrandtlIshlinskii:
        if len(self.weights) != len(self.thresholds):
            text = f"expected {len(self.thresholds)} weights, one a threshold, got {len(self.weights)}"
            raise PathErrors([("weights", text)])
        return self

    @property
    def has_memory(self) -> bool:
        """False without plays."""
        return any(bool(np.any(one != 0.0)) for one in self.weights)

    def coefficients(self) -> Floats:
        """(4,), the memory-free polynomial, ascending; (nr, 4) where a number is one a run."""
        return columns((self.constant, self.linear, self.quadratic, self.cubic))

    def plays(self) -> tuple[Floats, Floats]:
        """Thresholds (n,) [V] and weights (n,) [N/V]."""
        return np.array(self.thresholds, dtype=np.float64), np.array(self.weights, dtype=np.float64)

    def states(self, volts: ArrayLike, history: Sequence[float] = ()) -> Floats:
        """States (N, n) [V] of the plays along a sequence of voltages (n,) [V], monotone between them."""
        past = visited(history)
        r, _ = self.plays()
        levels = np.concatenate([past, np.atleast_1d(np.asarray(volts, dtype=np.float64))])
        return play_states(levels, r, np.zeros(len(r)))[len(past) :]

    def force(self, volts: ArrayLike, history: Sequence[float] = ()) -> Floats:
        """Force (N,) [N] along a sequence of voltages (n,) [V], monotone from each to the next."""
        v = np.atleast_1d(np.asarray(volts, dtype=np.float64))
        return self.force_with(v, self.states(v, history))

    def force_with(self, volts: Floats, states: Floats) -> Floats:
        """Force (N,) [N] at voltages (N,) with the plays in some states (N, n) [V]."""
        return self.free(volts) + product(states, self.plays()[1])

    def free(self, volts: Any) -> Any:
        """What of the force [N] has no memory, at voltages [V] of any shape."""
        return ((self.cubic * volts + self.quadratic) * volts + self.linear) * volts + self.constant

    def held(self, volts: Floats, past: Floats) -> Floats:
        """Forces (R,) [N] at voltages (R,) [V] that are held; see `VoltageLaw.held`."""
        r, w, _ = self._acting()
        states = remembered((*past.T, volts), r)
        return self.free(volts) + dot(states, np.broadcast_to(w, states.shape))

    def parts(self, track: Track, history: Sequence[float]) -> Parts:
        """The track cut where plays engage: on each part the engaged follow the voltage, the others rest."""
        w, total = self._acting()[1:]
        stretch, low, high, engaged, still = self.engaged(track, history)
        new = low == -1.0
        cubic, w = (track.of_run(one)[stretch] for one in (self.coefficients(), w))
        constant = cubic[:, 0] + dot(still, w)
        linear = cubic[:, 1] + dot(engaged, w)
        law = np.stack([constant, linear, cubic[:, 2], cubic[:, 3]], axis=-1)
        run, slack = track.run[stretch], 1e-13 * np.broadcast_to(total, len(track.loops))
        kink = np.where(new, track.kink[stretch], True)
        kink[1:] |= (np.abs(np.diff(linear)) > slack[run[1:]]) & (run[1:] == run[:-1])
        again = np.flatnonzero(track.loops >= 0)
        loop = np.searchsorted(stretch, track.runs[again] + track.loops[again])
        last = np.searchsorted(run, again, side="right") - 1
        kink[loop] |= np.abs(linear[loop] - linear[last]) > slack[again]
        return Parts(stretch, low, high, law, kink)

    def engaged(self, track: Track, history: Sequence[float]) -> tuple[NDArray[np.intp], Floats, Floats, Floats, Any]:
        """Parts (Q,) of a track's stretches on which no play engages, from where to where in them; which plays
        (Q, n) are
        engaged, and the constant (Q, n) [V] by which each differs from the voltage then, or that it is if it rests."""
        r = self._acting()[0]
        rest = states_along(track, r, remembered(history, r))[0::2]
        r = track.of_run(r)
        s = track.direction()[:, None]
        engage = rest + s * r
        stretch, low, high = self._cuts(track, rest, r, engage)
        middle = track.values(stretch, 0.5 * (low + high))[:, None]
        s = s[stretch]
        engaged = (s * (middle - engage[stretch]) >= 0.0) & (s != 0.0)
        weighed = np.where(np.isfinite(r)[stretch], -s * r[stretch], 0.0)
        return stretch, low, high, engaged, np.where(engaged, weighed, rest[stretch])

    def _acting(self) -> tuple[Any, Any, Any]:
        """Thresholds and weights (n,) or (nr, n) of the plays, and the sum of all gains; those without effect never
        engage."""
        r, w = columns(self.thresholds or (np.inf,)), columns(self.weights or (0.0,))
        if np.ndim(r) != np.ndim(w):
            runs = max(len(one) for one in (r, w) if np.ndim(one) > 1)
            r, w = (np.broadcast_to(one, (runs, one.shape[-1])) for one in (r, w))
        total = np.abs(self.linear) + np.abs(w).sum(axis=-1)
        acting = np.abs(w) > 1e-15 * np.asarray(total)[..., None]
        return np.where(acting, r, np.inf), np.where(acting, w, 0.0), total

    @staticmethod
    def _cuts(track: Track, rest: Floats, r: Floats, engage: Floats) -> tuple[NDArray[np.intp], Floats, Floats]:
        """Parts of stretches between the places where plays at rest (S, n) engage: stretch, and from where to where."""
        s = track.direction()[:, None]
        # a voltage that turns where it turned before only touches the play: what is beyond is rounding
        slack = _ROUNDING * (np.abs(rest) + r + np.maximum(np.abs(track.first), np.abs(track.last))[:, None])
        inside = (s * (engage - track.first[:, None]) > slack) & (s * (track.last[:, None] - engage) > slack)
        owner, play = np.nonzero(inside)
        xi = track.solve(owner, engage[owner, play])
        within = np.abs(xi) < 1.0 - _NEAR
        stretch = np.concatenate([np.arange(track.count), owner[within]])
        low = np.concatenate([np.full(track.count, -1.0), xi[within]])
        order = np.lexsort((low, stretch))
        stretch, low = stretch[order], low[order]
        keep = np.ones(len(low), dtype=bool)
        keep[1:] = (stretch[1:] != stretch[:-1]) | (low[1:] - low[:-1] > _NEAR)
        stretch, low = stretch[keep], low[keep]
        new = low == -1.0
        high = np.ones(len(low))
        high[:-1][~new[1:]] = low[1:][~new[1:]]
        return stretch, low, high

    def monotone_range(self) -> tuple[float, float]:
        """Widest range [V] around 0 in which the force is strictly monotone in the voltage after any history.

        Just after the voltage turned no play with a threshold is engaged; later those below some threshold
        are. The worst of these slopes must keep its sign. Raises InputError if it has none at 0 V.
        """
        r, w = self.plays()
        order = np.argsort(r, kind="stable")
        r, w = r[order], w[order]
        ends = np.flatnonzero(np.append(np.diff(r) > 0.0, True)) if len(r) else np.array([], dtype=np.intp)
        engaged = np.cumsum(w)[ends]
        if not (len(r) and r[0] == 0.0):
            engaged = np.append(0.0, engaged)
        slopes = self.linear + engaged
        sign = math.copysign(1.0, float(slopes[0]))
        worst = float((sign * slopes).min())
        if not worst > 0.0:
            raise InputError("the hysteresis law has no inverse: its slope at 0 V is not of one sign")
        slope = [worst, 2.0 * sign * self.quadratic, 3.0 * sign * self.cubic]
        roots = np.polynomial.polynomial.polyroots(slope)
        real = np.real(roots[np.abs(np.imag(roots)) <= 1e-12 * np.abs(roots)])
        low, high = real[real < 0.0], real[real > 0.0]
        return float(low.max(initial=-math.inf)), float(high.min(initial=math.inf))

    def inverse(
        self, forces: ArrayLike, history: Sequence[float] = (), limits: tuple[float, float] | None = None
    ) -> Floats:
        """Voltages (N,) [V] that give the wanted forces (N,) [N] one after the other, after `history` [V].

        Each step is the one monotone move of the voltage that ends at the wanted force, solved to rounding.
        `limits` [V] narrow the `monotone_range`. Raises InputError if the law has no inverse or a force is
        out of reach.
        """
        low, high = self.monotone_range()
        if limits is not None:
            low, high = max(low, limits[0]), min(high, limits[1])
        r = self.plays()[0]
        past = visited(history)
        state = play_states(past, r, np.zeros(len(r)))[-1]
        wanted = np.atleast_1d(np.asarray(forces, dtype=np.float64))
        volts = np.empty(len(wanted))
        for i, force in enumerate(wanted):
            v = self._reach(float(force), state, low, high)
            if v is None:
                ends = f"{low:g} V and {high:g} V"
                raise InputError(f"force {i + 1}, {float(force)!r} N, is out of reach between {ends}")
            volts[i] = v
            state = np.minimum(np.maximum(state, v - r), v + r)
        return volts

    def _reach(self, force: float, state: Floats, low: float, high: float) -> float | None:
        """Voltage in [low, high] at which the force is `force` after a monotone move from `state` (n,)."""
        r, w = self.plays()

        def miss(v: float) -> float:
            return self.free(v) + float(product(np.minimum(np.maximum(state, v - r), v + r), w)) - force

        corners = np.concatenate([state - r, state + r])
        corners = np.sort(corners[(corners > low) & (corners < high)]).tolist()
        corners = [low, *corners, high]
        if math.isinf(low):
            corners[0] = expand(miss, corners[1] if len(corners) > 2 else min(high, 0.0), -1.0)
        if math.isinf(high):
            corners[-1] = expand(miss, corners[-2] if len(corners) > 2 else max(low, 0.0), 1.0)
        values = [miss(v) for v in corners]
        if values[0] == 0.0:
            return corners[0]
        for a, b, fa, fb in zip(corners, corners[1:], values, values[1:], strict=False):
            if fb == 0.0:
                return b
            if (fa < 0.0) != (fb < 0.0):
                return bracketed_root(miss, a, b, fa, fb)
        return None


def expand(miss: Callable[[float], float], start: float, sign: float) -> float:
    """A point beyond `start` in the direction `sign` where `miss` has changed its sign, or a far one."""
    at = miss(start)
    if at == 0.0 or not math.isfinite(at):
        return start
    step = 1.0
    while step < 1e12 and (miss(start + sign * step) < 0.0) == (at < 0.0):
        step *= 2.0
    return start + sign * step


def fit_branches(
    rising: Callable[[Floats], ArrayLike],
    falling: Callable[[Floats], ArrayLike],
    span_volts: tuple[float, float] = (-8.0, 8.0),
    n_plays: int = 6,
) -> PrandtlIshlinskii:
    """The operator whose closed loop over `span_volts` [V] is nearest, in least squares, to two branches.

    Parameters
    ----------
    rising, falling
        Force [N] of voltages (n,) [V] on each branch, such as the two `Cubic` of (2.9).
    span_volts
        Lower and upper end of the loop [V].
    n_plays
        Number of plays; their thresholds are spread evenly over half the span. All weights get the sign of
        the mean slope of the branches, so that the loop turns as the branches do and the operator has an
        inverse.

    Raises
    ------
    InputError
        For an empty span, no plays, or branches that are not finite.
    """
    from scipy.optimize import lsq_linear

    low, high = span_volts
    if not (math.isfinite(low) and math.isfinite(high) and low < high):
        raise InputError(f"expected a span of two increasing voltages, got {low!r} V and {high!r} V")
    if n_plays < 1:
        raise InputError(f"expected at least one play, got {n_plays}")
    half, centre = 0.5 * (high - low), 0.5 * (high + low)
    r = np.asarray(half * np.arange(1, n_plays + 1) / (n_plays + 1.0), dtype=np.float64)
    v = centre + half * np.linspace(-1.0, 1.0, 401)
    up, down = np.asarray(rising(v), dtype=np.float64), np.asarray(falling(v), dtype=np.float64)
    target = np.concatenate([up, down])
    if not np.isfinite(target).all():
        raise InputError("the branches to fit are not finite over the span")
    size = float(np.ptp(target)) or 1.0
    loop = np.concatenate([v, v[::-1]])
    states = play_states(np.concatenate([[high, low], loop]), r, np.zeros(n_plays))[2:]
    states = np.concatenate([states[: len(v)], states[len(v) :][::-1]])
    x = np.concatenate([v, v])
    scale = max(abs(low), abs(high))
    columns = np.column_stack([(x / scale) ** k for k in range(4)] + [states / scale])
    sign = 1.0 if up[-1] + down[-1] >= up[0] + down[0] else -1.0
    bounds = np.full((2, columns.shape[1]), np.inf)
    bounds[0] = -np.inf
    bounds[0 if sign > 0 else 1, 4:] = 0.0
    found = lsq_linear(columns, target / size, bounds=(bounds[0], bounds[1]), method="bvls", tol=1e-14).x
    gains = size * found / scale ** np.array([0, 1, 2, 3] + [1] * n_plays)
    c0, c1, c2, c3 = (float(g) for g in gains[:4])
    return PrandtlIshlinskii(
        constant=c0, linear=c1, quadratic=c2, cubic=c3, thresholds=tuple(r.tolist()), weights=tuple(gains[4:].tolist())
    )
