"""Folders that verbs write, and the store of a sweep: what is whole counts, everything else does not."""

from __future__ import annotations

import errno
import os
import shutil
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tarsus.base.errors import InputError
from tarsus.files import runstore
from tarsus.files.output import MANIFEST, OutputFolder
from tarsus.files.runstore import PLAN_FILE, RunStore
from tarsus.files.version import versions

TEXTS = {"study.toml": "a = 1\n", "scene.toml": "b = 2\n"}


def opened(folder, texts: dict[str, str] = TEXTS, **options) -> RunStore:
    return RunStore.open(folder, texts, **({"runs": 3, "chunk": 1} | options))


def arrays(unit: int) -> dict[str, np.ndarray]:
    return {"code": np.full(2, unit, np.int8), "value": np.array([[1.0 / (unit + 3)], [np.nan]])}


def collected(store: RunStore) -> dict[str, np.ndarray]:
    parts = list(store.parts())
    return {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}


def test_what_is_done_is_listed_and_nothing_is_opened(tmp_path, monkeypatch):
    store = opened(tmp_path)
    store.write(1, arrays(1))
    monkeypatch.setattr(np, "load", lambda *_, **__: pytest.fail("a unit was opened"))
    assert store.pending() == [0, 2] and store.has(1) and not store.has(0)


def test_half_a_file_another_plans_and_another_units_are_put_aside(tmp_path):
    store = opened(tmp_path)
    for unit in range(3):
        store.write(unit, arrays(unit))
    half, other, copied = (tmp_path / "units" / "000" / f"00000{n}.npz" for n in range(3))
    copied.write_bytes(half.read_bytes())
    half.write_bytes(half.read_bytes()[:-40])
    RunStore(tmp_path, "another", 3, 1).write(1, arrays(1))
    with pytest.raises(InputError, match=r"unit 0 of .* is not done"):
        collected(store)
    assert store.check() == [1, 2]
    again = opened(tmp_path, resume=True)
    assert again.pending() == [0, 1, 2] and not other.exists()
    assert sorted(path.suffix for path in half.parent.iterdir()) == [".damaged"] * 3


WRITER = """
import sys
import numpy as np
from tarsus.files.runstore import RunStore
from pathlib import Path
store = RunStore.open(Path(sys.argv[1]), {"study.toml": "a = 1\\n"}, runs=20, chunk=1, resume=True)
for again in range(4):
    for unit in range(20):
        store.write(unit, {"code": np.full(200, unit, np.int8)})
        assert (store.read(unit)["code"] == unit).all()
points = np.random.default_rng(0).random((40, 3))
for again in range(6):
    points = store.evaluate(points, lambda at: {"y": np.sin(at)}, chunk=3)["y"][::-1] + 0.5
print(points.tobytes().hex())
"""


def test_writers_of_the_same_units_and_searches_do_not_meet(tmp_path):
    words = [sys.executable, "-c", WRITER, str(tmp_path / "store")]
    writers = [subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) for _ in range(2)]
    said = [one.communicate() for one in writers]
    points = np.random.default_rng(0).random((40, 3))
    for _ in range(6):
        points = np.sin(points)[::-1] + 0.5
    assert said == [(points.tobytes().hex() + "\n", "")] * 2
    store = RunStore.open(tmp_path / "store", {"study.toml": "a = 1\n"}, runs=20, chunk=1, resume=True)
    assert collected(store)["code"].tolist() == np.repeat(np.arange(20), 200).tolist()
    assert list((tmp_path / "store").rglob("*.part")) == []


def test_the_first_of_many_writes_the_plan_and_the_others_take_its_units(tmp_path):
    first = opened(tmp_path, runs=20, chunk=7)
    late = opened(tmp_path, runs=20, chunk=1, resume=True)
    assert (late.units, late.chunk) == (3, 7) == (first.units, first.chunk)
    assert [late.part(unit).stop for unit in range(3)] == [7, 14, 20] and late.size(2) == 6


def test_another_version_is_refused_with_both_nodes(tmp_path, monkeypatch):
    opened(tmp_path)
    here = versions()["engine"]
    monkeypatch.setattr(runstore, "versions", lambda: versions() | {"engine": "bb"})
    said = rf"begun on \S+ with engine {here}, and \S+ has engine bb\); all nodes need the same version"
    with pytest.raises(InputError, match=said):
        opened(tmp_path, resume=True)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ('"format": 2', '"format": 1', r"written by an earlier version of tarsus .* continue with that"),
        ('"units": 3', '"units": -3', "holds no whole plan of a sweep: -3 units"),
        ("}", "", "no whole plan"),
    ],
    ids=["an earlier layout", "impossible numbers", "broken"],
)
def test_a_plan_that_is_none_is_refused(tmp_path, old, new, said):
    opened(tmp_path)
    plan = tmp_path / PLAN_FILE
    plan.write_text(plan.read_text(encoding="utf-8").replace(old, new), encoding="utf-8")
    with pytest.raises(InputError, match=said):
        opened(tmp_path, resume=True)


