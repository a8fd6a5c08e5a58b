"""One call from data to numbers: a bouncing ball, by its record and by a function of its runs."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import tarsus as ts
from tarsus.base.errors import InputError

BALL = Path(__file__).parents[1] / "scenes" / "ball.toml"
E, G = "ground.restitution.coefficient", "ground.gravity.acceleration"
UNKNOWNS = [ts.Unknown(E, 0.5, 0.9), ts.Unknown(G, "5 m/s^2", "20 m/s^2", "log")]
TIMES = np.linspace(0.05, 0.9, 12)


@pytest.fixture(scope="module")
def record():
    truth = ts.with_values(ts.read_scene(BALL), {E: 0.8, G: 9.5})
    return ts.simulate(truth, 1.0).states(TIMES).gap[0]


def test_a_record_is_fitted_from_anywhere_and_its_ranges_are_of_the_stated_error(record):
    found = ts.fit(BALL, UNKNOWNS, [ts.fit.Samples("ball", TIMES, record, "1 mm")], 1.0)
    assert found.values == {E: pytest.approx(0.8, rel=1e-6), G: pytest.approx(9.5, rel=1e-6)}
    (e, g), errors = found.ranges, found.found.uncertainty.errors
    assert e.low < 0.8 < e.high and e.high - e.low == pytest.approx(2 * 1.959964 * errors[E], rel=0.01)
    assert g.verdict == "determined" and found.correlations[0, 1] == pytest.approx(found.correlations[1, 0])
    assert ts.get_value(found.scene, G) == found.values[G]
    assert [row[0] for row in found.table().rows] == [E, G]
    assert found.to_dict()["unknowns"][E]["unit"] == "1"


def test_a_function_of_runs_finds_the_same_and_what_it_does_not_see_is_not_determined(record):
    def early(run):
        return (run.states(TIMES[:3]).gap - record[:3]) / 1e-3  # (1, 3), feet by times

    found = ts.fit(BALL, UNKNOWNS, early, 1.0)
    assert found.values[G] == pytest.approx(9.5, rel=1e-5)
    e = found.ranges[0]
    assert e.verdict == "undecided" and not e.closed
    with pytest.raises(InputError, match="as many numbers"):
        ts.fit(BALL, UNKNOWNS, lambda run: run.events["time"], 1.0)


@pytest.mark.parametrize(
    ("given", "said"), [([0.0, np.nan], "number 2 is NaN in all of 16 runs"), (None, "needs a `return` of numbers")]
)
def test_residuals_that_are_no_number_are_reported(given, said):
    with pytest.raises(InputError, match=said):
        ts.fit(BALL, UNKNOWNS[:1], lambda run: given, 1.0)


def test_runs_that_do_not_reach_their_end_are_counted_and_a_fit_without_any_is_refused(record):
    samples = [ts.fit.Samples("ball", TIMES, record, "1 mm")]

    def seen(run):
        return (run.states(TIMES).gap[0] - record) / 1e-3

    for residuals in (samples, seen):
        said = r"^16 of 16 runs did not reach their end \(16 STEP_LIMIT\): nothing is fitted"
        with pytest.raises(InputError, match=said):
            ts.fit(BALL, UNKNOWNS[:1], residuals, 1.0, accuracy=ts.Accuracy(steps=1))
        some = ts.fit(BALL, UNKNOWNS[:1], residuals, 1.0, accuracy=ts.Accuracy(steps=2))
        tried = some.problem.tried
        assert 0 < tried.stopped.total() < tried.count
        said = f"{tried.stopped.total()} of {tried.count} runs did not reach their end"
        shown = " ".join(str(some).split())
        assert said in shown and "keeps to where runs do" in shown
    whole = ts.fit(BALL, UNKNOWNS[:1], samples, 1.0)
    assert not whole.problem.tried.stopped and "did not reach" not in str(whole)
