"""Options that mean the same in every verb, each declared once, in groups that a verb takes whole."""

from __future__ import annotations

from contextlib import AbstractContextManager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

if TYPE_CHECKING:
    from collections.abc import Sequence

    from tarsus.base.workers import Workers
    from tarsus.files.output import OutputFolder
    from tarsus.model.laws import Law
    from tarsus.model.scene import Scene

FLAG = Parameter(negative=(), show_default=False)
"""A word that is given or not: there is no --no- form."""

LawFiles = Annotated[
    list[Path] | None, Parameter(negative=(), help="a Python file with laws of your own; may be repeated.")
]
Json = Annotated[bool, FLAG, Parameter(help="print one JSON object instead.")]
Folder = Annotated[Path, Parameter(name=["--output", "-o"])]
MaybeFolder = Annotated[Path | None, Parameter(name=["--output", "-o"])]
Overwrite = Annotated[
    bool, FLAG, Parameter(help="replace what this verb wrote into the folder before; other files stay.")
]
Resume = Annotated[
    bool, FLAG, Parameter(help="continue what the folder holds; what is finished is not done again.")
]
Report = Annotated[bool, Parameter(help="write report.html.")]
Seed = Annotated[int, Parameter(help="of everything that is drawn at random.")]
Duration = Annotated[
    str | None,
    Parameter(allow_leading_hyphen=True, help='how long, e.g. "200 ms"; the scene\'s own when left out.'),
]
Many = Annotated[list[str] | None, Parameter(negative=())]


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

    def laws(self) -> dict[str, type[Law]]:
        """The laws of the files given."""
        from tarsus.cli import requests

        return requests.laws_of(self.law or ())


UNCHANGED = Changes()


@Parameter(name="*")
@dataclass(frozen=True, kw_only=True)
class Work:
    """Who makes the runs."""

    threads: Annotated[
        int | None,
        Parameter(
            help="worker threads; by default one for each processor that this process may use. The result does not "
            "depend on them."
        ),
    ] = None
    dask: Annotated[
        str | None,
        Parameter(
            help="make the runs on the workers of a Dask cluster: address of its scheduler, its scheduler file, or "
            "`local` for processes here."
        ),
    ] = None

    def workers(self) -> AbstractContextManager[Workers]:
        """The threads, or the workers of the cluster, for the length of a block."""
        from tarsus.cli import requests

        return requests.workers_for(self.dask, self.threads)


HERE = Work()


@Parameter(name="*")
@dataclass(frozen=True, kw_only=True)
class Pages:
    """What a verb that writes a folder does beside it."""

    overwrite: Overwrite = False
    report: Report = True
    json: Json = False

    def target(
        self, folder: Path, verb: str, files: Sequence[str], *, resume: bool | None = None
    ) -> OutputFolder:
        """The folder, which was checked: nothing of another's is in the way. ``resume`` of verbs that can continue."""
        from tarsus.base.errors import InputError
        from tarsus.files.output import OutputFolder

        if resume and self.overwrite:
            raise InputError(
                "--resume continues what the folder holds and --overwrite begins again: give one"
            )
        target = OutputFolder(folder, verb, tuple(files), self.overwrite, resumable=resume is not None)
        target.check(resume=bool(resume))
        return target


PAGES = Pages()


def new_file(file: Path, overwrite: bool) -> Path:
    """A file to write; `InputError` where one is there that is not to be replaced."""
    from tarsus.base.errors import InputError

    if file.exists() and not overwrite:
        raise InputError(
            f"'{file}' is there already; give another name with -o, or --overwrite to replace it"
        )
    return file
