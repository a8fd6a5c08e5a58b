"""Files that are whole or not there: they are written next to their place and moved into it."""

from __future__ import annotations

import contextlib
import os
import secrets
import socket
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from tarsus.base.errors import InputError

PART = ".part"
"""Ending of a file that is being written for `put` or `claim`."""


def write_text(path: Path, text: str) -> None:
    """Write a text file whole or not at all (temporary file next to it, then `os.replace`).

    Raises InputError if the folder cannot be written or `path` is a folder.
    """
    with written_whole(path) as part:
        part.write_text(text, encoding="utf-8", newline="\n")


@contextlib.contextmanager
def written_whole(path: Path) -> Iterator[Path]:
    """A temporary file next to `path`, with its ending, for the block, which writes it; then `path` is it.

    Raises InputError if the folder cannot be written or `path` is a folder, also where a writer of another library puts
    its own words in place of the operating system's.
    """
    if path.is_dir():
        raise InputError([f"cannot write {path}: it is a folder"])
    # in containers on one disk the number of a process is often the same in every one
    part = path.with_name(f".tarsus-{os.getpid()}-{secrets.token_hex(4)}-{path.name}")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        yield part
        os.replace(part, path)
    except Exception as error:
        refused = _refusal(error)
        if refused is None:
            raise
        raise InputError([f"cannot write {path}: {reason_of(refused)}"]) from error
    finally:
        with contextlib.suppress(OSError):
            part.unlink(missing_ok=True)


def _refusal(error: BaseException) -> OSError | None:
    """The operating system's refusal that an error is, or came after."""
    seen: BaseException | None = error
    while seen is not None and not isinstance(seen, OSError):
        seen = seen.__cause__ or seen.__context__
    return seen


def reason_of(error: OSError) -> str:
    """Why the operating system refuses, in small letters."""
    return error.strerror.lower() if error.strerror else str(error)


def part_of(target: Path) -> Path:
    """A name next to a target that no other writer uses.

    Node and process are for whoever looks at the folder: in containers both are often the same in every one, and
    again after a restart.
    """
    return target.with_name(f"{target.name}.{socket.gethostname()}-{os.getpid()}-{secrets.token_hex(4)}{PART}")


def _fill(part: Path, content: Any) -> None:
    with part.open("xb") as stream:
        if isinstance(content, bytes):
            stream.write(content)
        else:
            content(stream)
        stream.flush()
        os.fsync(stream.fileno())


def put(target: Path, content: Any) -> None:
    """A file from bytes, or from a function that fills a stream; whole or not at all, also when power fails."""
    part = part_of(target)
    try:
        _fill(part, content)
        os.replace(part, target)
    except BaseException:
        part.unlink(missing_ok=True)
        raise


def claim(target: Path, content: bytes) -> None:
    """A file that nobody has written yet; where somebody has, theirs stays."""
    part = part_of(target)
    try:
        _fill(part, content)
        try:
            os.link(part, target)
        except FileExistsError:
            pass
        except OSError:  # a file system without links: all but atomic
            if not target.exists():
                os.replace(part, target)
    finally:
        part.unlink(missing_ok=True)
