"""The store of a sweep: what is whole counts, everything else does not."""

from __future__ import annotations

import numpy as np
import pytest

from tarsus.base.errors import InputError
from tarsus.files.sweepstore import PLAN_FILE, SweepStore

TEXTS = {"study.toml": "a = 1\n", "scene.toml": "b = 2\n"}


def opened(folder, digest: str = "d", texts: dict[str, str] = TEXTS, **options) -> SweepStore:
    return SweepStore.open(folder, digest, 3, texts, **options)


def arrays(unit: int) -> dict[str, np.ndarray]:
    return {"code": np.full(2, unit, np.int8), "value": np.array([[1.0 / (unit + 3)], [np.nan]])}


def test_what_is_written_is_read_back_exactly(tmp_path):
    store = opened(tmp_path / "new")
    for unit in (2, 0, 1):
        assert unit in store.pending()
        store.write(unit, arrays(unit))
    assert store.pending() == []
    collected = store.collect()
    assert collected["code"].tolist() == [0, 0, 1, 1, 2, 2]
    assert np.array_equal(collected["value"][::2, 0], [1 / 3, 1 / 4, 1 / 5])
    assert {path.name for path in (tmp_path / "new").iterdir()} == {*TEXTS, PLAN_FILE, "units"}


def test_half_a_file_and_another_plans_file_are_not_done(tmp_path):
    store = opened(tmp_path)
    for unit in range(3):
        store.write(unit, arrays(unit))
    half = tmp_path / "units" / "000000.npz"
    half.write_bytes(half.read_bytes()[:-40])
    SweepStore(tmp_path, "another", 3).write(1, arrays(1))
    assert opened(tmp_path, resume=True).pending() == [0, 1]
    with pytest.raises(InputError, match=r"unit 0 of .* is not done"):
        store.collect()


def test_a_folder_that_holds_anything_needs_resume(tmp_path):
    opened(tmp_path / "sweep")
    with pytest.raises(InputError, match="holds a sweep; continue it there with --resume"):
        opened(tmp_path / "sweep")
    assert opened(tmp_path / "sweep", resume=True).pending() == [0, 1, 2]


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"texts": TEXTS | {"study.toml": "a = 2\n"}}, r"another sweep \(its study\.toml differs"),
        ({"texts": TEXTS | {"scene.toml": "b = 3\n"}}, r"another sweep \(its scene\.toml differs"),
        ({}, "another version"),
    ],
)
def test_another_plan_is_not_resumed(tmp_path, change, said):
    opened(tmp_path)
    with pytest.raises(InputError, match=said):
        opened(tmp_path, digest="e", resume=True, **change)


def test_a_folder_without_a_sweep_is_not_resumed(tmp_path):
    (tmp_path / "diary.txt").write_text("dear", encoding="utf-8")
    with pytest.raises(InputError, match=r"holds no sweep to continue: it has diary\.txt"):
        opened(tmp_path, resume=True)
    assert [path.name for path in tmp_path.iterdir()] == ["diary.txt"]


def test_a_start_that_was_killed_before_its_plan_was_whole_is_resumed(tmp_path):
    (tmp_path / "study.toml").write_text(TEXTS["study.toml"], encoding="utf-8")
    (tmp_path / "scene.toml.part").write_text("b =", encoding="utf-8")
    assert opened(tmp_path, resume=True).pending() == [0, 1, 2]
    assert (tmp_path / "scene.toml").read_text(encoding="utf-8") == TEXTS["scene.toml"]


def test_a_broken_plan_is_refused(tmp_path):
    opened(tmp_path)
    (tmp_path / PLAN_FILE).write_text("{", encoding="utf-8")
    with pytest.raises(InputError, match="no whole plan"):
        opened(tmp_path, resume=True)
