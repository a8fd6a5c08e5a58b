"""A Python file of a user's, executed as a module of its own; what goes wrong in it is said with its line."""

from __future__ import annotations

import contextlib
import hashlib
import importlib.util
import os
import sys
import time
import traceback
from collections.abc import Iterator
from pathlib import Path
from types import FrameType, ModuleType
from typing import Any

from tarsus.base.errors import InputError

PATIENCE = 10.0
"""Time [s] of this thread's own that a file may take to be read: a hundred times what importing scipy takes."""


class Endless(BaseException):
    """A file takes longer than `PATIENCE`; no `except Exception` of the file's own catches it."""


def execute(file: Path, purpose: str, source: bytes | None = None) -> ModuleType:
    """The file as a module, from its text: byte code next to it is taken for it by size and second, and a file that was
    edited since may differ in neither.

    purpose: what such a file is there for, "a law file only defines laws"; source: its text, where it was read before,
    perhaps on another machine. Raises InputError with the line at which the file fails, and where it is no Python file.
    """
    source = file.read_bytes() if source is None else source
    digest = hashlib.sha256(source).hexdigest()[:12]
    stem = "".join(c if c.isalnum() else "_" for c in file.stem)
    name = f"tarsus_file_{stem}_{digest}"
    spec = importlib.util.spec_from_file_location(name, file)
    if spec is None or spec.loader is None:
        raise InputError(f"{file}: expected a Python file, its name ending in .py: {purpose}")
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    try:
        code = compile(source, str(file), "exec", dont_inherit=True)
        with patience(str(file), purpose):
            exec(code, module.__dict__)
    except (Exception, SystemExit, Endless) as error:
        del sys.modules[name]
        raise InputError(f"{file}{line_of(error, file)}: {said(error)}") from error
    return module


@contextlib.contextmanager
def patience(name: str, purpose: str) -> Iterator[None]:
    """Stop the lines of the file of that name after `PATIENCE`; where a debugger traces already, it is left alone."""
    if sys.gettrace() is not None:
        yield
        return
    end, lines = time.thread_time() + PATIENCE, 0

    def line(frame: FrameType, event: str, arg: object) -> Any:
        nonlocal lines
        lines += 1
        if lines % 1000 == 0 and time.thread_time() > end:
            raise Endless(f"it takes longer than {PATIENCE:g} s to be read; {purpose}")
        return line

    sys.settrace(lambda frame, event, arg: line if frame.f_code.co_filename == name else None)
    try:
        yield
    finally:
        sys.settrace(None)


def line_of(error: BaseException, file: Path) -> str:
    """``", line 3"``: the last line of the file that the error went through."""
    if isinstance(error, SyntaxError) and error.lineno:
        return f", line {error.lineno}"
    here = os.path.realpath(file)
    lines = [
        frame.lineno
        for frame in traceback.extract_tb(error.__traceback__)
        if frame.lineno and os.path.realpath(frame.filename) == here
    ]
    return f", line {lines[-1]}" if lines else ""


def said(error: BaseException) -> str:
    """What an error says, with its kind."""
    if isinstance(error, Endless):
        return str(error)
    return f"{type(error).__name__}: {error}" if str(error) else type(error).__name__
