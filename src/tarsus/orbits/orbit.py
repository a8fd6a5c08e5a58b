"""A periodic motion: found by Newton's method on the return map, with its multipliers and what they say of it.

    F(s) = P(s) - s = 0,   s <- s - (dP/ds - 1)^-1 F(s)

The multipliers are the eigenvalues of dP/ds at the orbit: all below 1 in magnitude, and it is stable.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from tarsus.base.errors import InputError
from tarsus.base.events import CONTACT_BEGINS, EVENT_WORDS, IMPACTS
from tarsus.base.spec import with_values
from tarsus.base.verb import verb
from tarsus.files.library import SceneLike, as_scene
from tarsus.model.structure.walker import Walker
from tarsus.orbits.differences import NOISE
from tarsus.orbits.newton import CLOSED, zero_near
from tarsus.orbits.returns import FINE, Returned, ReturnMap, drive_period, return_map
from tarsus.orbits.sequence import ACCUMULATED, kept_events, sequence_of
from tarsus.orbits.walking import WalkMap, walk_map
from tarsus.solve import Contacts, ResultCode, Run, simulate
from tarsus.tables.numbers import amount
from tarsus.tables.table import ROW, Column, Table

if TYPE_CHECKING:
    from tarsus.model.scene import Scene

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]

TRANSIENTS = (40, 160, 640)
"""Drive periods that are simulated before an orbit is looked for, one after the other until it is found: what damping
of a tenth a period leaves of a transient is 1e-4 after the first."""
MOST_MULTIPLE = 8
"""Largest multiple of the drive period that is tried: a cascade of doublings beyond period 8 spans less than a percent
of a parameter."""
NEAR = 0.05
"""Mismatch, of the size of the motion, at which a return is taken for the start of Newton's method; the smallest
multiple with one is tried first."""
ROUNDED = (f"multipliers below {NOISE:g} are rounding: such a deviation is gone after a period",)
"""What is said below multipliers."""
ON_CIRCLE = 1e-6
"""Distance from 1 within which a multiplier's magnitude says nothing of stability, to which it is known near a
grazing."""


@dataclass(frozen=True)
class Orbit:
    """A periodic motion.

    scene; map: the return map; multiple: its period in drive periods; state (2n,): displacements and velocities at the
    section; mismatch: of its return, as part of the motion's size; returned: what it returns to.
    """

    scene: Scene
    map: ReturnMap
    multiple: int
    state: Floats
    mismatch: float
    returned: Returned

    @property
    def period(self) -> float:
        """Period of the motion [s]."""
        return self.multiple * self.map.period

    @property
    def start(self) -> float:
        """When the section is [s], at a phase of the drive."""
        return self.map.start

    @cached_property
    def derivative(self) -> Floats:
        """Derivative (2n, r) of the return along the map's free directions."""
        return self.map.derivative(self.state, self.multiple, self.returned)

    @cached_property
    def multipliers(self) -> Complexes:
        """Multipliers (r,), largest magnitude first: the factors by which small deviations grow in a period. What is
        below `NOISE` is rounding: such a deviation is gone after a period."""
        values = np.linalg.eigvals(self.map.free.T @ self.derivative).astype(complex)
        return values[np.lexsort((-np.imag(values), -np.abs(values)))]

    @property
    def determinant(self) -> float:
        """Product of the multipliers: the factor by which volumes of states shrink in a period."""
        return float(np.prod(self.multipliers).real)

    @property
    def travel(self) -> float:
        """How far a walker gets in a period [m]; 0 of anything else."""
        return self.returned.travel

    @property
    def travel_multiplier(self) -> float | None:
        """Multiplier of a walker's place along the way, 1 but for rounding, which is none of `multipliers`; None of
        anything else."""
        return self.map.travel_multiplier(self.state, self.multiple) if isinstance(self.map, WalkMap) else None

    @property
    def stable(self) -> bool:
        """Whether small deviations die out."""
        return not len(self.multipliers) or float(np.abs(self.multipliers[0])) < 1.0 - ON_CIRCLE

    @cached_property
    def events(self) -> NDArray[np.void]:
        """Events of one period, times [s] from the section on; fields as those of a run. The first flight may have its
        apex before the section."""
        found = self.returned.events.copy()
        for name in ("time", "apex_time"):
            found[name] -= self.start
        return found

    @cached_property
    def sequence(self) -> tuple[tuple[int, int], ...]:
        """(foot, kind) of the events that distinguish it from other motions, in order."""
        return sequence_of(self.events)

    @cached_property
    def marks(self) -> Floats:
        """Times of these events as parts of the period, and their approach speeds as parts of the motion's speed, but
        of bounces that accumulate."""
        events = self.events[kept_events(self.events)]
        speeds = np.where(np.isin(events["kind"], ACCUMULATED), 0.0, events["speed_before"])
        return np.concatenate([events["time"] / self.period, speeds / self.map.speed(self.state)])

    @property
    def impacts(self) -> int:
        """Number of impacts in a period."""
        return int(np.isin(self.returned.events["kind"], IMPACTS).sum())

    @property
    def hardest_impact(self) -> float:
        """Largest approach speed of an impact of a period [m/s]; NaN without one."""
        speeds = self.events["speed_before"][np.isin(self.events["kind"], IMPACTS)]
        return float(speeds.max()) if len(speeds) else np.nan

    @property
    def highest_flight(self) -> float:
        """Highest gap of a flight that ends in a period [m]; NaN without one."""
        heights = self.events["apex"][np.isin(self.events["kind"], IMPACTS)]
        return float(heights.max()) if len(heights) else np.nan

    @property
    def kind(self) -> str:
        """Stability, period and events in words, as "stable, period 2, 3 impacts"."""
        if self.stable:
            stability = "stable"
        elif abs(abs(self.multipliers[0]) - 1.0) <= ON_CIRCLE:
            stability = "marginal"
        else:
            stability = "unstable"
        parts = [stability, f"period {self.multiple}", _counted(self.impacts, "impact")]
        held = int(np.isin(self.returned.events["kind"], CONTACT_BEGINS).sum())
        if held:
            parts.append(f"{held} of them held")
        if isinstance(self.map, WalkMap):
            parts.append(f"travels {amount(self.travel, 'm')}")
        return ", ".join(parts)

    def __str__(self) -> str:
        return self.kind

    def __repr__(self) -> str:
        return f"<Orbit of {self.scene.name!r}: {self.kind}>"

    def table(self) -> Table:
        """The motion's period, impacts, flights and multipliers, and its events."""
        numbers: list[tuple[str, object, str]] = [
            ("period", self.period, "s"),
            ("drive periods", self.multiple, "1"),
            ("impacts", self.impacts, "1"),
            ("hardest impact", self.hardest_impact, "m/s"),
            ("highest flight", self.highest_flight, "m"),
            *([("travel", self.travel, "m")] if isinstance(self.map, WalkMap) else []),
            ("largest |multiplier|", max(map(abs, self.multipliers.tolist()), default=None), "1"),
            ("mismatch", self.mismatch, "1"),
        ]
        feet = list(self.scene.robot.feet)
        events = [(float(e["time"]), feet[e["foot"]], EVENT_WORDS[int(e["kind"])]) for e in self.events]
        return Table(
            f"Orbit of {self.scene.name}: {self.kind}",
            ("quantity", Column("value", ROW)),
            [one[:2] for one in numbers],
            ROUNDED if np.abs(self.multipliers).min(initial=1.0) < NOISE else (),
            parts=[Table("Events of a period", (Column("time", "s", 6), "foot", "event"), events)],
            units=[unit for _, _, unit in numbers],
        )

    def _repr_html_(self) -> str:
        return self.table().html()

    def to_dict(self) -> dict[str, object]:
        """Plain data, SI units, as `tarsus branch --json` prints of each point."""
        return {
            "motion": self.kind,
            "stable": self.stable,
            "period_s": self.period,
            "multiple": self.multiple,
            "impacts": self.impacts,
            "travel_m": self.travel,
            "events": [
                {"time": float(e["time"]), "foot": int(e["foot"]), "event": EVENT_WORDS[int(e["kind"])]}
                for e in self.events
            ],
            "state": self.state.tolist(),
            "phase": self.start / self.map.period % 1.0,
            "multipliers": [[one.real, one.imag] for one in self.multipliers.tolist()],
            "mismatch": self.mismatch,
        }


