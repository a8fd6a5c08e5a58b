"""examples/impact_records.py runs, and finds what the device was given."""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path

import numpy as np
import pytest

EXAMPLE = Path(__file__).parents[2] / "examples" / "impact_records.py"


def test_the_records_give_back_the_impact_map_of_the_device():
    spec = importlib.util.spec_from_file_location("example_impact_records", EXAMPLE)
    assert spec is not None and spec.loader is not None
    example = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = example
    spec.loader.exec_module(example)
    result = example.processed(repeats=2)
    assert result.estimate.restitution.value == pytest.approx(result.restitution, rel=0.02)
    assert np.linalg.norm(result.estimate.values - result.column) < 0.05 * np.linalg.norm(result.column)
    said = example.table(result)
    assert said.count("The repeat is accepted.") == 2
    assert "most like mode 6 of 2866 Hz" in said
