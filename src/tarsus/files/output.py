"""The folder that a verb writes: one rule for all of them.

A folder that exists and is not empty is refused. With ``overwrite`` the files that the same verb wrote there before
are replaced, and no other: a folder remembers in `MANIFEST` which verb wrote which of its files, and a file that the
verb would replace without having written it is a reason to refuse.
"""

from __future__ import annotations

import contextlib
import json
import os
import shutil
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from tarsus.base.errors import InputError
from tarsus.files.jsontext import read_json
from tarsus.files.whole import write_text

MANIFEST = ".tarsus.json"
"""Next to the files of a folder: which verb wrote which of them."""

_NAMED = 3
"""Files named at most in a refusal: enough to recognise a folder."""


@dataclass(frozen=True)
class OutputFolder:
    """A folder, the verb that will write into it, and what that may write.

    folder: where; verb: as typed after `tarsus`; files: names or glob patterns, relative to the folder, of everything
    that the verb writes, such as ``("sweep.nc", "units/*.npz")``; overwrite: whether what it wrote there before goes;
    resumable: whether the verb has a `--resume`.
    """

    folder: Path
    verb: str
    files: tuple[str, ...]
    overwrite: bool = False
    resumable: bool = False

    def check(self, *, resume: bool = False) -> None:
        """Refuse a folder that must not or cannot be written; called before any time is spent, changes nothing.

        Parameters
        ----------
        resume
            Whether the verb continues what it finds there, and judges that by itself.

        Raises
        ------
        InputError
            When the folder is a file, lies below a file or is not writable; when it holds anything and is not to be
            overwritten; when it holds files that the verb would replace but did not write.
        """
        check_writable(self.folder)
        present = self._present()
        if not present or (resume and not self.overwrite):
            return
        if not self.overwrite:
            go_on = "continue there with --resume, " if self.resumable else ""
            raise InputError(
                f"'{self.folder}' is not empty; {go_on}give another folder with -o, or --overwrite to replace what "
                f"`tarsus {self.verb}` wrote there before"
            )
        foreign = sorted(self._claimed() - self._own())
        if foreign:
            more = f" and {len(foreign) - _NAMED} more" if len(foreign) > _NAMED else ""
            raise InputError(
                f"'{self.folder}' holds {', '.join(foreign[:_NAMED])}{more}, and `tarsus {self.verb}` did not write "
                "that there: --overwrite replaces only what it wrote before; give another folder with -o"
            )

    @contextlib.contextmanager
    def writing(self, *, resume: bool = False) -> Iterator[Path]:
        """The folder, made or cleared of what the verb wrote there before, for the length of the writing.

        At the end, however it comes, the manifest lists what the verb has written; should the process be killed, all
        files of its names are taken for its own. With `resume` nothing is cleared. Input that is found wrong before
        anything is written leaves all as it was.

        Raises
        ------
        InputError
            As `check`, which is repeated: the folder may have changed since.
        """
        self.check(resume=resume)
        if resume and not self.overwrite and self._present():
            yield self.folder
            self._remember(sorted(self._claimed()))
            return
        made = [one for one in (self.folder, *self.folder.parents) if not one.exists()]
        known = self._manifest()
        with self._set_aside() as aside:
            self.folder.mkdir(parents=True, exist_ok=True)
            self._remember(None)
            try:
                yield self.folder
            except BaseException as error:
                with contextlib.suppress(InputError):  # a disk that is full: what went wrong is said already
                    if isinstance(error, InputError) and not self._claimed():
                        self._restore(aside, known, made)
                    else:
                        self._remember(sorted(self._claimed()))
                raise
        self._remember(sorted(self._claimed()))

    def _present(self) -> list[str]:
        """Names in the folder but that of the manifest."""
        if not self.folder.is_dir():
            return []
        return sorted(path.name for path in self.folder.iterdir() if path.name != MANIFEST)

    def _claimed(self) -> set[str]:
        """Files in the folder that have names of this verb."""
        if not self.folder.is_dir():
            return set()
        found = {path for pattern in self.files for path in self.folder.glob(pattern)}
        return {path.relative_to(self.folder).as_posix() for path in found}

    def _own(self) -> set[str]:
        """Files in the folder that this verb wrote."""
        if self.verb not in (known := self._manifest()):
            return set()
        listed = known[self.verb]
        return self._claimed() if listed is None else self._claimed() & set(listed)

    @contextlib.contextmanager
    def _set_aside(self) -> Iterator[Path | None]:
        """What the verb wrote before lies elsewhere for the length of a block, and is removed then; folders of the verb
        that are empty, of a verb that was killed too, are gone. None where there is nothing."""
        own = self._own() if self.overwrite else set()
        if not own:
            yield None
            return
        with tempfile.TemporaryDirectory(prefix=".tarsus-", dir=self.folder.parent) as place:
            for name in own:
                (Path(place) / name).parent.mkdir(parents=True, exist_ok=True)
                shutil.move(self.folder / name, Path(place) / name)
            parents = {str(parent) for name in (*own, *self.files) for parent in Path(name).parents} - {"."}
            emptied = {found for parent in parents for found in self.folder.glob(parent)}
            for found in sorted(emptied, key=lambda one: -len(one.parts)):
                with contextlib.suppress(OSError):
                    found.rmdir()
            yield Path(place)

    def _restore(self, aside: Path | None, known: Mapping[str, list[str] | None], made: Sequence[Path]) -> None:
        """The folder as it was: files that were set aside, what the manifest said, and no folder that was made."""
        if known:
            write_text(self.folder / MANIFEST, _manifest_text(known))
        else:
            (self.folder / MANIFEST).unlink(missing_ok=True)
        if aside is not None:
            shutil.copytree(aside, self.folder, symlinks=True, dirs_exist_ok=True)
        for one in made:
            with contextlib.suppress(OSError):
                one.rmdir()

    def _manifest(self) -> dict[str, list[str] | None]:
        """What each verb wrote; None for one that did not come to its end."""
        try:
            read = read_json(self.folder / MANIFEST)
        except InputError:
            return {}
        return {
            verb: [str(name) for name in files] if isinstance(files, list) else None for verb, files in read.items()
        }

    def _remember(self, files: list[str] | None) -> None:
        known = self._manifest() | {self.verb: files}
        write_text(self.folder / MANIFEST, _manifest_text(known))


def _manifest_text(known: Mapping[str, list[str] | None]) -> str:
    return json.dumps(known, indent=1, sort_keys=True) + "\n"


def check_writable(folder: Path) -> None:
    """`InputError` where a folder could be neither made nor written into."""
    nearest = folder
    while not nearest.exists() and nearest != nearest.parent:
        nearest = nearest.parent
    if not nearest.is_dir():
        raise InputError(f"cannot write into '{folder}': '{nearest}' is a file, a folder is needed")
    if not os.access(nearest, os.W_OK | os.X_OK):
        raise InputError(f"cannot write into '{folder}': '{nearest}' is not writable")
