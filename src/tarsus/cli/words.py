"""How arguments are written on a command line: for each type that a verb takes, the words and what becomes of them."""

from __future__ import annotations

import ast
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal, get_args, get_origin

from cyclopts import Parameter

from tarsus.cli.declared import NO_DEFAULT, Argument
from tarsus.cli.named import pairs_of, texts_of, values_of
from tarsus.cli.options import FLAG, WHOLE, MaybeSeed, Seed, Threads


def range_of(word: str, option: str) -> tuple[str, str]:
    """`a:b` as both ends of a range, still as texts."""
    return _ends(word, f"{option} takes both ends of a range, a:b")


def _ends(word: str, takes: str, whole: str = "") -> tuple[str, str]:
    from tarsus.base.errors import InputError

    low, colon, high = (one.strip() for one in word.partition(":"))
    if not (low and colon and high):
        raise InputError(f"{takes}, got '{whole or word}'")
    return low, high


def counts_of(word: str, option: str) -> tuple[int, int]:
    """`a:b` as two whole numbers."""
    from tarsus.base.errors import InputError

    takes = f"{option} takes two whole numbers, fewest:most"
    ends = _ends(word, takes)
    if not all(one.isdecimal() for one in ends):
        raise InputError(f"{takes}, got '{word}'")
    return int(ends[0]), int(ends[1])


def ranges_of(words: Sequence[str], option: str) -> dict[str, tuple[str, str]]:
    """`PATH=a:b` words as both ends of a range by path."""
    takes = f"{option} takes PATH=a:b, such as robot.feet.tip.gap=66um:74um"
    return {path: _ends(text or "", takes, f"{path}={text}") for path, text in pairs_of(words, option, takes).items()}


def ranges_or_file(words: Sequence[str], option: str) -> Any:
    """The same, or the name of a file with draws."""
    return words[0] if len(words) == 1 and words[0].endswith(".npz") else ranges_of(words, option)


def axis_of(word: str, option: str) -> tuple[str, ...]:
    """`PATH=a:b` or `PATH=a:b:log` as a path, both ends and "log"."""
    ends, log = (word.removesuffix(":log"), ("log",)) if word.endswith(":log") else (word, ())
    ((path, (low, high)),) = ranges_of([ends], option).items()
    return path, low, high, *log


@dataclass(frozen=True)
class Spelling:
    """How values of a type are written: what cyclopts reads, what the help adds, and what the words become."""

    words: Any
    said: str = ""
    value: Callable[[Any, str], Any] = lambda word, option: word


_TEXT = Annotated[str, Parameter(allow_leading_hyphen=True)]
_MANY = Annotated[list[str], Parameter(negative=())]
_FILES = Annotated[list[Path], Parameter(negative=(), consume_multiple=True)]

KINDS = {
    "str": Spelling(str),
    "int": Spelling(WHOLE),
    "float": Spelling(Annotated[float, Parameter(allow_leading_hyphen=True)]),
    "float | str": Spelling(_TEXT),
    "Quantity": Spelling(_TEXT),
    "ProgramOptions": Spelling(_TEXT),
    "Name": Spelling(str),
    "str | os.PathLike[str]": Spelling(Path),
    "FilePath": Spelling(Path),
    "Source": Spelling(Path),
    "Saved": Spelling(Path),
    "Study": Spelling(Path),
    "CalibrationStudy": Spelling(Path),
    "Recorded": Spelling(Path),
    "Sequence[Recorded]": Spelling(_FILES),
    "Sequence[str | os.PathLike[str]]": Spelling(_MANY, "may be repeated"),
    "Sequence[str]": Spelling(_MANY, "may be repeated"),
    "Range": Spelling(_TEXT, "a:b", range_of),
    "Counts": Spelling(str, "fewest:most", counts_of),
    "Ranges": Spelling(_MANY, "PATH=a:b, may be repeated", ranges_of),
    "Ranges | FilePath": Spelling(_MANY, "PATH=a:b, may be repeated; or a file", ranges_or_file),
    "Quantities": Spelling(_MANY, "NAME=VALUE, may be repeated", texts_of),
    "Values": Spelling(_MANY, "NAME=VALUE, may be repeated", values_of),
    "Axis": Spelling(_TEXT, "PATH=a:b or PATH=a:b:log", axis_of),
}
"""By the type of an argument as its function declares it (`tarsus.base.arguments`)."""

OWN = {"seed": (Seed, MaybeSeed), "threads": (Threads, Threads)}
"""Options that mean the same in every verb, by name; without a default the second."""


def kind_of(argument: Argument) -> Spelling | None:
    """How an argument is written; None of one that only Python has."""
    if argument.type.startswith("Literal["):
        return Spelling(Literal[tuple(ast.literal_eval(argument.type.removeprefix("Literal")))])  # type: ignore[misc]
    if argument.type == "bool":
        return Spelling(Annotated[bool, FLAG] if argument.default is False else bool)
    return KINDS.get(argument.type)


def option_of(argument: Argument, kind: Spelling) -> tuple[Any, Any]:
    """What cyclopts is given of an argument: its type and its default."""
    default = argument.default
    words = OWN[argument.name][default is None] if argument.name in OWN else kind.words
    if default is None or (isinstance(default, tuple) and not default):
        words, default = _or_none(words), None
    elif isinstance(default, tuple):
        default = ":".join(map(str, default))
    said = f"{argument.said.rstrip('.')} ({kind.said})." if kind.said else argument.said
    return Annotated[words, Parameter(help=said)] if argument.name not in OWN else words, default


def _or_none(words: Any) -> Any:
    """A type with what is said of it, or None."""
    bare, *said = get_args(words) if get_origin(words) is Annotated else (words,)
    return Annotated[bare | None, *said] if said else bare | None


def is_given(value: Any) -> bool:
    """Whether an option was said, or has a default."""
    return value is not None and value is not NO_DEFAULT