@verb
def periodic(scene: SceneLike, *, multiple: int | None = None, values: Mapping[str, float] | None = None) -> Orbit:
    """The periodic motion that a scene settles to; a walker's modulo its travel, so that it is a gait.

    Parameters
    ----------
    scene
        A scene whose drives are periodic, or a device's name or a scene file's path.
    multiple
        Period of the motion in drive periods; by default the smallest up to `MOST_MULTIPLE` at which it returns.
    values
        Numbers in place of the scene's own, by path [SI].

    Returns
    -------
    Orbit
        Its period [s], events of one period [SI], multipliers, and whether it is stable.

    Raises
    ------
    InputError
        For a multiple below 1, for drives without a common period, and where the motion after `TRANSIENTS` periods
        still does not return: then it is chaotic, quasi-periodic or has a longer period.
    """
    scene = with_values(as_scene(scene), dict(values)) if values else as_scene(scene)
    if multiple is not None and multiple < 1:
        raise InputError(f"multiple: expected a number of drive periods of 1 or more, got {multiple}")
    wanted = (multiple,) if multiple is not None else tuple(range(1, MOST_MULTIPLE + 1))
    for count in TRANSIENTS:
        found = orbit_after(scene, count, wanted, free=multiple is None)
        if found is not None and not found.stable and multiple is None:
            first = _kicked(found, count)
            mismatches = {k: miss_of(found.map, first, k) for k in wanted} if first is not None else {}
            found = None if first is None else _nearest(scene, found.map, first, mismatches, free=True)
        if found is not None and (found.stable or multiple is not None):
            return _smallest(found)
    raise InputError(
        [
            f"{scene.name}: no stable motion of period up to {max(wanted)} of the drive was found after "
            f"{TRANSIENTS[-1]} periods; it is chaotic, quasi-periodic or has a longer period"
        ]
    )


