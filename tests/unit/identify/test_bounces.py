"""Which impacts tell the restitution: beside a jump of the drive, and beside others at which the foot is caught."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from tarsus.identify.bounce import FEWEST, BounceFit, find_bounces
from tarsus.identify.checks import TREND, with_speed
from tarsus.identify.draws import DRAWS
from tarsus.identify.restitution import PATH, BounceStudy, _alike, _caught, _events, _seen
from tarsus.identify.step import StepResult
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


@pytest.mark.parametrize(
    ("departures", "error", "kept"),
    [
        ([0.0, 0.0005, -0.001, 0.0440, 0.0435, 0.0442], 1e-3, [3, 4, 5]),  # caught as often as not
        ([0.0, 0.0440, 0.0442], 1e-3, [1, 2]),  # two tell no rule: the third is far off them
        ([0.0, 0.0005, -0.001], 1e-3, [0, 1, 2]),  # nothing is left of any approach
        ([0.0180, 0.0440, 0.0435, 0.0442], 1e-2, [0, 1, 2, 3]),  # too uncertain to tell
    ],
)
def test_a_foot_that_is_caught_and_let_go_is_no_rebound(departures, error, kept):
    fitted = fits(departures, error)
    single = np.ones(len(departures), dtype=bool)
    caught = _caught(fitted, single)
    assert np.flatnonzero(_alike(fitted, single & ~caught, np.arange(len(departures)))).tolist() == kept


def test_impacts_whose_approach_is_lost_in_its_error_tell_nothing():
    departures, approaches = [-0.005, -0.004, -0.003, 0.052, 0.104], [0.004, 0.005, 0.003, 0.1, 0.2]
    assert _seen(fits(departures, 1e-2, approaches)).tolist() == [False, False, False, True, True]
    assert _seen(fits(departures, 5e-4, approaches)).all()


def test_impacts_far_off_that_lie_on_a_line_over_speed_are_no_accidents():
    """Restitution that falls with speed: three slow impacts of a record beside thirty fast ones, and one caught
    within a sample, which is on no line."""
    fast, slow = np.linspace(0.114, 0.119, 30), np.array([0.064, 0.0645, 0.065])
    approaches = np.concatenate([fast, slow, [0.09]])
    departures = approaches * (0.36 - 0.09 * np.log(approaches / 0.116))
    departures[-1] *= 0.7
    fitted, every, events = fits(departures.tolist(), 5e-4, approaches.tolist()), np.ones(34, dtype=bool), np.arange(34)
    assert np.flatnonzero(~_alike(fitted, every, events)).tolist() == [33]
    two = events != 32  # fewer than are needed for a rule: far off the others
    assert np.flatnonzero(two & ~_alike(fitted, two, events)).tolist() == [30, 31, 33]


def test_repeats_of_one_capture_are_one_event_and_no_rule():
    """A foot that is caught within a sample, in three repeats of one record: they agree, and say nothing thrice."""
    approaches = np.concatenate([np.linspace(0.114, 0.119, 30), [0.0899, 0.09, 0.0901]])
    departures = 0.3 * approaches
    departures[-3:] = [0.0020, 0.0021, 0.0019]
    fitted, every = fits(departures.tolist(), 5e-4, approaches.tolist()), np.ones(33, dtype=bool)
    once = np.concatenate([np.arange(30), [30, 30, 30]])
    assert np.flatnonzero(~_alike(fitted, every, once)).tolist() == [30, 31, 32]
    assert _alike(fitted, every, np.arange(33)).all()  # three of them would be a rule


def test_a_slow_impact_that_repeats_show_to_rebound_more_is_no_capture():
    """Restitution that falls with speed, of which three repeats show one and the same slow impact: nothing that catches
    a foot lets it depart with more."""
    approaches = np.concatenate([np.linspace(0.114, 0.119, 30), [0.0640, 0.0645, 0.0650]])
    departures = approaches * (0.36 - 0.09 * np.log(approaches / 0.116))
    fitted, every = fits(departures.tolist(), 5e-4, approaches.tolist()), np.ones(33, dtype=bool)
    assert _alike(fitted, every, np.concatenate([np.arange(30), [30, 30, 30]])).all()


def test_impacts_of_repeats_at_one_moment_are_one_event():
    """Two records of one set and one of another, impacts at samples 10 and 30; one repeat sees its second a sample
    later."""
    traces = [replace(falling(30), set=name) for name in ("a", "a", "b")]
    moments = [(0, 10), (0, 30), (1, 10), (1, 31), (2, 10), (2, 33)]
    items = [SimpleNamespace(trace=trace, last=last) for trace, last in moments]
    numbers = _events(SimpleNamespace(traces=traces, items=items, step=STEP))
    assert numbers.tolist() == [0, 1, 0, 1, 2, 3]


def trend(falling: float, seed: int) -> float:
    """F of a trend in impacts at nearly one speed, and slower ones where restitution falls with speed, when what is not
    known of the moment adds to the approach what it takes from the departure."""
    random = np.random.default_rng(seed)
    true = np.concatenate([np.full(30, 0.116), np.full(6, 0.064 if falling else 0.116)])
    off = 6e-4 * random.standard_normal(36)
    departures = true * (0.4 - falling * np.log(true / 0.1)) - off + 2e-4 * random.standard_normal(36)
    fitted = fits(departures.tolist(), 1e-4, (true + off).tolist())
    fitted.inverse[:] = 6e-4**2 * np.ones((2, 2)) + 2e-4**2 * np.eye(2)  # of departure and (signed) approach
    step = StepResult("restitution", (PATH,), np.array([0.4]), np.full((DRAWS, 1), 0.4))
    items = [SimpleNamespace(trace=k % 6) for k in range(36)]
    study = BounceStudy(step, SimpleNamespace(items=items), fitted, np.zeros((DRAWS, 36)))
    return with_speed(step, study, 1).checks[0].value


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_noise_of_approaches_is_no_trend_of_restitution_with_speed(seed):
    assert trend(0.0, seed) < TREND < trend(0.09, seed)
