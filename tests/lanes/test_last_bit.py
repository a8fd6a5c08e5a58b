"""The engine on a processor of no make: linear algebra whose last bits are random. See `last_bit`."""

from __future__ import annotations

import numpy as np
import pytest

from lanes.test_kernels import run_engine
from last_bit import moved, same_for


@pytest.mark.slow
def test_the_engine_with_other_last_bits() -> None:
    said = run_engine({}, "--last-bit", "1")
    assert "the last bit of linear algebra is moved, seed 1" in said


def test_a_result_is_moved_by_one_unit_and_a_zero_not_at_all() -> None:
    given = np.array([1.0, -3.0, 0.0, 1e-300, np.pi] * 40)
    found = moved(given, same_for(1, given))
    assert np.array_equal(found, moved(given, same_for(1, given)))
    assert 0.5 < np.mean(found != given) / np.mean(given != 0.0) < 0.8
    assert np.all(np.abs(found - given) <= np.spacing(np.abs(given)))
    assert np.all(found[2::5] == 0.0)
    _, vectors = moved(np.linalg.eigh(np.diag([1.0, 2.0])), same_for(1))
    assert np.array_equal(vectors == 0.0, [[False, True], [True, False]])
