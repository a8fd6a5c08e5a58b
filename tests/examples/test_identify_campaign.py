"""The example of a whole campaign: the numbers it finds, and the records it has not seen."""

from __future__ import annotations

import numpy as np
import pytest

import tarsus as ts
from example_files import load
from tarsus.base.spec import float_paths


# Slow: 83 records are identified. unit/identify/test_chain.py asks the same of a smaller campaign by default.
@pytest.mark.full
def test_identify_campaign():
    example = load("identify_campaign")
    story = example.identified()
    found, true = story.found, float_paths(story.truth)
    limits = dict(zip(example.SHOWN, (5e-4, 0.03, 0.03, 0.10, 0.10, 0.10), strict=True))
    values = dict(zip(found.known.paths, found.known.values, strict=True))
    for path, limit in limits.items():
        assert values[path] == pytest.approx(true[path].value, rel=limit)
    assert np.median([one.off for one in found.comparisons]) < 0.05
    assert found.files_used == len(found.readings) == 83
    assert ts.simulate(story.device, 0.01).ok
    assert example.text(story).count("determined") == len(example.SHOWN)
