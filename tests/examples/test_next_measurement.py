"""The example on adhesion: what one record leaves open, and that the record asked for closes it."""

from __future__ import annotations

import numpy as np
import pytest

from example_files import load
from tarsus.identify.correlation import Sum
from tarsus.identify.verdict import Determined, OnlyTogether


# Slow: three posteriors of 512 draws. cli/test_next.py, unit/identify/test_ranking.py and test_verdict.py ask for the
# ranking and for the verdicts by default.
@pytest.mark.slow
def test_next_measurement():
    example = load("next_measurement")
    story = example.measured(draws=512)
    first = story.first.judge()[example.RATE]
    assert isinstance(first, OnlyTogether) and isinstance(first.combination, Sum)
    # the weight of C_a in the pull-off force is the contact time of the record: 15 Hz, held for nearly half a period
    assert dict(first.combination.weights)[example.RATE] == pytest.approx(0.030, rel=0.05)
    force = example.TRUTH[example.START] + 0.030 * example.TRUTH[example.RATE]
    assert first.combination.interval.low < force < first.combination.interval.high
    top = story.ranking.ranked[0]
    assert top.candidate.signal.frequency == 5.0
    second, instead = story.second.judge()[example.RATE], story.instead.judge()[example.RATE]
    assert isinstance(second, Determined)
    assert second.range.low < example.TRUTH[example.RATE] < second.range.high
    assert instead.range.half_width() > 2.0 * second.range.half_width()
    expected = {one.candidate.name: one.std for one in story.ranking.ranked}
    found = [np.std(np.log(w.samples[:, 1])) for w in (story.second, story.instead)]
    assert found[0] == pytest.approx(top.std, rel=0.5)
    assert found[1] == pytest.approx(expected["15 Hz, 6 V, lambda 0.25"], rel=0.5)
    assert "is determined" in example.text(story)
