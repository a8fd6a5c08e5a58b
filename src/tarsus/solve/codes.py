"""How a run ended, as a sentence; and its events as a structured array."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import Enum

import numpy as np

from tarsus.base.events import EventKind
from tarsus.core import arrays as a


class ResultCode(Enum):
    """How a run ended. The value is a sentence."""

    DONE = "The run reached its end."
    STALLED = "The run stopped: events crowd one instant (contacts repeat without time passing)."
    TOO_STIFF = "The run stopped: a ground law changes too fast for the shortest step; its length scale is too small."
    STEP_LIMIT = "The run stopped: it needed more steps than allowed (Accuracy.steps)."
    NOT_FINITE = "The run stopped: a number became infinite or undefined; a law or the structure is unbounded."
    JAMMED = (
        "The run stopped: friction presses a sliding foot to the ground harder than the ground bears it, so that rigid "
        "feet have no motion, or two; a lower coefficient of friction or a more yielding structure has one."
    )
    DIVERGED = (
        "The run stopped: the motion grew without bound; its impact law creates energy "
        "(ground.impact.passive is false)."
    )
    LEDGER_OPEN = (
        "The run reached its end, but its energy account is open by more than 1e-8 of its largest term: "
        "its numbers are not to be trusted; a finer Accuracy may close it."
    )

    def __str__(self) -> str:
        return self.value

    @classmethod
    def of(cls, code: int, *, makes_energy: bool = False) -> ResultCode:
        """The result of a kernel return code; ``makes_energy``: the run's impact law is not passive."""
        result = _CODES[code]
        return cls.DIVERGED if makes_energy and result in (cls.STALLED, cls.NOT_FINITE) else result

    @property
    def number(self) -> int:
        """The kernel's return code for it: that of its end where its account is open, one of those of motion that grew
        without bound."""
        own = {ResultCode.LEDGER_OPEN: ResultCode.DONE, ResultCode.DIVERGED: ResultCode.NOT_FINITE}.get(self, self)
        return next(code for code, result in _CODES.items() if result is own)


CLOSED = 1e-8
"""Largest closure of an energy account that counts as closed: at the accuracy of a single run rounding leaves 1e-12 and
truncation, through the stiffest films, some 1e-9; what is above is energy made or lost."""

_CODES = {
    a.DONE: ResultCode.DONE,
    a.STALL: ResultCode.STALLED,
    a.STEP_TOO_SMALL: ResultCode.TOO_STIFF,
    a.STEP_LIMIT: ResultCode.STEP_LIMIT,
    a.NOT_FINITE: ResultCode.NOT_FINITE,
    a.JAMMED: ResultCode.JAMMED,
}
SENTENCES = tuple(_CODES[code].value for code in sorted(_CODES))
"""What each of the engine's codes says, in their order."""

_FIELDS = {
    "time": "f8",
    "foot": "i4",
    "kind": "i1",
    "speed_before": "f8",
    "speed_after": "f8",
    "pull": "f8",
    "strength": "f8",
    "energy": "f8",
    "adhesion_energy": "f8",
    "apex": "f8",
    "apex_time": "f8",
    "gap_integral": "f8",
}
# every field where its number lies in a row of the engine, so that rows need no copying field by field
EVENT_TYPE = np.dtype(
    {
        "names": list(_FIELDS),
        "formats": list(_FIELDS.values()),
        "offsets": [8 * column for column in range(a.EVENT_WIDTH)],
        "itemsize": 8 * a.EVENT_WIDTH,
    }
)
"""Fields of an event: time [s]; foot number; kind (1 bounce, 2 capture, 3 release, 4 rest, 5 contact at start);
approach and departure speed [m/s]; the structure's pull and the contact's strength [N]; kinetic energy lost [J] and
the part of it that adhesion took by holding a foot that would have bounced [J]; the highest gap [m] of the flight
that ended, and when [s]; the integral of the foot's gap over time from the start of the run [m s]. In a run with period
marks (kind 6) the highest gap is that since the foot's last event or mark: `without_marks` puts flights together."""


@dataclass(frozen=True)
class EventColumns:
    """Kernel event rows (ne, 12) of several batches, one after the other, field by field as measures ask for them."""

    rows: Sequence[np.ndarray]

    def __getitem__(self, name: str) -> np.ndarray:
        """A field of `EVENT_TYPE` (ne,)."""
        column = list(_FIELDS).index(name)
        return np.concatenate([some[:, column] for some in self.rows])


