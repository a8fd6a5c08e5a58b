"""The benchmark: its checks see errors. That the engine passes them: tests/analytic/test_oracles_sequences.py."""

from __future__ import annotations

import numpy as np

from tarsus.study import bench


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


def _some(count: int) -> bench.Pairs:
    whole = bench.pairs()
    rows = np.linspace(0, len(whole.impacts) - 1, count).astype(int)
    names = ("restitution", "film_scale", "impacts", "first", "tenth")
    return bench.Pairs(*(getattr(whole, name)[rows] for name in names))


def test_a_process_of_its_own_takes_no_module_from_the_users_folder(tmp_path, monkeypatch):
    (tmp_path / "numbers.py").write_text("raise SystemExit('not the one of Python')", encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    assert bench.isolated("import numbers, sys; print(numbers.Number.__name__, sys.argv[1])", "here") == "Number here\n"
