"""The example of a whole campaign: the numbers it finds, and the records it has not seen."""

from __future__ import annotations

import numpy as np
import pytest

import tarsus as ts
from example_files import load
from identify.campaigns import identified, truth
from tarsus.base.spec import float_paths
from tarsus.identify.result import identified_device


@pytest.mark.full
def test_its_table_of_a_small_campaign():
    """Of the campaign that tests/identify share; the example's own is below."""
    example, found = load("identify_campaign"), identified()
    lines = example.text(example.Story(truth(), found, identified_device(found))).splitlines()
    assert [line.split()[0] for line in lines[1:7]] == list(example.SHOWN)
    assert all(line.endswith(" determined") for line in lines[1:6])
    assert lines[6].endswith(" preferred")  # the film's exponent is open
    assert lines[-1] == f"{found.files_used} of {len(found.readings)} files used"


# Slow: 83 records are identified.
@pytest.mark.slow
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
    said = example.text(story)  # the film is one of several laws: its flights leave the exponent open
    assert said.count("determined") == len(example.SHOWN) - 1 and said.count("preferred") == 1