@pytest.mark.parametrize(
    ("number", "said"),
    [
        (errno.ENOSPC, "the disk that holds .* is full: make room; finished parts are kept"),
        (errno.EROFS, "cannot be written .* finished parts are kept"),
        (errno.ESTALE, "is gone, removed or with its disk"),
        (errno.EIO, "cannot be used .*finished parts are kept"),
    ],
)
def test_what_a_disk_refuses_is_reported_in_a_sentence(tmp_path, monkeypatch, number, said):
    store = opened(tmp_path)
    store.write(0, arrays(0))

    def refused(_):
        raise OSError(number, os.strerror(number))

    monkeypatch.setattr(os, "fsync", refused)
    with pytest.raises(InputError, match=said):
        store.write(1, arrays(1))
    monkeypatch.undo()
    assert store.pending() == [1, 2] and list(tmp_path.rglob("*.part")) == []


def test_a_folder_that_vanished_is_not_made_again(tmp_path):
    store = opened(tmp_path / "sweep")
    store.write(0, arrays(0))
    shutil.rmtree(tmp_path / "sweep")
    with pytest.raises(InputError, match="is gone"):
        store.write(1, arrays(1))
    assert not (tmp_path / "sweep").exists()


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"texts": TEXTS | {"study.toml": "a = 2\n"}}, r"another sweep \(its study\.toml differs"),
        ({"texts": TEXTS | {"scene.toml": "b = 3\n"}}, r"another sweep \(its scene\.toml differs"),
        ({"values": [np.ones(3)]}, "another version"),
    ],
)
def test_another_plan_is_not_resumed(tmp_path, change, said):
    opened(tmp_path)
    with pytest.raises(InputError, match=said):
        opened(tmp_path, resume=True, **change)


def test_a_folder_without_a_sweep_is_not_resumed(tmp_path):
    (tmp_path / "diary.txt").write_text("dear", encoding="utf-8")
    with pytest.raises(InputError, match=r"holds no sweep to continue: it has diary\.txt"):
        opened(tmp_path, resume=True)
    assert [path.name for path in tmp_path.iterdir()] == ["diary.txt"]


def test_a_start_that_was_killed_before_its_plan_was_whole_is_resumed(tmp_path):
    (tmp_path / "study.toml").write_text(TEXTS["study.toml"], encoding="utf-8")
    (tmp_path / "scene.toml.node-1-2.part").write_text("b =", encoding="utf-8")
    assert opened(tmp_path, resume=True).pending() == [0, 1, 2]
    assert (tmp_path / "scene.toml").read_text(encoding="utf-8") == TEXTS["scene.toml"]


def test_no_byte_of_a_unit_can_be_damaged_unseen(tmp_path):
    store = replace(opened(tmp_path), digest="d")  # short: every byte is a reading
    right = {"code": arrays(1)["code"]}
    store.write(0, right)
    file = next(tmp_path.glob("units/*/*.npz"))
    whole = file.read_bytes()
    for place in range(len(whole)):
        file.write_bytes(whole[:place] + bytes([whole[place] ^ 0x21]) + whole[place + 1 :])
        found = store.read(0)  # zipfile and numpy have a dozen errors for this
        assert found is None or all(np.array_equal(found[name], right[name], equal_nan=True) for name in found)


def test_a_unit_that_cannot_be_read_just_now_is_not_put_aside(tmp_path, monkeypatch):
    store = opened(tmp_path)
    for unit in range(3):
        store.write(unit, arrays(unit))

    def refused(_):
        raise OSError(errno.EMFILE, os.strerror(errno.EMFILE))

    monkeypatch.setattr(Path, "read_bytes", refused)
    for use in (store.check, lambda: collected(store)):
        with pytest.raises(InputError, match=r"cannot be used .too many open files.; finished parts are kept"):
            use()
    monkeypatch.undo()
    assert store.pending() == [] and len(collected(store)["code"]) == 6


def test_what_a_process_of_the_same_name_left_is_no_obstacle(tmp_path):
    """In containers node and process number are the same after every restart."""
    code = """
import os, sys
from pathlib import Path
import numpy as np
from tarsus.files.runstore import RunStore
os.getpid = lambda: 7
if sys.argv[2] == "die":
    os.replace = lambda *_: os._exit(9)
RunStore(Path(sys.argv[1]), sys.argv[3], 3, 1).write(1, {"code": np.zeros(2, np.int8)})
"""
    store = opened(tmp_path)
    store.write(0, arrays(0))
    words = [sys.executable, "-c", code, str(tmp_path)]
    assert subprocess.run([*words, "die", store.digest]).returncode == 9 and len(list(tmp_path.rglob("*.part"))) == 1
    again = subprocess.run([*words, "live", store.digest], capture_output=True, text=True)
    assert again.returncode == 0, again.stderr
    assert store.pending() == [2]


