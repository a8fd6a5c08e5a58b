"""Measures on event tables made by hand."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest

from tarsus.measure import foot_history, period_statistics
from tarsus.solve.codes import EVENT_TYPE

BOUNCE, CAPTURE, RELEASE, REST, START, MARK = 1, 2, 3, 4, 5, 6


def table(*rows: tuple[float, int, float, float]) -> np.ndarray:
    """Events (time, kind, apex, approach speed) of foot 0; the apex is half-way back to the event before."""
    events = np.zeros(len(rows), dtype=EVENT_TYPE)
    before = 0.0
    for event, (time, kind, apex, speed) in zip(events, rows, strict=True):
        event["time"], event["kind"], event["apex"], event["speed_before"] = time, kind, apex, speed
        event["apex_time"] = 0.5 * (before + time)
        before = time
    return events


@dataclass
class Hand:
    """A run as measures see it."""

    all_events: np.ndarray
    duration: float
    period: float
    foot_names: tuple[str, ...] = ("foot",)


def test_a_bounce_clears_the_resolution_and_chatter_is_contact():
    # lands at 1, flies 0.2 um until 2, flies 0.05 um until 2.5 (chatter), stuck until 4
    events = table(
        (1.0, BOUNCE, 5e-6, 0.3), (2.0, BOUNCE, 2e-7, 0.2), (2.5, CAPTURE, 5e-8, 0.1), (4.0, RELEASE, 0.0, 0.0)
    )
    measures = period_statistics(Hand(events, 10.0, 10.0))
    assert measures["bounces"].value == 1.0
    assert measures["impacts"].value == 3.0
    assert measures["contact_duration"].value == pytest.approx(0.5 + 1.5)
    assert measures["duty_factor"].value == pytest.approx(0.2)
    assert measures["peak"].value == 5e-6
    assert measures["hardest_impact"].value == 0.3
    assert measures["impact_speed"].value == pytest.approx(0.2)
    finer = period_statistics(Hand(events, 10.0, 10.0), resolution=1e-8)
    assert finer["bounces"].value == 2.0
    assert finer["contact_duration"].value == pytest.approx(1.5)
    coarser = period_statistics(Hand(events, 10.0, 10.0), resolution=1e-6)
    assert coarser["bounces"].value == 0.0
    assert coarser["contact_duration"].value == pytest.approx(1.0 + 0.5 + 1.5)


def test_contact_is_shared_out_among_the_periods_it_spans():
    events = table((0.5, CAPTURE, 1e-6, 0.1), (2.25, RELEASE, 0.0, 0.0), (3.5, CAPTURE, 2e-6, 0.1))
    measures = period_statistics(Hand(events, 4.0, 1.0), skip=0)
    assert measures["contact_duration"].n == 4
    assert measures["contact_duration"].value == pytest.approx((0.5 + 1.0 + 0.25 + 0.5) / 4)
    assert measures["contact_duration"].spread == pytest.approx(np.std([0.5, 1.0, 0.25, 0.5], ddof=1))
    # an open contact lasts until the end; the first third (rounded up) of the periods is a transient
    late = period_statistics(Hand(events, 4.0, 1.0))
    assert late["contact_duration"].n == 2
    assert late["contact_duration"].value == pytest.approx((0.25 + 0.5) / 2)


def test_peaks_by_period_come_from_the_period_marks():
    # one flight over three periods: the highest gap of each is known from its mark
    events = table((0.1, BOUNCE, 3e-6, 0.1), (1.0, MARK, 4e-6, 0.0), (2.0, MARK, 9e-6, 0.0), (2.6, BOUNCE, 2e-6, 0.1))
    measures = period_statistics(Hand(events, 3.0, 1.0), skip=0)
    assert measures["peak"].value == pytest.approx((4e-6 + 9e-6 + 2e-6) / 3)
    assert measures["bounces"].value == pytest.approx(2 / 3), "the whole flight is one bounce"


def test_an_open_flight_counts_as_a_bounce_unless_it_was_seen_to_stay_low():
    open_flight = table((0.5, BOUNCE, 1e-6, 0.1))
    assert period_statistics(Hand(open_flight, 1.0, 1.0))["bounces"].value == 1.0
    low = table((0.5, BOUNCE, 1e-6, 0.1), (1.0, MARK, 4e-8, 0.0))
    assert period_statistics(Hand(low, 1.0, 1.0))["bounces"].value == 0.0


def test_a_foot_that_starts_in_contact():
    events = table((0.0, START, 0.0, 0.0), (0.25, RELEASE, 0.0, 0.0), (0.75, REST, 2e-6, 0.1))
    history = foot_history(events, 0, 1.0)
    assert history.hold_start.tolist() == [0.0, 0.75] and history.hold_end.tolist() == [0.25, 1.0]
    assert history.flight_start.tolist() == [0.25] and history.flight_end.tolist() == [0.75]
    assert not history.rebound.any()
    assert period_statistics(Hand(events, 1.0, 1.0))["contact_duration"].value == pytest.approx(0.5)


def test_no_event_at_all():
    measures = period_statistics(Hand(table(), 1.0, 0.25))
    assert measures["contact_duration"].value == 0.0 and measures["bounces"].value == 0.0
    assert np.isnan(measures["peak"].value) and np.isnan(measures["hardest_impact"].value)
    assert measures.bounces.definition.startswith("rebounds from contact")
    with pytest.raises(AttributeError, match="there are bounces"):
        _ = measures.nonsense


def test_feet_are_told_apart():
    events = np.concatenate([table((0.5, CAPTURE, 1e-6, 0.1)), table((0.8, CAPTURE, 3e-6, 0.2))])
    events["foot"] = [0, 1]
    contact = period_statistics(Hand(events, 1.0, 1.0, ("a", "b")))["contact_duration"]
    assert contact.per_foot["a"] == pytest.approx(0.5) and contact.per_foot["b"] == pytest.approx(0.2)
    assert contact.value == pytest.approx(0.35)
