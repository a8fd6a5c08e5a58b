"""The example on adhesion: what one record leaves open, and that the record asked for closes it."""

from __future__ import annotations

import pytest

import tarsus as ts
from example_files import load
from tarsus.identify.candidates import candidate_grid
from tarsus.identify.features import features_of


def _contact_time(example) -> float:
    """Of the first record of the true device [s], last period."""
    begin = candidate_grid((15.0,), (6.0,), (0.25,))[0]
    run = ts.simulate(ts.with_values(begin.on(example.device()), example.TRUTH), begin.record)
    return float(features_of(run, ("contact_duration",)).values[0])


# Slow: 512 draws weighed three times. cli/test_recommend.py, unit/identify/test_ranking.py and test_verdict.py ask for
# the ranking and for the verdicts by default.
@pytest.mark.slow
def test_next_measurement():
    example = load("next_measurement")
    story = example.measured(draws=512)
    first = story.first[example.RATE]
    assert first.word == "undecided" and not first.combination.product
    # the weight of C_a in the pull-off force is the contact time of the record: 15 Hz, held for nearly half a period
    held = _contact_time(example)
    assert 0.45 < held * 15.0 < 0.5
    assert dict(first.combination.terms)[example.RATE] == pytest.approx(held, rel=0.01)
    force = example.TRUTH[example.START] + held * example.TRUTH[example.RATE]
    assert first.combination.interval.low < force < first.combination.interval.high
    top = story.ranking.ranked[0]
    assert top.candidate.signal.frequency == 5.0
    second, instead = story.second[example.RATE], story.instead[example.RATE]
    assert second.word == "determined"
    assert second.range.low < example.TRUTH[example.RATE] < second.range.high
    assert instead.range.half_width() > 2.0 * second.range.half_width()
    expected = {one.candidate.name: one.std for one in story.ranking.ranked}
    found = [one.range.half_width() / 1.96 for one in (second, instead)]
    assert found[0] == pytest.approx(top.std, rel=0.5)
    assert found[1] == pytest.approx(expected["15 Hz, 6 V, lambda 0.25"], rel=0.5)
    assert "is determined" in example.text(story)