def waves(points):
    return {"sum": points.sum(axis=1), "both": np.stack([np.sin(points), points**2], axis=1)}


POINTS = np.random.default_rng(4).random((7, 2))


class Asked(Exception):
    """Raised where a function is asked that was to be remembered."""


def refused(points):
    raise Asked(points)


def search(store: RunStore, function=waves, stop: int = 3) -> list[dict[str, np.ndarray]]:
    """Questions of which every one depends on the answer before it, and repeats some points."""
    found, points = [], POINTS
    for _ in range(stop):
        found.append(store.evaluate(points, function, name="search"))
        points = np.vstack([found[-1]["both"][::2, 0], points[1:3]])
    return found


def same(one, other) -> bool:
    return all(
        a.keys() == b.keys() and all(np.array_equal(a[k], b[k]) for k in a) for a, b in zip(one, other, strict=True)
    )


def test_points_are_computed_once_in_memory_too():
    store, asked = RunStore(), []

    def counted(points):
        asked.append(len(points))
        return waves(points)

    twice = store.evaluate(np.vstack([POINTS, POINTS[:2]]), counted)
    assert asked == [7] and np.array_equal(twice["sum"], np.concatenate([POINTS, POINTS[:2]]).sum(axis=1))
    later = store.evaluate(np.vstack([POINTS[5], [-0.0, 2.0], [0.0, 2.0]]), counted)
    assert asked == [7, 1] and later["both"].shape == (3, 2, 2)
    memo = store.memo()
    assert (len(memo), memo.computed, memo.reused) == (8, 8, 0)
    assert np.array_equal(memo.points[memo.places(POINTS[3:5])], POINTS[3:5])
    with pytest.raises(Asked):
        store.evaluate(POINTS, refused, name="another function")


def test_a_search_that_is_asked_again_computes_nothing_and_finds_the_same(tmp_path):
    whole = search(RunStore())
    first = RunStore.open(tmp_path, TEXTS)
    assert same(search(first), whole)
    files = {path: path.read_bytes() for path in tmp_path.glob("units/*/*.npz")}
    again = RunStore.open(tmp_path, TEXTS, resume=True)
    assert same(search(again, refused), whole)
    assert again.memo("search").computed == 0 and again.memo("search").reused == first.memo("search").computed
    assert len(files) == 3 and all(path.match(pattern) for path in files for pattern in runstore.UNIT_FILES[3:4])
    damaged, gone, _ = sorted(files)
    damaged.write_bytes(files[damaged][:-40])
    gone.unlink()
    assert same(search(RunStore.open(tmp_path, TEXTS, resume=True)), whole)
    assert {path: path.read_bytes() for path in tmp_path.glob("units/*/*.npz")} == files


@pytest.mark.parametrize("part", ["write", "before", "moved"])
@pytest.mark.parametrize("number", [0, 1, 2])
def test_a_search_killed_at_any_place_ends_with_the_same_bytes(tmp_path, monkeypatch, part, number):
    whole = search(RunStore.open(tmp_path / "whole", TEXTS))
    store, moved, replace, fill = RunStore.open(tmp_path / "part", TEXTS), [], os.replace, os.fsync

    def dies_on_move(source, target):
        moved.append(target)
        if part == "moved":
            replace(source, target)
        if len(moved) > number:
            raise KeyboardInterrupt
        replace(source, target) if part != "moved" else None

    def dies_on_write(handle):
        moved.append(handle)
        if len(moved) > number:
            raise KeyboardInterrupt
        fill(handle)

    monkeypatch.setattr(os, *(("fsync", dies_on_write) if part == "write" else ("replace", dies_on_move)))
    with pytest.raises(KeyboardInterrupt):
        search(store)
    monkeypatch.undo()
    assert same(search(RunStore.open(tmp_path / "part", TEXTS, resume=True)), whole)
    kept = [
        {path.relative_to(top): path.read_bytes() for path in top.glob("units/*/*.npz")}
        for top in (tmp_path / "whole", tmp_path / "part")
    ]
    assert kept[0] == kept[1] and list(tmp_path.rglob("*.part")) == []


