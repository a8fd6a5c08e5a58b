"""Options that mean the same in every verb, each declared once."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from tarsus.base.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from cyclopts import Token

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
Set = Annotated[
    list[str] | None,
    Parameter(
        negative=(), help='path=value, e.g. robot.feet.tip.gap="60 um", or volts=6, hz=50, wave=sine; may be repeated.'
    ),
]
LawFiles = Annotated[
    list[Path] | None, Parameter(negative=(), help="a Python file with laws of your own; may be repeated.")
]
Json = Annotated[bool, FLAG, Parameter(help="print one JSON object instead.")]
Folder = Annotated[Path, Parameter(name=["--output", "-o"])]
MaybeFolder = Annotated[Path | None, Parameter(name=["--output", "-o"])]
Overwrite = Annotated[bool, FLAG, Parameter(help="replace what this verb wrote there before; other files stay.")]
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
On = Annotated[
    str | None,
    Parameter(
        help="where the runs are made, on a Dask cluster: address of its scheduler (tcp://host:8786), a scheduler "
        "file, or local for processes here."
    ),
]
Grounds = Annotated[list[str] | None, Parameter(name="--over", negative=())]


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
