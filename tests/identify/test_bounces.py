"""Which impacts tell the restitution: beside a jump of the drive, and beside others at which the foot is caught."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.stats import binom

from tarsus.identify.bounce import FEWEST, BounceFit, find_bounces
from tarsus.identify.covariance import scattered
from tarsus.identify.influence import EVENT, SPEED, Influence
from tarsus.identify.restitution import PATH, TURN, _caught, _events, _over_speed, _seen
from tarsus.identify.robust_ratio import RobustRatio, robust_ratio, slope_over
from tarsus.identify.surprises import Surprises, surprises
from tarsus.identify.traces import Trace

STEP = 5e-5
NOISE_X, NOISE_V = 1e-9, 1e-4
SAMPLES = 60


def falling(last: int, jump: int | None = None) -> Trace:
    """A foot that meets the ground 0.4 of a step after its last sample before, and departs half as fast, for good; the
    drive jumps after a sample."""
    time = STEP * np.arange(SAMPLES, dtype=np.float64)
    after = time - time[last] - 0.4 * STEP
    x = np.where(after < 0.0, -0.1 * after, 0.05 * after)
    v = np.where(after < 0.0, -0.1, 0.05)
    volts = np.where(np.arange(SAMPLES) > (SAMPLES if jump is None else jump), 2.0, -2.0)
    volts[-1] = 2.0
    noise = np.array([NOISE_X]), np.array([NOISE_V])
    return Trace("made", "made", ("tip",), time, x[None], v[None], volts, *noise, np.array([1e-10]))


@pytest.mark.parametrize(
    ("jump", "sides"),
    [
        (None, (20, 20)),  # the longest that are fitted
        (29, (1, 20)),  # between the last two samples before the impact
        (28, (2, 20)),
        (31, (20, 1)),
        (30, None),  # with the impact itself: no sample on that side tells anything
    ],
)
def test_an_impact_beside_a_jump_of_the_drive_is_fitted_up_to_the_jump(jump, sides):
    found, left = find_bounces([falling(30, jump)], "tip", 0.0)
    assert [(one.before, one.after) for one in found] == ([] if sides is None else [sides])
    assert len(left) == (sides is None)


def test_an_impact_beside_another_contact_is_not_used():
    trace = falling(30)
    stood = slice(30 + FEWEST - 1, 30 + FEWEST + 1)
    trace.x[0, stood], trace.v[0, stood] = 0.0, 0.0
    found, left = find_bounces([trace], "tip", 0.0)
    assert not found and f"only {FEWEST - 1} samples of free flight after it" in left[0].reason


def fits(departures: list[float], error: float, approaches: float | list[float] = 0.1) -> BounceFit:
    """Impacts that approach at 0.1 m/s, or at the speeds that are given."""
    count = len(departures)
    speeds = np.column_stack([-np.broadcast_to(approaches, count), departures])
    return BounceFit(speeds, np.tile(error**2 * np.eye(2), (count, 1, 1)), np.ones(count))


def like(fitted: BounceFit, single: np.ndarray, events: np.ndarray) -> list[int]:
    """Impacts of single ones whose ratio is like that of the others."""
    at = np.flatnonzero(single)
    some = fitted.chosen(single)
    found = robust_ratio(some.speeds[:, 0], -some.speeds[:, 1], some.covariance * TURN, events[single])
    return at[np.abs(found.off) < 3.5].tolist()


@pytest.mark.parametrize(
    ("departures", "error", "kept"),
    [
        ([0.0, 0.0005, -0.001, 0.0440, 0.0435, 0.0442], 1e-3, [3, 4, 5]),  # caught as often as not
        ([0.0, 0.0005, -0.001], 1e-3, [0, 1, 2]),  # nothing is left of any approach
        ([0.0180, 0.0440, 0.0435, 0.0442], 1e-2, [0, 1, 2, 3]),  # too uncertain to tell
    ],
)
def test_a_foot_that_is_caught_and_let_go_is_no_rebound(departures, error, kept):
    fitted = fits(departures, error)
    single = np.ones(len(departures), dtype=bool)
    caught = _caught(fitted, single)
    assert like(fitted, single & ~caught, np.arange(len(departures))) == kept


def test_impacts_whose_approach_is_lost_in_its_error_tell_nothing():
    departures, approaches = [-0.005, -0.004, -0.003, 0.052, 0.104], [0.004, 0.005, 0.003, 0.1, 0.2]
    assert _seen(fits(departures, 1e-2, approaches)).tolist() == [False, False, False, True, True]
    assert _seen(fits(departures, 5e-4, approaches)).all()


def many(far: float, times: int, seed: int = 1) -> tuple[BounceFit, np.ndarray]:
    """Fifty-nine events of ratio 0.3 and one of another ratio, each seen so many times with noise of its own."""
    random = np.random.default_rng(seed)
    ratio = np.concatenate([np.full(59, 0.3), [far]])
    approach = np.concatenate([np.linspace(0.05, 0.12, 59), [0.09]])
    events = np.repeat(np.arange(60), times)
    speeds = approach[events] + 4e-4 * random.standard_normal(60 * times)
    departures = (ratio * approach)[events] + 4e-4 * random.standard_normal(60 * times)
    return fits(departures.tolist(), 4e-4, speeds.tolist()), events


def ratio_of(fitted: BounceFit, events: np.ndarray) -> RobustRatio:
    return robust_ratio(fitted.speeds[:, 0], -fitted.speeds[:, 1], fitted.covariance * TURN, events)


def test_three_repeats_of_one_capture_are_one_event_far_off():
    """A foot that is caught within a sample, in three repeats of one record: they agree, and are one event that pulls
    the ratio by next to nothing, and its error neither."""
    fitted, events = many(0.02, 3)
    found = ratio_of(fitted, events)
    assert np.flatnonzero(np.abs(found.off) > 3.5).tolist() == [177, 178, 179]
    assert np.abs(found.off[177:]).min() > 100.0
    kept = np.arange(180) < 177
    without = ratio_of(fitted.chosen(kept), events[kept])
    assert found.value == pytest.approx(without.value, abs=2e-4)
    assert found.value == pytest.approx(0.3, abs=1.6e-3)
    error = scattered(influence_of(found, events), 1).std()
    assert error < 1.1 * scattered(influence_of(without, events[kept]), 1).std() < 1e-3


@pytest.mark.parametrize(("power", "passed"), [(-0.15, False), (0.15, False), (0.0, True)])
def test_one_impact_at_another_speed_shows_that_restitution_goes_by_speed(power, passed):
    """Twenty events at 0.115 m/s and one at 0.065, each in three repeats: the slope is that of the law, within its
    error, which holds a flat one; an event that is something else, at the speed of most, is no slope."""
    random = np.random.default_rng(3)
    events, approach = np.repeat(np.arange(21), 3), np.concatenate([[0.065], np.full(20, 0.115)])
    ratio = 0.36 * (approach / 0.115) ** power * np.where(np.arange(21) == 5, 0.1, 1.0)
    departures = (ratio * approach)[events] + 6e-4 * random.standard_normal(63)
    fitted = fits(departures.tolist(), 6e-4, (approach[events] + 6e-4 * random.standard_normal(63)).tolist())
    asked = fitted.speeds[:, 0], -fitted.speeds[:, 1], fitted.covariance * TURN, events
    found = robust_ratio(*asked)
    slope, error = slope_over(*asked, found.value)
    true = (ratio[0] - 0.36) / np.log(0.065 / 0.115)
    assert abs(slope - true) < 2.5 * error and error < 0.012
    check = _over_speed(found, slope, error)
    assert check.passed is passed and check.paths == (PATH,)
    assert passed or f"changes with speed: by {'+-'[power < 0.0]}0.0" in check.cause


def test_few_events_that_scatter_seldom_show_a_slope_over_speed():
    rng, seen = np.random.default_rng(1), []
    covariance = np.broadcast_to(np.diag([1e-6, 1e-12]), (8, 2, 2))
    for approach in 0.1 * np.exp(0.4 * rng.normal(size=(400, 8))):
        departure = approach * (0.4 + 0.01 * rng.normal(size=8)) + 1e-5 * rng.normal(size=8)
        slope, error = slope_over(departure, approach, covariance * 1e-4, np.arange(8), 0.4)
        seen.append(abs(slope) / error)
    assert np.mean(np.array(seen) > 3.0) < 0.02  # 0.06 with the error of a known scatter


def influence_of(found: RobustRatio, events: np.ndarray) -> Influence:
    score = found.score[:, None]
    return Influence((PATH,), found.clipped_information[:, None, None], score, np.ones(1), {EVENT: events}, {})


def test_what_repeats_show_of_events_that_scatter_counts_once():
    """Events whose ratio scatters by a tenth: the error is that of their number, however often each is seen."""
    random, errors = np.random.default_rng(4), []
    ratio, approach = 0.3 + 0.03 * random.standard_normal(60), np.linspace(0.05, 0.12, 60)
    for times in (1, 3):
        events = np.repeat(np.arange(60), times)
        fitted = fits((ratio * approach)[events].tolist(), 1e-4, approach[events].tolist())
        found = ratio_of(fitted, events)
        assert found.scatter == pytest.approx(0.03, rel=0.2)
        errors.append(float(scattered(influence_of(found, events), 1).std()))
    assert errors[1] == pytest.approx(errors[0], rel=0.02)
    assert errors[0] == pytest.approx(0.03 / np.sqrt(60.0), rel=0.25)


def test_student_weights_cover_the_ratio_of_normal_events():
    covered, trials = 0, 200
    for seed in range(trials):
        fitted, events = many(0.3, 1, seed)
        found = ratio_of(fitted, events)
        low, high = np.quantile(scattered(influence_of(found, events), seed), [0.025, 0.975])
        covered += bool(low <= found.value - 0.3 <= high)
    assert binom.ppf(1e-3, trials, 0.95) <= covered <= binom.ppf(0.999, trials, 0.98)


def test_impacts_of_repeats_at_one_moment_are_one_event():
    """Two records of one set and one of another, impacts at samples 10 and 30; one repeat sees its second a sample
    later."""
    traces = [replace(falling(30), set=name) for name in ("a", "a", "b")]
    moments = [(0, 10), (0, 30), (1, 10), (1, 31), (2, 10), (2, 33)]
    items = [SimpleNamespace(trace=trace, last=last) for trace, last in moments]
    numbers = _events(SimpleNamespace(traces=traces, items=items, step=STEP))
    assert numbers.tolist() == [0, 1, 0, 1, 2, 3]


def trend(falling: float, seed: int) -> Surprises:
    """What is said of impacts at nearly one speed, and slower ones where restitution falls with speed, when what is not
    known of the moment adds to the approach what it takes from the departure."""
    random = np.random.default_rng(seed)
    true = np.concatenate([np.full(30, 0.116), np.full(6, 0.064)])
    off = 6e-4 * random.standard_normal(36)
    departures = true * (0.4 - falling * np.log(true / 0.1)) - off + 2e-4 * random.standard_normal(36)
    fitted = fits(departures.tolist(), 1e-4, (true + off).tolist())
    fitted.inverse[:] = 6e-4**2 * np.ones((2, 2)) + 2e-4**2 * np.eye(2)  # of departure and (signed) approach
    found = ratio_of(fitted, np.arange(36))
    one = Influence(
        (PATH,),
        found.clipped_information[:, None, None],
        found.clipped[:, None],
        np.ones(1),
        {EVENT: np.arange(36)},
        {SPEED: np.log(found.support)},
    )
    return surprises([one], seed)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_noise_of_approaches_is_no_trend_of_restitution_with_speed(seed):
    assert not trend(0.0, seed).found
    (told,) = trend(0.09, seed).found
    assert told.along == SPEED and told.slope == pytest.approx(-0.09, abs=3.0 * told.error)
    assert told.moves(0.005) and not told.moves(0.05)
    assert told.sentence().startswith(f"{PATH} falls with the logarithm of speed: 0.0")
