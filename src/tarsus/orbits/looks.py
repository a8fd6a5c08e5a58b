"""Looks at the flights and contacts of a periodic motion: how close to the ground a foot is in each part of a flight,
how close to leaving it in each part of a contact, and how fast that changes along a branch."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from tarsus.base.events import CONTACT_BEGINS, IMPACTS, EventKind
from tarsus.solve.acting import Acting, slope, value
from tarsus.solve.codes import EVENT_TYPE, event_places

if TYPE_CHECKING:
    from tarsus.orbits.orbit import Orbit
    from tarsus.solve.tangents import Entering
    from tarsus.solve.window import Window

Floats = NDArray[np.float64]
Pair = tuple[Floats, Floats]

SEEN = 16
"""Parts of a period of the structure's fastest mode in each of which a gap or a pull is looked at where it is least: a
parabola through three places of one is off by a thousandth of that mode's share in it."""
LEAST, MOST = 16, 1024
"""Looks at a flight or contact, and at a drive period: beyond, a mode is so fast that contact hardly moves it."""
AROUND = 1e-3
"""Distance [rad] in the fastest mode of the places that say how fast a pull changes: they are off by its square."""

ACCUMULATED = (EventKind.REST, EventKind.AVERAGED_CONTACT)
"""Kinds of contact in which infinitely many bounces end."""


def kept_events(events: NDArray[np.void]) -> list[int]:
    """Numbers of the events of a period that distinguish one motion from another, in order.

    Bounces that accumulate to a rest are none of their own: how many of infinitely many are resolved says nothing.
    """
    out: list[int] = []
    foot, kind = events["foot"].tolist(), events["kind"].tolist()
    for i in range(len(events)):
        if kind[i] in ACCUMULATED:
            while own := [k for k in out if foot[k] == foot[i]]:
                if kind[own[-1]] != EventKind.BOUNCE:
                    break
                out.remove(own[-1])
        out.append(i)
    return out


@dataclass(frozen=True)
class Stretch:
    """A flight or contact of a foot between two events by their numbers, or -1 where it has none: from and to when from
    the section on [s], and the powers of its zeros at both ends."""

    foot: int
    held: bool
    first: int
    last: int
    begin: float
    end: float
    powers: tuple[int, int]


def stretches_of(orbit: Orbit) -> list[Stretch]:
    """All flights and contacts of a period that begin with an event that is kept."""
    events, kept, out = orbit.events, set(kept_events(orbit.events)), []
    kinds = [*IMPACTS, *CONTACT_BEGINS, EventKind.RELEASE]
    for foot in range(orbit.map.plan.feet):
        own = np.flatnonzero((events["foot"] == foot) & np.isin(events["kind"], kinds)).tolist()
        if not own and foot not in orbit.map.contacts.held:
            out.append(Stretch(foot, False, -1, -1, 0.0, orbit.period, (0, 0)))
        for i, j in zip(own, [*own[1:], *own[:1]], strict=True):
            if i not in kept:
                continue
            begin, end = float(events["time"][i]), float(events["time"][j]) + (j <= i) * orbit.period
            held = bool(np.isin(events["kind"][i], CONTACT_BEGINS))
            # behind a bounce the gap rises with the time, behind a release with its square, or cube where the pull does
            departs = 1 if events["kind"][i] == EventKind.BOUNCE else 2 if events["strength"][i] > 0.0 else 3
            out.append(Stretch(foot, held, i, j, begin, end, (0, 1) if held else (departs, 1)))
    return out


def _fastest(orbit: Orbit) -> float:
    """Angular frequency [rad/s] of the structure's fastest mode."""
    system = orbit.map.plan.system
    values = np.linalg.eigvals(np.linalg.solve(system.mass, system.stiffness))
    return max(float(np.sqrt(np.abs(values).max(initial=0.0))), 2.0 * np.pi / orbit.map.period)