def orbit_after(scene: Scene, count: int, wanted: tuple[int, ...], *, free: bool, near: float = np.inf) -> Orbit | None:
    """The orbit near the motion that a scene has after ``count`` drive periods, a stable one of the smallest multiple
    first; None where none is near.

    wanted: multiples of the drive period; free: whether these are only candidates; near: distance of the motion from
    the orbit, of its size, beyond which it is another one. Raises InputError as `periodic` does and where the run does
    not reach its end.
    """
    period = drive_period(scene)
    run = simulate(scene, (count + max(wanted) + 2) * period, replace(FINE, gap=1e-10))
    if not run.ok:
        raise InputError([f"{scene.name}: {run.code}"])
    returns: ReturnMap
    if isinstance(scene.robot.structure, Walker):
        returns, first = walk_map(scene, run, count)
        mismatches = {k: miss_of(returns, first, k) for k in wanted}
    else:
        start, contacts = _section(run, period, count)
        returns = return_map(scene, start / period, contacts)
        first, mismatches = _mismatches(run, returns, wanted)
    found = _nearest(scene, returns, first, mismatches, free=free)
    if found is None or float(np.abs((found.state - first) / returns.scales(first)).max(initial=0.0)) > near:
        return None
    return found


def _nearest(
    scene: Scene, returns: ReturnMap, first: Floats, mismatches: Mapping[int, float], *, free: bool
) -> Orbit | None:
    """A stable orbit near a state, of the smallest multiple whose return comes near; else an unstable one.

    free: whether the multiples are only candidates.
    """
    unstable = None
    for k in sorted(mismatches, key=lambda one: (mismatches[one] > NEAR, one)):
        if mismatches[k] > 10.0 * NEAR and free:
            continue
        found = converge(scene, returns, first, k)
        if found is not None and (found.stable or not free):
            return found
        unstable = unstable or found
    return unstable


