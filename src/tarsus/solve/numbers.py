"""Derivatives of one number of a run by the run's own events and states, where reverse derivatives begin."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, fields, replace

import numpy as np
from numpy.typing import NDArray

from tarsus.base.events import EventKind
from tarsus.core.arrays import E_APEX, E_APEX_TIME, E_FOOT, E_INTEGRAL, E_KIND, E_TIME
from tarsus.core.replay import Sampled
from tarsus.measure import Judgement, RunTable, event_slopes
from tarsus.solve.adjoint import Seeds
from tarsus.solve.codes import EVENT_TYPE, structured_events
from tarsus.solve.directional import Log, directional_slopes, measure_slopes, step_along

__all__ = ["Objective", "event_order", "measure_seeds", "objective_seeds"]

Floats = NDArray[np.float64]
Objective = Callable[..., float]
"""A function of the events with the period marks, or of these and of states at given times (`Sampled`)."""

AGREE = 1e-6
"""Part of all that a number is made of by which its derivative along a direction may miss what its derivatives by single
events come to; what differs more has a kink there, or is not the function that was taken apart."""
_NAMES = EVENT_TYPE.names or ()
_STATES = ("x", "v", "gap", "rate", "resistive", "smooth", "pull")


def event_order(rows: Floats) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Order (ne,) of event rows in time, as runs hold them; and of every row the one whose time it has there: a rest
    has that of the next event of its foot at the latest."""
    numbers = rows.copy()
    numbers[:, E_INTEGRAL] = np.arange(len(rows))
    found = structured_events(numbers)
    order = found["gap_integral"].astype(np.intp)
    given = np.arange(len(rows))
    for row, when in zip(order, found["time"], strict=True):
        if when != rows[row, E_TIME]:
            later = np.flatnonzero((rows[:, E_FOOT] == rows[row, E_FOOT]) & (rows[:, E_TIME] == when))
            given[row] = later[later > row][0]
    return order, given


def measure_seeds(log: Log, feet: tuple[str, ...], name: str) -> Seeds | None:
    """Of a measure of a run by name. log: of the run, derivatives aside; by_period tells whether the drive period moves.

    None where its derivatives by events are not known, and where it has a kink.
    """
    order, given = event_order(log.rows)
    events = structured_events(log.rows)
    table = RunTable(
        events, np.array([0, len(events)]), feet, np.array([log.end]), np.array([log.period]),
        np.zeros(1, dtype=np.intp), lambda _: None,
    )  # fmt: skip
    found = event_slopes(Judgement(table), name)
    if found is None:
        return None
    seeds = np.zeros_like(log.rows)
    for field, column in found.items():
        to = given[order] if field == "time" else order
        np.add.at(seeds[:, _NAMES.index(field)], to, column)
    return _checked(log, seeds, lambda one: measure_slopes(one, feet, name))


def _checked(
    log: Log, seeds: Floats, slopes: Callable[[Log], tuple[Floats, NDArray[np.bool_]]]
) -> Seeds | None:
    """Derivatives by event rows as seeds, the period's added, if the number moves by them along some direction."""
    marks = log.rows[:, E_KIND] == EventKind.PERIOD_MARK
    seeds[marks, E_TIME] = 0.0
    rising = marks & (log.rows[:, E_APEX_TIME] == log.rows[:, E_TIME]) & (log.rows[:, E_APEX] > 0.0)
    seeds[rising, E_APEX_TIME] = 0.0
    way = _direction(log, marks)
    trial = replace(log, slopes=way[..., None], by_period=np.zeros(1))
    (along,), (kinked,) = slopes(trial)
    parts = seeds * way
    rounding = 1e-11 * float(np.abs(log.rows).max(initial=1.0)) / step_along(trial, 0)
    if kinked or abs(parts.sum() - along) > AGREE * (np.abs(parts).sum() + abs(along)) + rounding:
        return None
    period = 0.0
    if log.by_period.any() and np.isfinite(log.period):
        turns = np.where(marks, np.round(log.rows[:, E_TIME] / log.period), 0.0)
        way = np.zeros_like(log.rows)
        way[:, E_TIME] = turns
        way[rising, E_APEX_TIME] = turns[rising]
        (period,), (kinked,) = slopes(replace(log, slopes=way[..., None], by_period=np.ones(1)))
        if kinked:
            return None
    return Seeds(seeds, np.zeros(0), np.zeros((0, 0)), float(period))


def _direction(log: Log, marks: NDArray[np.bool_]) -> Floats:
    """Some direction (ne, 12) in which events may move: those of one foot at one moment stay together."""
    rng = np.random.default_rng(len(log.rows))
    way = rng.uniform(0.5, 1.0, log.rows.shape) * np.abs(log.rows).max(axis=0, initial=0.0)
    way[:, [E_FOOT, E_KIND, E_APEX_TIME]] = 0.0
    way[marks, E_TIME] = 0.0
    _, first = np.unique(log.rows[:, [E_FOOT, E_TIME]], axis=0, return_inverse=True)
    return way


@dataclass
class _Place:
    """Numbers that move together, in an array that the objective reads: by how much, and whose derivative it is."""

    array: Floats
    at: NDArray[np.intp]
    step: float
    row: int
    column: int
