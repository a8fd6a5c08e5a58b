"""Series of a run are asked for at times in order; others are refused in a sentence, not answered wrongly."""

from __future__ import annotations

import numpy as np
import pytest

import tarsus as ts
from tarsus.solve.run import increasing


def test_times_are_a_row_in_order() -> None:
    assert increasing([0.0, 0.1, 0.1]).tolist() == [0.0, 0.1, 0.1]
    assert increasing([]).shape == (0,)
    with pytest.raises(ts.InputError, match="in order"):
        increasing([0.03, 0.01])
    with pytest.raises(ts.InputError, match="a row of times"):
        increasing(0.01)


@pytest.mark.parametrize("device", ["cantilever", "millipede"])
def test_every_kind_of_run_refuses_times_out_of_order(device: str) -> None:
    run = ts.simulate(ts.load_scene(device), duration=0.02)
    for ask in (run.at, run.states, run.to_dataset):
        with pytest.raises(ts.InputError, match="in order"):
            ask(np.array([0.01, 0.005]))
