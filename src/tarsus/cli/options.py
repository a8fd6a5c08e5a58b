"""Options that mean the same in every verb, each declared once, in groups that a verb takes whole."""

from __future__ import annotations

from contextlib import AbstractContextManager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from tarsus.base.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from cyclopts import Token

    from tarsus.base.workers import Workers
    from tarsus.files.output import OutputFolder
    from tarsus.model.scene import Scene

FLAG = Parameter(negative=(), show_default=False)
"""A word that is given or not: there is no --no- form."""


def _whole(_: object, tokens: Sequence[Token]) -> int:
    """A whole number; cyclopts itself rounds 2.5."""
    try:
        return int(tokens[0].value)
    except ValueError:
        raise ValueError(f"expected a whole number, got '{tokens[0].value}'") from None


def at_least(least: int) -> Parameter:
    """Of a whole number: smaller ones are refused."""

    def check(_: object, value: int | None) -> None:
        if value is not None and value < least:
            raise ValueError(f"expected a number of {least} or more, got {value}")

    return Parameter(validator=check, converter=_whole)


WHOLE = Annotated[int, Parameter(converter=_whole)]
"""A whole number; whether it is a good one is the function's to say."""

MaybeCount = Annotated[int | None, at_least(1)]
LawFiles = Annotated[
    list[Path] | None, Parameter(negative=(), help="a Python file with laws of your own; may be repeated.")
]
Json = Annotated[bool, FLAG, Parameter(help="print one JSON object instead.")]
Folder = Annotated[Path, Parameter(name=["--output", "-o"])]
MaybeFolder = Annotated[Path | None, Parameter(name=["--output", "-o"])]
Overwrite = Annotated[
    bool, FLAG, Parameter(help="replace what this verb wrote into the folder before; other files stay.")
]
Resume = Annotated[bool, FLAG, Parameter(help="continue what the folder holds; what is finished is not done again.")]
Report = Annotated[bool, Parameter(help="write report.html.")]
_SEED = Parameter(help="of everything that is drawn at random; without it the verb's or the study's own.")
Seed = Annotated[int, at_least(0), _SEED]
MaybeSeed = Annotated[int | None, at_least(0), _SEED]
Many = Annotated[list[str] | None, Parameter(negative=())]
Threads = Annotated[
    int | None,
    at_least(1),
    Parameter(
        help="worker threads; by default one for each processor that this process may use. The result does not "
        "depend on them."
    ),
]
Grounds = Annotated[list[str] | None, Parameter(name="--over", negative=())]


@Parameter(name="*")
@dataclass(frozen=True, kw_only=True)
class Changes:
    """What is changed of a scene that is named."""

    set_: Annotated[
        list[str] | None,
        Parameter(
            name="--set",
            negative=(),
            help='path=value, e.g. robot.feet.tip.gap="60 um", or volts=6, hz=50, wave=sine; may be repeated.',
        ),
    ] = None
    law: LawFiles = None

    def scene(self, name: str) -> Scene:
        """The device or scene file of that name, changed."""
        from tarsus.cli import requests

        return requests.scene_for(name, requests.settings(self.set_ or ()), self.law or ())

    def named(self, name: str, kind: str) -> Any:
        """What a name stands for, changed: a scene; of "SceneLike | Sweep" also a study, of "Run | SceneLike" a run's
        folder."""
        from tarsus.cli import requests

        if kind == "Run | SceneLike" and Path(name).is_dir():
            if self.set_:
                raise InputError("--set is for a device or scene: a folder's run is over")
            return Path(name)
        if kind == "SceneLike | Sweep" and requests.is_study(name):
            return requests.study_for(name, requests.settings(self.set_ or ()), self.law or ())
        return self.scene(name)


UNCHANGED = Changes()


@Parameter(name="*")
@dataclass(frozen=True, kw_only=True)
class Work:
    """Who makes the runs."""

    threads: Threads = None
    on: Annotated[
        str | None,
        Parameter(
            help="where the runs are made, on a Dask cluster: address of its scheduler (tcp://host:8786), a scheduler "
            "file, or local for processes here."
        ),
    ] = None

    def workers(self) -> AbstractContextManager[Workers]:
        """The threads, or the workers of the cluster, for the length of a block."""
        from tarsus.cli import requests

        return requests.workers_for(self.on, self.threads)


HERE = Work()


@Parameter(name="*")
@dataclass(frozen=True, kw_only=True)
class Pages:
    """What a verb that writes a folder does beside it."""

    overwrite: Overwrite = False
    report: Report = True
    json: Json = False

    def target(self, folder: Path, verb: str, files: Sequence[str], *, resume: bool | None = None) -> OutputFolder:
        """The folder, which was checked: nothing of another's is in the way. ``resume`` of verbs that can continue."""
        from tarsus.files.output import OutputFolder

        if resume and self.overwrite:
            raise InputError("--resume continues what the folder holds and --overwrite begins again: give one of them")
        target = OutputFolder(folder, verb, tuple(files), self.overwrite, resumable=resume is not None)
        target.check(resume=bool(resume))
        return target


PAGES = Pages()


def check_new_file(file: Path, endings: Sequence[str], overwrite: bool) -> None:
    """`InputError` where a file cannot be written: another ending, a folder, or one that is not to be replaced."""
    from tarsus.files.output import check_writable

    problems = []
    if file.suffix.lower() not in endings:
        problems.append(f"'{file}': expected a name ending in {', '.join(endings)}")
    if file.is_dir():
        problems.append(f"'{file}' is a folder: give the name of a file with -o")
    elif file.exists() and not overwrite:
        problems.append(f"'{file}' is there already; give another name with -o, or --overwrite to replace it")
    if problems:
        raise InputError(problems)
    check_writable(file.parent)
