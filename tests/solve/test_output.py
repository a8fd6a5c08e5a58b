"""The folder that a verb writes: what is refused, what is replaced, and what is never touched."""

from __future__ import annotations

import pytest

from tarsus.base.errors import InputError
from tarsus.files.output import MANIFEST, OutputFolder

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


def test_new_and_empty_folders_are_written(tmp_path):
    write(output(tmp_path), "a.txt")
    write(output(tmp_path / "new" / "below"), "a.txt")
    assert names(tmp_path) == {"a.txt", "new/below/a.txt"}


def test_a_folder_that_holds_anything_is_refused(tmp_path):
    (tmp_path / "notes.md").write_text("mine", encoding="utf-8")
    with pytest.raises(InputError, match=r"is not empty; .*--overwrite"):
        output(tmp_path).check()
    with pytest.raises(InputError, match="--resume"):
        output(tmp_path, resumable=True).check()
    output(tmp_path, resumable=True).check(resume=True)
    assert names(tmp_path) == {"notes.md"} and not (tmp_path / MANIFEST).exists()


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


def test_two_verbs_share_a_folder_if_their_files_differ(tmp_path):
    write(output(tmp_path), "a.txt")
    other = OutputFolder(tmp_path, "other", ("b.txt",), overwrite=True)
    write(other, "b.txt")
    write(output(tmp_path, overwrite=True), "a.txt")
    assert names(tmp_path) == {"a.txt", "b.txt"}


def test_what_an_interrupted_writing_left_is_the_verbs_own(tmp_path):
    with pytest.raises(KeyboardInterrupt), output(tmp_path).writing() as folder:
        (folder / "a.txt").write_text("half", encoding="utf-8")
        raise KeyboardInterrupt
    write(output(tmp_path, overwrite=True), "units/1.npz")
    assert names(tmp_path) == {"units/1.npz"}


def test_what_a_killed_writing_left_is_the_verbs_own(tmp_path):
    target = output(tmp_path)
    writing = target.writing()
    (writing.__enter__() / "a.txt").write_text("half", encoding="utf-8")  # and it never ends
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