def _count(orbit: Orbit, one: Stretch) -> int:
    """Looks at a stretch."""
    period = orbit.map.period
    a_period = min(SEEN * _fastest(orbit) * period / (2.0 * np.pi), MOST)
    return max(LEAST, round(a_period * (one.end - one.begin) / period))


@dataclass(frozen=True)
class _Places:
    """Places (k,) in stretches by the number of that and the part tau of its time."""

    orbit: Orbit
    stretches: Sequence[Stretch]
    which: NDArray[np.intp]
    tau: Floats

    def of(self, name: str) -> NDArray[np.float64]:
        """A number of the stretch of each place (k,)."""
        return np.array([getattr(one, name) for one in self.stretches], dtype=float)[self.which]

    @property
    def foot(self) -> NDArray[np.intp]:
        """Foot of each place (k,)."""
        return self.of("foot").astype(int)

    @property
    def held(self) -> NDArray[np.bool_]:
        """Whether each place (k,) is in a contact."""
        return self.of("held") > 0.0

    @property
    def since(self) -> Floats:
        """How long each place (k,) is behind the begin of its stretch [s]."""
        return self.tau * (self.of("end") - self.of("begin"))

    @property
    def turns(self) -> Floats:
        """By how many periods each place (k,) is behind the section's next return."""
        return np.floor((self.of("begin") + self.since) / self.orbit.period)

    @property
    def times(self) -> Floats:
        """When each place (k,) is, from the section on [s]."""
        return np.clip(self.of("begin") + self.since - self.turns * self.orbit.period, 0.0, self.orbit.period)

    def shares(self, gap: Floats, pull: Floats, strong: Floats) -> Floats:
        """Margins (k,) of gaps and pulls, or their slopes."""
        powers = np.array([one.powers for one in self.stretches]).reshape(-1, 2)[self.which].T
        over = self.tau ** powers[0] * (1.0 - self.tau) ** powers[1]
        return np.where(self.held, strong - pull, gap) / over


def _seen(orbit: Orbit, times: Floats) -> tuple[Window, Floats, NDArray[np.intp]]:
    """The motion at times (k,) [s] from the section on in any order, and at its end; when the window looks at it [s],
    and the number of the look at each time."""
    order = np.argsort(times, kind="stable")
    when = np.append(times[order], orbit.period) + orbit.start
    return orbit.map.window(orbit.state, when), when, np.argsort(order, kind="stable")


def _pulls(window: Window) -> Floats:
    """Pulls (m, nt) [N] on held feet, by smooth forces as well."""
    return window.states.pull + sum(window.forces[name] for name in window.acting.on("force"))


def _strength(orbit: Orbit, age: Floats) -> Pair:
    """Strength [N] of contacts of some age, and its slope by that."""
    for law in Acting(orbit.map.plan, orbit.map.rows).on("strength").values():
        return value(law, age), slope(law, age)
    return np.zeros_like(age), np.zeros_like(age)


def _lowest(orbit: Orbit, stretches: Sequence[Stretch], counts: Sequence[int]) -> Floats:
    """Where (k,) in each of so many parts of each stretch its margin is least, by a parabola through three places."""
    ends = [np.clip(np.arange(2 * n + 1) / (2.0 * n), 0.1 / n, 1.0 - 0.1 / n) for n in counts]
    tau = np.concatenate([*ends, np.zeros(0)])
    places = _Places(orbit, stretches, np.repeat(np.arange(len(counts)), [2 * n + 1 for n in counts]), tau)
    window, _, at = _seen(orbit, places.times)
    foot = places.foot
    margins = places.shares(
        window.states.gap[foot, at], _pulls(window)[foot, at], _strength(orbit, places.since)[0]
    )
    first = np.concatenate([[0], np.cumsum([2 * n + 1 for n in counts])]).astype(int)
    begins = np.concatenate(
        [b + 2 * np.arange(n) for b, n in zip(first, counts, strict=False)] or [first[:0]]
    )
    f0, f1, f2 = (margins[begins + k] for k in range(3))
    bend, tilt = 0.5 * (f0 + f2) - f1, 0.5 * (f2 - f0)
    with np.errstate(all="ignore"):
        part = np.where(bend > 0.0, np.clip(-0.5 * tilt / bend, -1.0, 1.0), -np.sign(tilt))
    return tau[begins + 1] + 0.5 * part * (tau[begins + 2] - tau[begins])