def test_batches_of_a_question_are_kept_each_and_shared_between_threads(tmp_path):
    progress: list[tuple[int, int]] = []

    def fails(points):
        if points[0, 0] == POINTS[5, 0]:
            raise InputError("no")
        return waves(points)

    store = RunStore.open(tmp_path, TEXTS)
    with pytest.raises(InputError, match="no"):
        store.evaluate(POINTS, fails, chunk=1, threads=3)
    again = RunStore.open(tmp_path, TEXTS, resume=True)
    found = again.evaluate(POINTS, waves, chunk=1, threads=3, progress=lambda *both: progress.append(both))
    assert np.array_equal(found["sum"], POINTS.sum(axis=1)) and again.memo().reused >= 5
    assert progress == [(i, 7) for i in range(1, 8)]


FILES = ("a.txt", "units/[0-9].npz")


def output(folder, verb: str = "work", **options) -> OutputFolder:
    return OutputFolder(folder, verb, FILES, **options)


def write(target: OutputFolder, *names: str, text: str = "ours", **options) -> None:
    with target.writing(**options) as folder:
        for name in names:
            (folder / name).parent.mkdir(exist_ok=True)
            (folder / name).write_text(text, encoding="utf-8")


def names(folder) -> set[str]:
    return {p.relative_to(folder).as_posix() for p in folder.rglob("*") if p.is_file() and p.name != MANIFEST}


def test_overwriting_replaces_what_the_verb_wrote_and_nothing_else(tmp_path):
    write(output(tmp_path), "a.txt", "units/1.npz")
    for name in ("notes.md", "units/mine.txt"):
        (tmp_path / name).write_text("mine", encoding="utf-8")
    write(output(tmp_path, overwrite=True), "units/2.npz")
    assert names(tmp_path) == {"notes.md", "units/mine.txt", "units/2.npz"}
    write(output(tmp_path, overwrite=True), "a.txt")
    assert names(tmp_path) == {"notes.md", "units/mine.txt", "a.txt"}


@pytest.mark.parametrize("by", ["nobody", "another verb", "added later"])
def test_what_the_verb_did_not_write_is_not_replaced(tmp_path, by):
    if by == "another verb":
        write(output(tmp_path, "other"), "a.txt", text="theirs")
    else:
        if by == "added later":
            write(output(tmp_path), "units/1.npz")
        (tmp_path / "a.txt").write_text("theirs", encoding="utf-8")
    before = names(tmp_path)
    with pytest.raises(InputError, match=r"holds a\.txt, and `tarsus work` did not"):
        output(tmp_path, overwrite=True).check()
    with pytest.raises(InputError, match=r"holds a\.txt"), output(tmp_path, overwrite=True).writing():
        raise AssertionError("it was written")
    assert names(tmp_path) == before and (tmp_path / "a.txt").read_text(encoding="utf-8") == "theirs"


def test_what_an_interrupted_writing_left_is_the_verbs_own(tmp_path):
    with pytest.raises(KeyboardInterrupt), output(tmp_path).writing() as folder:
        (folder / "a.txt").write_text("half", encoding="utf-8")
        (folder / "units").mkdir()  # before there is anything in it
        raise KeyboardInterrupt
    with output(tmp_path, overwrite=True).writing() as folder:
        assert not (folder / "units").exists()
    write(output(tmp_path, overwrite=True), "units/1.npz")
    assert names(tmp_path) == {"units/1.npz"}


def test_what_is_continued_is_not_cleared(tmp_path):
    write(output(tmp_path, resumable=True), "units/1.npz")
    write(output(tmp_path, resumable=True), "units/2.npz", resume=True)
    assert names(tmp_path) == {"units/1.npz", "units/2.npz"}
    write(output(tmp_path, resumable=True, overwrite=True), "units/3.npz")
    assert names(tmp_path) == {"units/3.npz"}


@pytest.mark.parametrize("text", ["", "[1]", '{"work": 3}', "\xff"])
def test_a_manifest_that_is_none_owns_nothing_by_name(tmp_path, text):
    (tmp_path / "a.txt").write_text("mine", encoding="utf-8")
    (tmp_path / MANIFEST).write_bytes(text.encode("latin-1"))
    if "work" not in text:
        with pytest.raises(InputError, match=r"holds a\.txt"):
            output(tmp_path, overwrite=True).check()
    with pytest.raises(InputError, match="is not empty"):
        output(tmp_path).check()


def test_files_in_the_way_are_named(tmp_path):
    (tmp_path / "file").write_text("", encoding="utf-8")
    for folder in (tmp_path / "file", tmp_path / "file" / "below"):
        with pytest.raises(InputError, match="is a file, a folder is needed"):
            output(folder).check()


def test_a_function_gives_as_many_values_as_points():
    with pytest.raises(ValueError, match="7 points"):
        RunStore().evaluate(POINTS, lambda points: {"sum": points.sum(axis=1)[1:]})