def apex_rows(foot: np.ndarray, kind: np.ndarray, apex: np.ndarray) -> np.ndarray:
    """Of each event the row (ne,) that saw the highest gap of what it ends: its own, or a period mark of the same foot
    since its last event; of equal ones the last. foot, kind, apex (ne,) of events, each foot's in order."""
    if not len(foot):
        return np.zeros(0, dtype=np.intp)
    order = np.argsort(foot, kind="stable")
    foot, ends, apex = (foot[order], kind[order] != EventKind.PERIOD_MARK, np.nan_to_num(apex[order], nan=-np.inf))
    begin = np.flatnonzero(np.concatenate([[True], ends[:-1] | (np.diff(foot) != 0)]))
    length = np.diff(begin, append=len(apex))
    top = np.repeat(np.maximum.reduceat(apex, begin), length)
    last = np.maximum.reduceat(np.where(apex == top, np.arange(len(apex)), 0), begin)
    found = np.empty(len(order), dtype=np.intp)
    found[order] = order[np.repeat(last, length)]
    return found


def without_marks(found: np.ndarray) -> np.ndarray:
    """Events of a run (structured) without the period marks, which cut the flights that they put together again:
    apexes are those of whole flights."""
    kept = found["kind"] != EventKind.PERIOD_MARK
    seen = found[apex_rows(found["foot"], found["kind"], found["apex"])[kept]]
    out = found[kept]
    out["apex"], out["apex_time"] = seen["apex"], seen["apex_time"]
    return out


def event_order(rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Order (ne,) of event rows in time, as runs hold them; and of every row the one whose time it has there.

    A rest bears the time at which its accumulation ends, which other feet's events may precede; it comes at the latest
    with the next event of its own foot.
    """
    time, given = rows[:, a.E_TIME], np.arange(len(rows))
    if np.all(time[1:] >= time[:-1]):
        return given, given
    for foot in np.unique(rows[:, a.E_FOOT]):
        own = np.flatnonzero(rows[:, a.E_FOOT] == foot)[::-1]
        earliest = np.minimum.accumulate(time[own]) == time[own]
        given[own] = own[np.maximum.accumulate(np.where(earliest, np.arange(len(own)), 0))]
    return np.argsort(time[given], kind="stable"), given


def event_places(rows: np.ndarray) -> Mapping[str, np.ndarray]:
    """Of each event of a run, marks left aside, the row (ne,) in ``rows`` that has its numbers, by field."""
    order, given = event_order(rows)
    kept = order[rows[order, a.E_KIND] != EventKind.PERIOD_MARK]
    seen = apex_rows(*(rows[:, column] for column in (a.E_FOOT, a.E_KIND, a.E_APEX)))[kept]
    own = {"time": given[kept], "apex": seen, "apex_time": seen}
    return {name: own.get(name, kept) for name in _FIELDS}


def structured_events(rows: np.ndarray) -> np.ndarray:
    """Kernel event rows (ne, 12) as a structured array, in their order (`event_order`)."""
    order, given = event_order(rows)
    out = _as_events(rows[order])
    out["time"] = rows[given[order], a.E_TIME]
    return out


def event_rows(events: np.ndarray) -> np.ndarray:
    """Kernel event rows (ne, 12) of a structured array of events."""
    return np.stack([events[name].astype(float) for name in _FIELDS], axis=1)


def structured_marks(rows: np.ndarray, feet: int) -> np.ndarray:
    """Rows of marks (nm, 3 + nb + 2 m) as a structured array: time [s]; body (nb,) coordinates [m, rad]; foot_x and
    slipped (m,) place along the way and path slid in contact so far [m]; lowest, highest: heave since the last mark.
    """
    kind = np.dtype(
        [
            ("time", "f8"),
            ("body", "f8", (rows.shape[1] - 3 - 2 * feet,)),
            ("foot_x", "f8", (feet,)),
            ("slipped", "f8", (feet,)),
            ("lowest", "f8"),
            ("highest", "f8"),
        ]
    )
    return np.ascontiguousarray(rows).view(kind).reshape(len(rows))


def _as_events(rows: np.ndarray) -> np.ndarray:
    """Rows (ne, 12) as a structured array, in their order."""
    out = np.array(rows, order="C")
    whole = out[:, [a.E_FOOT, a.E_KIND]]
    out[:, [a.E_FOOT, a.E_KIND]] = 0.0
    out = out.view(EVENT_TYPE)[:, 0]
    out["foot"], out["kind"] = whole.T
    return out