@dataclass(frozen=True)
class Looks:
    """What is seen of an orbit: margins of its flights and contacts and their slopes along a branch, each where it is
    least in its part of a stretch, and slopes (ne,) of the events' fields; longer: slope of the period [s]; counts:
    looks at each stretch."""

    values: Floats
    slopes: Floats
    events: Mapping[str, Floats]
    longer: float
    counts: tuple[int, ...]

    def margins(self) -> Pair:
        """Values and slopes of the margins."""
        return self.values, self.slopes

    @classmethod
    def of(cls, orbit: Orbit, given: Entering, speed: float, later: float, counts: tuple[int, ...]) -> Looks:
        """By one run of the orbit, with derivatives. given: what enters it, with derivatives by a number and along the
        way of its states; speed: slope of that number; later: by how much the section is later with it [s]; counts: how
        often to look at each stretch, if it has as many."""
        returns, start = orbit.map, later * speed
        longer, stretches = start / orbit.start * orbit.period, stretches_of(orbit)
        counts = counts if len(counts) == len(stretches) else tuple(_count(orbit, one) for one in stretches)
        which = np.repeat(np.arange(len(stretches)), counts)
        places = _Places(orbit, stretches, which, _lowest(orbit, stretches, counts))
        foot, held, tau, time = places.foot, places.held, places.tau, places.times
        length = places.of("end") - places.of("begin")
        beside = np.minimum(AROUND / _fastest(orbit), 0.25 * np.minimum(tau, 1.0 - tau) * length)[held]
        around = np.concatenate([time, time[held] - beside, time[held] + beside])
        window, when, back = _seen(orbit, np.clip(around, 0.0, orbit.period))
        found, by = returns.tangents(orbit.state, given, when), np.array([speed, 1.0])
        events = _of_events(window.rows, found.of_run(len(window.rows), len(found.marks)).events @ by, start)
        n, m = len(returns.plan.system.mass), returns.plan.feet
        slopes = found.samples[:, 2 * n : 2 * n + 5 * m] @ by
        at, (before, after) = back[: len(tau)], np.split(back[len(tau) :], 2)
        pulls, rates = _pulls(window), np.zeros(len(tau))
        apart = np.maximum(when[after] - when[before], np.finfo(float).tiny)
        rates[held] = (pulls[foot[held], after] - pulls[foot[held], before]) / apart
        begins, lengths = (
            np.array([_moves(one, events["time"], longer) for one in stretches]).reshape(-1, 2)[which].T
        )
        moved = begins + tau * lengths - places.turns * longer + start
        strong, by_age = _strength(orbit, places.since)
        gap, rate = window.states.gap[foot, at], window.states.rate[foot, at]
        return cls(
            places.shares(gap, pulls[foot, at], strong),
            places.shares(
                slopes[at, foot] + rate * moved, slopes[at, 4 * m + foot] + rates * moved, by_age * tau * lengths
            ),
            events, longer, counts,
        )  # fmt: skip


def _of_events(rows: Floats, slopes: Floats, start: float) -> dict[str, Floats]:
    """Slopes (ne,) of the events' fields by those of their rows (ne, 12), times being counted from the section on,
    which moves with ``start`` [s]."""
    places, names = event_places(rows), list(EVENT_TYPE.names or ())
    events = {name: slopes[place, names.index(name)] for name, place in places.items()}
    return events | {"time": events["time"] - start}


def _moves(one: Stretch, times: Floats, longer: float) -> tuple[float, float]:
    """Slopes of when a stretch begins and of its length, by those (ne,) of the events' times and of the period."""
    if one.first < 0:
        return 0.0, longer
    begin = float(times[one.first])
    return begin, float(times[one.last]) + (one.last <= one.first) * longer - begin
