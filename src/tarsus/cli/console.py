"""What the verbs share: sentences and progress on stderr, tables and JSON on stdout."""

from __future__ import annotations

import contextlib
import os
import shutil
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from enum import IntEnum
from pathlib import Path
from typing import TYPE_CHECKING, Any, TextIO

from tarsus.cli.lines import Lines
from tarsus.files.jsontext import json_text

if TYPE_CHECKING:
    from tarsus.tables.table import Table


class Voice(IntEnum):
    """How much a command line says besides its results and errors."""

    QUIET = -1
    USUAL = 0
    VERBOSE = 1


_VOICE: ContextVar[Voice] = ContextVar("voice", default=Voice.USUAL)


@contextmanager
def speaking(voice: Voice) -> Iterator[None]:
    """Say so much for the length of the block."""
    before = _VOICE.set(voice)
    try:
        yield
    finally:
        _VOICE.reset(before)


def voice() -> Voice:
    """How much is said now."""
    return _VOICE.get()


def complain(problems: Iterable[str]) -> None:
    """Print each problem as one line on stderr."""
    try:
        for problem in problems:
            print(f"tarsus: {problem}", file=sys.stderr)
    except BrokenPipeError:
        unread(sys.stderr)


def unread(stream: TextIO) -> None:
    """Let a stream that nobody reads any more end in nothing: Python would complain when it flushes it at exit."""
    with contextlib.suppress(OSError, ValueError):
        os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())


def note(remarks: Iterable[str]) -> None:
    """Print each remark as one line on stderr, unless nothing but results is asked for."""
    if voice() > Voice.QUIET:
        complain(f"note: {remark}" for remark in remarks)


def detail(text: str) -> None:
    """One line on stderr for who asked for more (-v)."""
    if voice() is Voice.VERBOSE:
        print(f"tarsus: {text}", file=sys.stderr, flush=True)


def wrote(paths: Iterable[Path]) -> None:
    """Name files that were written, on stdout, unless nothing but results is asked for."""
    if voice() > Voice.QUIET:
        for path in paths:
            print(f"wrote {path}")


def os_sentence(error: OSError) -> str:
    """The operating system's refusal as a sentence naming the file."""
    where = f"`{error.filename}`" if error.filename else "a file"
    reason = (error.strerror or str(error)).lower()
    return f"Cannot use {where}: {reason}."


def print_json(value: Any) -> None:
    """One JSON object on stdout; a number that is not finite becomes null."""
    print(json_text(value))


def table(*tables: Table) -> None:
    """Tables on stdout, as wide as its lines."""
    print("\n\n".join(one.text(_width()) for one in tables))


def show(found: Any, json: bool = False, written: Iterable[Path] = ()) -> int:
    """A result of a verb as its table, or as its plain data, then remarks that no note of it says; files that were
    written."""
    shown = found.table()
    if json:
        print_json(found.to_dict())
    else:
        table(shown)
        wrote(written)
    note(one for one in getattr(found, "remarks", ()) if one not in shown.notes)
    return 0


PIPED = 120
"""Letters of a line where results go to a file or another program: what an editor or a page of a log shows."""


def _width() -> int:
    """Letters of a line of the terminal that results go to."""
    return shutil.get_terminal_size().columns if sys.stdout.isatty() else PIPED


def files(written: Sequence[Path], data: dict[str, Any] | None) -> int:
    """Files that were written, by name, or what is said of them in JSON."""
    wrote(written) if data is None else print_json(data)
    return 0


@contextmanager
def progress_bar(title: str, *, time_left: bool = False) -> Iterator[Callable[[int, int, Any], None]]:
    """How work goes, on stderr for the length of the block.

    Yields a function `progress(done, total, what)`. `time_left` shows the time left next to the time taken.
    """
    if voice() is Voice.QUIET:
        yield lambda done, total, what: None
        return
    with Lines(title, time_left) as lines:
        yield lambda done, total, what: lines.say(done, total, what if isinstance(what, str) else workers_line(what))


SHOWN = 6
"""Workers named: as many as a line takes."""


def workers_line(runs: Mapping[str, int]) -> str:
    """Runs by who makes them, where there are several."""
    shown = "  ".join(f"{name} {count}" for name, count in sorted(runs.items())[:SHOWN])
    return "" if len(runs) < 2 else f"{len(runs)} workers: {shown}"


def spinner(text: str) -> contextlib.AbstractContextManager[object]:
    """The same of work that is one piece."""
    return contextlib.nullcontext() if voice() is Voice.QUIET else Lines(text, False)
