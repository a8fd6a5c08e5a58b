"""Oracle 10: whole event sequences of P1 and impact counts of P2."""

from __future__ import annotations

import numpy as np
import pytest

import tarsus as ts
from scene_files import impacts, scene
from tarsus.solve import ResultCode
from tarsus.study import bench


@pytest.mark.parametrize(("n", "count"), [(2, 349), (6, 127), (32, 145)])
def test_p1_whole_sequence(n, count):
    """Every impact, none more: the reference of n = 2 ends with the run, the others with their last given impact."""
    expected = bench.reference_impacts(n)
    assert len(expected) == count
    run = ts.simulate(scene(f"p1_n{n}"), duration=1.0 if n == 2 else expected[-1] * (1.0 + 1e-7))
    found = impacts(run.events)["time"]
    assert run.ok and len(found) == count
    np.testing.assert_allclose(found, expected, rtol=1e-8)
    assert bench.wrong_impacts(bench.TimedChain(n).impacts(), expected) == 0
    if n == 2:
        assert run.ledger.closure < 1e-8


def check_p2(members: np.ndarray) -> None:
    table = bench.pairs()
    chain = scene("p1_n2")
    film = chain.ground.film.coefficient * table.film_scale[members]
    vary = {"ground.restitution.coefficient": table.restitution[members], "ground.film.coefficient": film}
    batch = ts.simulate_batch(chain, vary, duration=0.2, track=False)
    assert all(code is ResultCode.DONE for code in batch.codes)
    times = [impacts(batch.events(i))["time"] for i in range(len(batch))]
    wrong = [int(member) for member, t in zip(members, times, strict=True) if len(t) != table.impacts[member]]
    assert wrong == [], f"wrong impact counts of members {wrong}"
    np.testing.assert_allclose([t[0] for t in times], table.first[members], rtol=1e-6)
    np.testing.assert_allclose([t[9] for t in times], table.tenth[members], rtol=1e-6)


def test_p2_a_sixteenth_of_the_members():
    check_p2(np.arange(5, 4096, 16) - np.arange(256) % 5)


@pytest.mark.slow
def test_p2_all_members():
    check_p2(np.arange(4096))
