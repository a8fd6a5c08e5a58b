"""Measures on event tables made by hand."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest

from tarsus.base.errors import InputError
from tarsus.measure import (
    CautionKind,
    Counting,
    Scope,
    histories_of,
    period_statistics,
    whole_run_statistics,
    window_statistics,
)
from tarsus.measure.periods import by_window
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
    reached: float | None = None

    @property
    def end_time(self) -> float:
        return self.duration if self.reached is None else self.reached


MS, US = 1e-3, 1e-6


def measures_of_feet(run: Hand):
    return {**period_statistics(run), **whole_run_statistics(run)}


def test_each_foot_has_its_own():
    events = np.concatenate([table((0.5, CAPTURE, 1e-6, 0.1)), table((0.8, CAPTURE, 3e-6, 0.2))])
    events["foot"] = [0, 1]
    run = Hand(events, 1.0, 1.0, ("a", "b"))
    found = measures_of_feet(run)
    contact = found["contact_duration"]
    assert contact.per_foot["a"] == pytest.approx(0.5) and contact.per_foot["b"] == pytest.approx(0.2)
    assert contact.value == pytest.approx(0.35) and contact.scope is Scope.MEAN
    worst = {"peak": 3e-6, "max_peak": 3e-6, "hardest_impact": 0.2, "longest_contact": 0.5}
    for name, value in worst.items():
        assert found[name].value == pytest.approx(value), f"{name}: an extreme is never a mean"
        assert found[name].scope is Scope.WORST
        assert found[name].value == pytest.approx(max(found[name].per_foot.values()))
    means = {name for name, one in found.items() if one.scope is Scope.MEAN}
    assert means == set(found) - set(worst)
    alone = measures_of_feet(Hand(events[:1], 1.0, 1.0))
    assert {one.scope for one in alone.values()} == {Scope.FOOT}


def test_the_spread_of_the_worst_foot_is_its_own():
    events = table(
        (0.4, BOUNCE, 4e-6, 0.0), (0.9, CAPTURE, 2e-6, 0.0), (1.1, RELEASE, 0.0, 0.0), (1.5, CAPTURE, 5e-6, 0.0)
    )
    other = table(
        (0.4, BOUNCE, 1e-6, 0.0), (0.9, CAPTURE, 1e-6, 0.0), (1.1, RELEASE, 0.0, 0.0), (1.5, CAPTURE, 4e-6, 0.0)
    )
    other["foot"] = 1
    both = np.concatenate([events, other])
    peak = period_statistics(Hand(both[np.argsort(both["time"], kind="stable")], 2.0, 1.0, ("a", "b")), skip=0)["peak"]
    assert peak.value == pytest.approx(4.5e-6) and peak.n == 2
    assert peak.spread == pytest.approx(np.std([4e-6, 5e-6], ddof=1)), "not the larger one of foot b"


def hops(count: int, apex: float, *, long: tuple[int, ...] = (), high: float = 0.0) -> np.ndarray:
    """Parabolic flights of 0.5 ms, each after a capture of 50 us, or of 2 ms and ``high`` where its number is in
    ``long``; the integral of the gap is that of the parabolas."""
    rows, whole, time = [(0.5 * MS, CAPTURE, apex, 0.1)], [2 / 3 * apex * 0.5 * MS], 0.5 * MS
    for number in range(count):
        top = high if number in long else apex
        time += 2 * MS if number in long else 50 * US
        rows.append((time, RELEASE, 0.0, 0.0))
        whole.append(whole[-1])
        time += 0.5 * MS
        rows.append((time, CAPTURE, top, 0.1))
        whole.append(whole[-1] + 2 / 3 * top * 0.5 * MS)
    events = table(*rows)
    events["gap_integral"] = whole
    return events


def test_windows_share_the_definitions_of_periods():
    events = hops(20, 6e-6)
    end = float(events["time"][-1]) + MS
    run = Hand(events, end, end)
    found = window_statistics(run, 2.1 * MS, 4.4 * MS, 2)  # eight hops of 0.55 ms each, twice
    assert found["bounces"].value == 8.0 and found["bounces"].n == 2 and found["bounces"].spread == 0.0
    assert found["bounces_per_second"].value == pytest.approx(8 / 4.4e-3)
    assert found["mean_apex"].value == pytest.approx(6e-6) == found["peak"].value
    assert found["duty_factor"].value == pytest.approx(50 / 550)
    assert found["mean_height"].value == pytest.approx(4e-6 * 500 / 550)
    assert "window of 4.4 ms" in found["bounces"].definition
    whole = by_window(histories_of(run), np.array([0.0, end]), Counting.of(end))
    for name, rows in whole.items():
        assert rows[0, 0] == pytest.approx(period_statistics(run)[name].value), name
    for start, length, count in ((-1e-3, 1e-3, 1), (0.0, end, 2), (0.0, 0.0, 1), (0.0, 1e-3, 0)):
        with pytest.raises(InputError, match="lie within"):
            window_statistics(run, start, length, count)


def test_an_edge_inside_a_flight_shares_its_area_as_a_parabola_does():
    events = hops(2, 6e-6)
    run = Hand(events, 3 * MS, 3 * MS)
    flight = events["time"][1]  # from here on 0.5 ms
    quarter = window_statistics(run, flight, 0.125 * MS)["mean_height"]
    s = (np.arange(1000) + 0.5) / 4000
    assert quarter.value == pytest.approx(float(np.mean(4 * 6e-6 * s * (1 - s))), rel=1e-5)


def test_a_mean_height_that_is_not_known_is_none():
    cut = Hand(table((0.5, BOUNCE, 1e-6, 0.1)), 2.0, 1.0)  # stopped in the air, without a mark
    assert np.isnan(period_statistics(cut, skip=1)["mean_height"].value)


def test_a_warning_where_the_highest_flights_are_not_counted():
    run = Hand(hops(20, 3e-6, long=(3, 11, 17), high=40e-6), 0.02, 0.02)
    found = period_statistics(run)
    assert found["bounces"].value == 17.0
    warning = next(one for one in found.warnings if one.kind is CautionKind.HIGHEST_UNCOUNTED)
    assert "foot" in str(warning) and "40 µm" in str(warning) and "longer than 500 µs" in str(warning)
    longer = period_statistics(run, dwell=3 * MS)
    assert longer["bounces"].value == 20.0
    assert CautionKind.HIGHEST_UNCOUNTED not in {one.kind for one in longer.warnings}


@pytest.mark.parametrize(("high", "warned"), [(59e-6, False), (61e-6, True)])
def test_a_warning_where_the_median_bounce_is_below_a_twentieth_of_the_peak(high, warned):
    found = period_statistics(Hand(hops(20, 3e-6, long=(3,), high=high), 0.02, 0.02))
    assert found["peak"].value == high and found["mean_apex"].value < 7e-6
    assert (CautionKind.COUNTED_LOW in {one.kind for one in found.warnings}) == warned


@pytest.mark.parametrize(("flights", "median"), [(9, "5 µm"), (10, "5.5 µm")])
def test_the_median_bounce_that_a_warning_states(flights, median):
    """Bounces of 1, 2, 3 ... um, the last of them far higher."""
    events = hops(flights, 1e-6)
    events["apex"][2::2] = np.arange(1, flights + 1) * 1e-6
    events["apex"][-1] = 1e-3
    said = str(period_statistics(Hand(events, 0.02, 0.02)).warnings[0])
    assert said == f"Foot foot: its median bounce is {median} high, its peak 1 mm."


def test_a_warning_where_periods_are_too_few_for_a_spread():
    events = hops(4, 3e-6)
    few = period_statistics(Hand(events, 3 * MS, MS), skip=1).warnings
    assert [one.kind for one in few] == [CautionKind.FEW_PERIODS] and "2 drive periods" in str(few[0])
    assert not period_statistics(Hand(events, 3 * MS, MS), skip=0).warnings


def test_a_run_that_stopped_early_has_the_periods_that_it_reached():
    events = table((0.4, BOUNCE, 4e-6, 0.1), (0.9, CAPTURE, 2e-6, 0.1))
    early = measures_of_feet(Hand(events, 1e12, 1.0, reached=3.5))  # laid out over 1e12 periods: no memory holds it
    assert early["bounces"].n == 2 and early["duty_factor"].value == 1.0
    broken = measures_of_feet(Hand(events, 10.0, 5.0, reached=2.0))
    assert broken["duty_factor"].value == pytest.approx(1.1 / 2.0) and broken["longest_contact"].value == pytest.approx(
        1.1
    )
    never = period_statistics(Hand(table((0.0, START, 0.0, 0.0)), 10.0, 5.0, reached=0.0))
    assert all(np.isnan(one.value) and one.n == 0 for one in never.values())
    assert [one.kind for one in never.warnings] == [CautionKind.FEW_PERIODS]


def test_a_measure_that_is_none_is_told_with_what_is_meant():
    measures = whole_run_statistics(Hand(table(), 1.0, 0.25))
    with pytest.raises(AttributeError, match="no measure 'nonsense'"):
        _ = measures.nonsense
    with pytest.raises(KeyError, match="did you mean 'total_rebounds_any_height'"):
        measures["all_rebounds"]
    assert "all_rebounds" not in measures and "total_rebounds_any_height" in measures