def stable_near(scene: Scene, returns: ReturnMap, state: Floats) -> Orbit | None:
    """The stable orbit of the smallest period near a state that has settled; None where none is near."""
    mismatches = {k: miss_of(returns, state, k) for k in range(1, MOST_MULTIPLE + 1)}
    found = _nearest(scene, returns, state, mismatches, free=True)
    return _smallest(found) if found is not None and found.stable else None


KICK = 1e-3
"""Deviation, of the size of the motion, with which an unstable orbit is left for what the motion settles to."""


def _kicked(orbit: Orbit, count: int) -> Floats | None:
    """State at the section ``count`` drive periods and more after a deviation along the fastest multiplier."""
    flow = orbit.map.free.T @ orbit.derivative
    values, vectors = np.linalg.eig(flow)
    away = orbit.map.free @ np.real(vectors[:, int(np.argmax(np.abs(values)))])
    scale = orbit.map.scales(orbit.state)
    state = orbit.state + KICK * away / max(float(np.abs(away / scale).max()), 1e-300)
    for _ in range(count // MOST_MULTIPLE + 1):
        back = orbit.map(state, MOST_MULTIPLE)
        if back.code is not ResultCode.DONE or list(back.contacts.held) != list(orbit.map.contacts.held):
            return None
        state = back.state
    return state


def miss_of(returns: ReturnMap, state: Floats, multiple: int) -> float:
    """Mismatch of a return after so many drive periods, as part of the motion's size."""
    return float(np.abs((returns(state, multiple).state - state) / returns.scales(state)).max())


def converge(scene: Scene, returns: ReturnMap, start: Floats, multiple: int) -> Orbit | None:
    """The orbit of this period near a state by Newton's method; None where it does not converge."""
    scale = returns.scales(start)
    directions = returns.free * returns.sizes(start)

    def mismatch(place: Floats) -> tuple[Returned, Floats] | None:
        state = start + directions @ place
        back = returns(state, multiple)
        return (back, (back.state - state) / scale) if returns.goes_on(back) else None

    def derivatives(place: Floats, back: Returned) -> Floats:
        flow = returns.derivative(start + directions @ place, multiple, back, fine=False) * returns.sizes(start)
        return (flow - directions) / scale[:, None]

    found = zero_near(mismatch, derivatives, np.zeros(directions.shape[1]))
    if found is None:
        return None
    return Orbit(scene, returns, multiple, start + directions @ found.place, found.size, found.what)


def _smallest(found: Orbit) -> Orbit:
    """The same motion by its smallest period."""
    for k in range(1, found.multiple):
        if found.multiple % k == 0 and miss_of(found.map, found.state, k) <= 1e3 * CLOSED:
            return converge(found.scene, found.map, found.state, k) or found
    return found


def _section(run: Run, period: float, count: int) -> tuple[float, Contacts]:
    """A time [s] after ``count`` periods in the middle of the longest time in which no foot is on the ground, and the
    feet held then; the drives' own phase 0 where some foot is always held."""
    begin, end = count * period, (count + 1) * period
    events = run.events[run.events["time"] < end]
    contacts = Contacts().after(events[events["time"] < begin], 0.0, begin)
    middle = contacts.middle_of_flight(events[events["time"] >= begin], begin, end)
    return (begin, contacts) if middle is None else (middle, Contacts())


def _mismatches(run: Run, returns: ReturnMap, wanted: tuple[int, ...]) -> tuple[Floats, dict[int, float]]:
    """State at the section, and by multiple by how much the run's own return misses it."""
    found = run.states(returns.start + returns.period * np.array([0, *wanted]))
    states = np.concatenate([found.x, found.v]).T
    scale = returns.scales(states[0])
    miss = np.abs((states[1:] - states[0]) / scale).max(axis=1)
    return states[0], dict(zip(wanted, miss.tolist(), strict=True))


def _counted(count: int, word: str) -> str:
    return f"{count} {word}" if count == 1 else f"{count} {word}s"
