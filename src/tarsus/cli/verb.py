"""A command that is a function of the library: where that is, and what becomes of its result. A row of `verbs`."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

from tarsus.cli.declared import NO_DEFAULT, Argument, Declaration

SCENES = ("SceneLike", "SceneLike | Sweep", "Run | SceneLike")
"""Types of arguments that a device or a scene file is named for."""

MADE = ("progress", "law", "threads", "resume", "output")
"""Arguments that every verb gets from options of one meaning, or from the command line itself."""


@dataclass(frozen=True)
class Verb:
    """A row of the table of verbs.

    function: "package.module:name" of what it is in Python; words: how many arguments are words and no options; files:
    home of the names that it may write into its folder; endings: home of those of the file that it writes; write, page:
    homes of functions that write a result into a folder, and make its page, where the result has no `write` and the
    function no `output`; folder: ending of the folder where none is named; title: of the bar; own: whether a file of
    its name here does otherwise.
    """

    function: str
    words: int = 1
    files: str = ""
    endings: str = ""
    write: str = ""
    page: str = ""
    folder: str = ""
    title: str = ""
    own: bool = False

    @cached_property
    def declared(self) -> Declaration:
        """The function as its file declares it."""
        return Declaration(self.function)

    @cached_property
    def taken(self) -> dict[str, Argument]:
        """Arguments of the function by name."""
        return {one.name: one for one in self.declared.arguments}

    @property
    def scene(self) -> str | None:
        """The argument that names a scene."""
        return next((name for name, one in self.taken.items() if one.type in SCENES), None)

    @property
    def needs_output(self) -> bool:
        """Whether the line has to say where it is written."""
        output = self.taken.get("output")
        return bool(self.endings) or (output is not None and output.default is NO_DEFAULT and not self.folder)
