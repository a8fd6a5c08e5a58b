"""What a command line asks of a verb, and how that is carried out.

The scene that the words name is made, the folder is checked, the function is called; what it returns is written and
shown.
"""

from __future__ import annotations

import contextlib
import re
import shlex
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from importlib import import_module
from operator import attrgetter
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tarsus.base.errors import InputError
from tarsus.cli import console, interrupts, requests
from tarsus.cli.options import check_new_file
from tarsus.cli.verb import MADE, SCENES, Verb
from tarsus.cli.words import is_given, kind_of

if TYPE_CHECKING:
    from tarsus.files.output import OutputFolder
    from tarsus.model.scene import Scene

PROGRESS = ("Progress", "OnProgress")
"""Types of what is called with how far the work has come."""

Written = list[Path]


def _option(name: re.Match[str]) -> str:
    return f"--{name[1].replace('_', '-')}"


def loaded(home: str) -> Any:
    """What "package.module:name" names."""
    module, _, name = home.partition(":")
    return attrgetter(name)(import_module(module))


@dataclass
class Asked:
    """What a command line asks of a verb: ``words`` by option, as cyclopts read them."""

    command: Verb
    verb: str
    words: Mapping[str, Any]

    def flag(self, name: str) -> bool:
        """Whether a word without a value was said."""
        return self.words.get(name, False)

    @property
    def law(self) -> Sequence[Path]:
        """Files with laws of the user."""
        return self.words.get("law") or ()

    @property
    def scene_words(self) -> str:
        """What the line says of its scene, to be typed again after another verb."""
        named = [str(self.words[self.command.scene or ""])]
        changed = [word for one in self.words.get("set") or () for word in ("--set", str(one))]
        return shlex.join([*named, *changed, *(word for one in self.law for word in ("--law", str(one)))])

    def scene(self, name: str) -> Scene:
        """The device or scene file of a name, changed as the line says."""
        return requests.scene_for(name, requests.settings(self.words.get("set") or ()), self.law)

    def _named(self, name: str, kind: str) -> Any:
        """What a name stands for, changed: a scene; of "SceneLike | Sweep" also a study, of "Run | SceneLike" a run's
        folder."""
        values = self.words.get("set") or ()
        if kind == "Run | SceneLike" and Path(name).is_dir():
            if values:
                raise InputError("--set is for a device or scene: a folder's run is over")
            return Path(name)
        if kind == "SceneLike | Sweep" and requests.is_study(name):
            return requests.study_for(name, requests.settings(values), self.law)
        return self.scene(name)

    @cached_property
    def arguments(self) -> dict[str, Any]:
        """Arguments of the function, of what was said; all that is wrong with them at once."""
        found: dict[str, Any] = {}
        problems: list[str] = []
        for argument in self.command.taken.values():
            name = argument.name
            value: Any = self.words.get(name)
            if name in MADE or not is_given(value):
                continue
            try:
                if argument.type in SCENES:
                    found[name] = self._named(value, argument.type)
                elif (kind := kind_of(argument)) is not None:
                    found[name] = kind.value(value, f"--{name.replace('_', '-')}")
            except InputError as error:
                problems += error.problems
        if problems:
            raise InputError(problems)
        if "law" in self.command.taken:
            found["law"] = self.law
        if self.command.scene in found and "duration" in found:
            with self._saying_options():
                requests.refuse_too_long(found[self.command.scene], found["duration"])
        return found

    def folder(self) -> Path | None:
        """Where it is written."""
        output: Path | None = self.words.get("output")
        if output is None and self.command.folder:
            return Path(f"{Path(next(iter(self.words.values()))).stem}{self.command.folder}")
        return output

    def _target(self, folder: Path, resume: bool | None) -> OutputFolder:
        """The folder under the rule that all verbs share, checked: nothing of another's is in the way. ``resume``: of
        verbs that can continue."""
        from tarsus.files.output import OutputFolder

        if resume and self.flag("overwrite"):
            raise InputError("--resume continues what the folder holds and --overwrite begins again: give one of them")
        files, resumable = tuple(loaded(self.command.files)), resume is not None
        target = OutputFolder(folder, self.verb, files, self.flag("overwrite"), resumable=resumable)
        target.check(resume=bool(resume))
        return target

    @contextlib.contextmanager
    def writing(self, folder: Path | None, resume: bool | None = None) -> Iterator[None]:
        """The folder for the length of a block; nothing where none is written."""
        if folder is None or not self.command.files:
            yield
            return
        resume = self.words.get("resume") if resume is None else resume
        with self._target(folder, resume).writing(resume=bool(resume)):
            yield

    def check(self, folder: Path | None) -> None:
        """Refuse a folder or a file that is in the way, before any time is spent."""
        if folder is None and self.flag("resume"):
            raise InputError("--resume continues what a folder holds: name it with -o")
        if folder is not None and self.command.endings:
            check_new_file(folder, loaded(self.command.endings), self.flag("overwrite"))
        elif folder is not None:
            self._target(folder, self.words.get("resume"))

    @contextlib.contextmanager
    def calling(self, **more: Any) -> Iterator[Callable[..., Any]]:
        """The function with all that was said, and the bar and the workers for the length of a block."""
        command, given = self.command, {**self.arguments, **more}
        bar = command.taken.get("progress")
        with contextlib.ExitStack() as stack:
            if "on" in self.words:
                given["threads"] = stack.enter_context(requests.workers_for(self.words["on"], self.words["threads"]))
            elif self.words.get("threads") is not None:
                given["threads"] = self.words["threads"]
            if "resume" in self.words:
                if self.folder() is not None:
                    stack.enter_context(interrupts.resumable())
                given.setdefault("resume", self.flag("resume"))
            if bar is not None and bar.type in PROGRESS:
                title = command.title or "runs"
                given["progress"] = stack.enter_context(console.progress_bar(title, time_left="on" in self.words))
            elif command.title:
                stack.enter_context(console.spinner(command.title))
            many = next((one.name for one in command.taken.values() if one.many), None)
            words = given.pop(many, ()) if many else ()
            with self._saying_options():
                yield lambda: loaded(command.function)(*words, **given)

    @contextlib.contextmanager
    def _saying_options(self) -> Iterator[None]:
        """What is wrong in the block, in words of the line."""
        try:
            yield
        except InputError as error:
            raise InputError(map(self._spelled, error.problems)) from error

    def _spelled(self, problem: str) -> str:
        """A sentence with the options of the line for the function's arguments of several words."""
        several = [name for name in self.command.taken if "_" in name]
        said = re.sub(rf"\b({'|'.join(several)})\b( =)?" if several else "$^", _option, problem)
        own = "|".join(name for name in list(self.command.taken)[self.command.words :] if name in self.words)
        if own:
            said = re.sub(rf"^({own})(?=: )|(?<=\()({own})(?=\))", lambda name: f"--{name[0]}", said)
        return problem if said == problem else said  # with all that is known of it

    def carry_out(self, **more: Any) -> int:
        """Call the function, with more arguments than were written, write what it returns, and show it."""
        folder, taken = self.folder(), self.command.taken
        assert self.arguments is not None  # what is wrong with them is said before a folder is looked at
        self.check(folder)
        inside = "output" in taken  # the function itself writes there
        with contextlib.ExitStack() as stack:
            if inside:
                stack.enter_context(self.writing(folder))
                more["output"] = folder
            with self.calling(**more) as function:
                found = function()
            if not inside:
                stack.enter_context(self.writing(folder))
            written = [] if folder is None else self._written(found, folder)
        return self.show(found, written)

    def _written(self, found: Any, folder: Path) -> Written:
        """Files of a result and its page; the folder alone where the function wrote them, or the result does."""
        command = self.command
        files = loaded(command.write)(found, folder) if command.write else ()
        if not command.write and "output" not in command.taken:
            found.write(folder)
        pages = self.paged(found, folder)
        return [*files, *pages] if command.write and "output" not in command.taken else [folder]

    def paged(self, found: Any, folder: Path | None) -> Written:
        """The page of a result, where one is wanted: its text or, of several, what writes them."""
        if not self.command.page or not self.flag("report") or folder is None:
            return []
        from tarsus.report.pages import write_page

        page = loaded(self.command.page)
        if page.__name__.startswith("write_"):
            return list(page(found, folder))
        return [write_page(page(found), folder / "report.html")]

    def show(self, found: Any, written: Written) -> int:
        """The result on the console; 1 where it says of itself that it is not good."""
        if isinstance(found, Path) or not hasattr(found, "to_dict"):
            (file,) = written
            about = {"file": str(file), "bytes": file.stat().st_size}
            return console.files(written, about if self.flag("json") else None)
        console.show(found, self.flag("json"), written)
        problems = list(getattr(found, "problems", ()))
        console.complain(problems)
        return 0 if getattr(found, "ok", not problems) else 1
