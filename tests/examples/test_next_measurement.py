"""The example on what to record next: what walks cannot tell, and the exercise that does."""

from __future__ import annotations

import pytest

from example_files import load
from tarsus.fit.verdict import Verdict


# Slow: a minute and more of CPU, records of a second with derivatives. Rankings of a walker's records are made by
# synthesis/test_ranking.py and by the command line of determined.md.
@pytest.mark.slow
def test_next_measurement():
    example = load("next_measurement")
    walks, growth = example.asked()
    assert [path for path, word in walks.says.items() if word is Verdict.ASSUMED] == [example.GROWTH]
    assert f"Not from these records: {example.GROWTH}." in str(walks)
    (chosen, _), *_ = growth.ranking.plan.steps
    assert chosen.name.startswith("exercise-") and chosen.name.endswith("at 10.2 Hz, 7 V")
    assert growth.says[example.GROWTH] is Verdict.DETERMINED
