"""The benchmark: its data are the published reference, its checks see errors, and the engine passes them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tarsus.study import bench

REFERENCE = Path(__file__).parents[2] / "benchmarks" / "reference"


@pytest.mark.parametrize("n", bench.SIZES)
def test_packaged_impacts_are_the_reference(n):
    times = np.loadtxt(REFERENCE / f"p1_n{n}_impacts_ms.csv", comments="#")
    np.testing.assert_array_equal(bench.reference_impacts(n), times * 1e-3)


def test_packaged_chains_and_pairs_are_the_reference():
    here = Path(bench.__file__).parents[1] / "data" / "bench" / "chains.json"
    assert here.read_bytes() == (REFERENCE / "p1.json").read_bytes()
    table = np.loadtxt(REFERENCE / "p2_reference.csv", delimiter=",", comments="#")
    pairs = bench.pairs()
    assert len(pairs.impacts) == 4096
    np.testing.assert_array_equal(pairs.restitution, table[:, 0])
    np.testing.assert_array_equal(pairs.film_scale, table[:, 1])
    np.testing.assert_array_equal(pairs.impacts, table[:, 2])
    np.testing.assert_allclose(pairs.tenth, table[:, 4] * 1e-3, rtol=1e-15)


def test_errors_are_counted():
    right = np.array([1.0, 2.0, 3.0])
    assert bench.wrong_impacts(right, right) == 0
    assert bench.wrong_impacts(right * (1.0 + 0.9e-6), right) == 0
    assert bench.wrong_impacts(np.array([1.0, 2.00001, 3.0]), right) == 1
    assert bench.wrong_impacts(right[:2], right) == 1
    assert bench.wrong_impacts(np.array([1.0, 1.5, 2.0, 3.0]), right) == 3


def test_errors_of_pairs_are_counted():
    some = _some(4)
    good = (some.impacts, some.first, some.tenth)
    assert bench.wrong_pairs(good, some) == 0
    assert bench.wrong_pairs((some.impacts + np.array([1, 0, 0, 0]), *good[1:]), some) == 1
    assert bench.wrong_pairs((some.impacts, some.first, some.tenth * (1 + 2e-6)), some) == 4
    assert bench.wrong_pairs((some.impacts, some.first, np.full(4, np.nan)), some) == 4


@pytest.mark.parametrize("n", bench.SIZES)
def test_whole_sequences_are_right(n):
    chain = bench.TimedChain(n)
    assert bench.wrong_impacts(chain.impacts(), bench.reference_impacts(n)) == 0


def test_members_of_the_batch_are_right():
    some = _some(64)
    answer, seconds = bench.run_pairs(some.restitution, some.film_scale)
    assert bench.wrong_pairs(answer, some) == 0
    assert seconds > 0.0


def _some(count: int) -> bench.Pairs:
    whole = bench.pairs()
    rows = np.linspace(0, len(whole.impacts) - 1, count).astype(int)
    names = ("restitution", "film_scale", "impacts", "first", "tenth")
    return bench.Pairs(*(getattr(whole, name)[rows] for name in names))


def test_a_process_of_its_own_takes_no_module_from_the_users_folder(tmp_path, monkeypatch):
    (tmp_path / "numbers.py").write_text("raise SystemExit('not the one of Python')", encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    assert bench.isolated("import numbers, sys; print(numbers.Number.__name__, sys.argv[1])", "here") == "Number here\n"
