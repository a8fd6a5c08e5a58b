"""examples/impact_records.py runs, and finds what the device was given."""

from __future__ import annotations

import numpy as np
import pytest

from example_files import load


def test_the_records_give_back_the_impact_map_of_the_device():
    example = load("impact_records")
    result = example.processed(repeats=2)
    assert result.estimate.restitution.value == pytest.approx(result.restitution, rel=0.02)
    assert np.linalg.norm(result.estimate.values - result.column) < 0.05 * np.linalg.norm(result.column)
    said = example.table(result)
    assert said.count("The repeat is accepted.") == 2
    assert "most like mode 6 of 2866 Hz" in said
