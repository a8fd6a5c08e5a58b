"""The reproduction's arithmetic, checked on the source's own model, whose errors the source prints."""

from __future__ import annotations

import math

import pytest

from tarsus_reproduce.cantilever import compare, errors, periods_of, reproduce_cantilever, simulate_case
from tarsus_reproduce.cases import Case, Observation, packaged_cases
from tarsus_reproduce.mixtures import packaged_errors, packaged_members
from tarsus_reproduce.predictions import members_of


def test_errors_are_those_printed_in_table_a1():
    printed = {  # (peak, contact) in percent as printed, but for two signs of peaks (see the errata page)
        (5, 6, "square"): (-13, 1),
        (5, 8, "square"): (-25, -2),
        (5, 8, "sine"): (7, 12),
        (15, 6, "square"): (8, 0),
        (15, 6, "sine"): (8, 70),
        (15, 8, "square"): (-24, -3),
        (50, 6, "square"): (-32, 47),
        (50, 6, "sine"): (-21, 67),
        (50, 8, "sine"): (8, 21),
        (100, 6, "sine"): (15, 78),
        (100, 8, "square"): (-36, -35),
        (100, 8, "sine"): (9, -13),
    }
    for case in packaged_cases():
        found = errors(case.measured, case.source)
        peak, contact = printed[(case.freq_hz, case.volt_v, case.wave)]
        assert found.peak is not None and found.contact is not None
        assert 100 * found.peak == pytest.approx(peak, abs=1.01)
        assert 100 * found.contact == pytest.approx(contact, abs=1.01)


def test_zero_against_zero_is_no_error_and_something_against_zero_has_none():
    zero, some, empty = Observation(0.0, 0.0, 0.0), Observation(1.0, 5.0, 2.0), Observation()
    assert errors(zero, zero).contact == 0.0
    assert errors(zero, some).contact is None
    assert errors(empty, some).peak is None
    assert errors(some, Observation(1.0, math.nan, 2.0)).peak is None


def test_summary_of_the_sources_model_on_the_packaged_rows():
    cases = packaged_cases()
    table = compare([case.measured for case in cases], [case.source for case in cases])
    assert (table["existence_right"], table["count_right"], table["count_cases"]) == (12, 8, 12)
    assert table["mean_count_error"] == pytest.approx(4.5 / 12)
    peak, contact = table["peak"], table["contact"]
    assert (peak["below_30_percent"], peak["cases"]) == (10, 12)
    assert (contact["below_30_percent"], contact["cases"]) == (7, 12)
    assert peak["mean_signed_percent"] == pytest.approx(-8.2239, abs=1e-3)
    assert contact["mean_signed_percent"] == pytest.approx(20.2814, abs=1e-3)
    assert peak["mean_absolute_percent"] > abs(peak["mean_signed_percent"])


def test_counts_need_half_a_bounce_and_empty_cells_do_not_count():
    reference = [Observation(1.0), Observation(0.0), Observation(1.5), Observation()]
    simulated = [Observation(1.4), Observation(0.6), Observation(1.0), Observation(3.0)]
    table = compare(reference, simulated)
    assert table["count_cases"] == 3
    assert table["count_right"] == 1
    assert table["existence_right"] == 2
    assert table["peak"] == {
        "cases": 0,
        "in_means": 0,
        "mean_signed_percent": None,
        "mean_absolute_percent": None,
        "below_30_percent": 0,
    }


def test_contact_where_none_was_measured_is_a_miss_and_not_left_out():
    reference = [Observation(contact_ms=0.0), Observation(contact_ms=10.0), Observation(contact_ms=0.0)]
    simulated = [Observation(contact_ms=5.0), Observation(contact_ms=8.0), Observation(contact_ms=0.0)]
    contact = compare(reference, simulated)["contact"]
    assert (contact["cases"], contact["in_means"], contact["below_30_percent"]) == (3, 2, 2)
    assert contact["mean_absolute_percent"] == pytest.approx(10.0)


@pytest.mark.parametrize(("freq", "expected"), [(5.0, (4, 12)), (50.0, (5, 20)), (100.0, (10, 40))])
def test_transients_and_measured_periods(freq, expected):
    assert periods_of(freq) == expected


def test_cantilever_agrees_with_the_measurement_at_least_as_well_as_the_source():
    reproduction = reproduce_cantilever("cantilever")
    assert reproduction.ok
    table, source = (reproduction.summary()[name] for name in ("ours", "source"))
    assert table["count_cases"] == source["count_cases"] == 12
    for name, rows in (("peak", 12), ("contact", 11)):  # a contact measured as 0 has no relative error
        assert table[name]["in_means"] == rows
        assert table[name]["mean_absolute_percent"] < source[name]["mean_absolute_percent"]


def test_a_mixture_of_two_devices_lies_between_them():
    case = next(
        case for case in packaged_cases() if (case.freq_hz, case.volt_v, case.wave) == (100.0, 8.0, "sine")
    )
    both = [members_of(name)[0] for name in ("cantilever", "cantilever-1")]
    first, second = (simulate_case((one,), case) for one in both)
    mixed = simulate_case(members_of(both), case)
    for name in ("peak_um", "contact_ms"):
        one, other, mix = (getattr(row.predictions, name) for row in (first, second, mixed))
        assert min(one.low, other.low) <= mix.low and mix.high <= max(one.high, other.high)
        assert mix.high - mix.low >= 0.5 * abs(one.median - other.median)
    assert mixed.p_bounce == pytest.approx((first.p_bounce + second.p_bounce) / 2.0)


def test_the_packaged_mixture_predicts_with_intervals():
    """A row of no table: every member is simulated, weighed, and the interval is wider than one member's."""
    members = members_of(packaged_members("cantilever"))
    rules = {one.scene.ground.landing_rule.kind for one in members}
    assert rules and rules <= {"capture_unless_pulled", "restitute_first", "pull_as_printed"}
    assert sum(one.weight for one in members) == pytest.approx(1.0)
    case = Case(100.0, 6.0, "square", Observation(), Observation(), "rows.csv")
    whole, alone = simulate_case(members, case), simulate_case(members[:1], case)
    assert whole.ok and whole.role == "predicted"
    for name in ("peak_um", "contact_ms"):
        found, own = (getattr(row.predictions, name) for row in (whole, alone))
        assert found.high - found.low > own.high - own.low
        assert found.low <= found.median <= found.high
    assert 80.0 < whole.ours.peak_um < 300.0 and 0.5 < whole.ours.contact_ms < 8.0


@pytest.mark.slow  # all rows with all members take 20 s; one row stays in the default lane
def test_the_packaged_mixture_agrees_by_drive_periods_as_its_calibration_says_by_windows():
    table, told = reproduce_cantilever().summary()["ours"], packaged_errors("cantilever")
    assert told is not None
    for name in ("peak", "contact"):
        own = 100.0 * told["training"]["measures"][name]["mean_relative_error"]
        assert table[name]["mean_absolute_percent"] == pytest.approx(own, abs=3.0)
