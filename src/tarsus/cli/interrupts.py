"""Ctrl-C: the first one ends the work once what is under way is finished, and says so; a second one ends it now.

Finished parts are whole files: a process that ends between two of its steps loses none of them.
"""

from __future__ import annotations

import os
import shlex
import signal
import sys
import threading
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from contextvars import ContextVar
from typing import Any

from tarsus.cli import console

INTERRUPTED = 130
"""Exit code."""

KEPT = "finished parts are kept"

SOON = 0.2
"""Seconds after which it is said what is waited for: what ends sooner says that it ended, and no more."""

_KEEPS: ContextVar[bool] = ContextVar("keeps", default=False)


@contextmanager
def resumable() -> Iterator[None]:
    """Of work whose finished parts are kept: an interruption in the block says so, and how to go on."""
    before = _KEEPS.set(True)
    try:
        yield
    except KeyboardInterrupt:
        raise KeyboardInterrupt(KEPT) from None
    finally:
        _KEEPS.reset(before)


def sentence(stop: KeyboardInterrupt, argv: Sequence[str]) -> str:
    """What to say of an interruption: of a verb that keeps what is finished, the line that goes on."""
    if stop.args != (KEPT,):
        return "interrupted, nothing further was written"
    again = [*(word for word in argv if word not in ("--overwrite", "--resume")), "--resume"]
    return f"interrupted; {KEPT}, continue with `{shlex.join(['tarsus', *again])}`"


@contextmanager
def heard(argv: Sequence[str]) -> Iterator[None]:
    """Answer interruptions of what the command line ``argv`` asks; a process that takes them otherwise is left so."""
    own = signal.getsignal(signal.SIGINT) is signal.default_int_handler
    if not own or threading.current_thread() is not threading.main_thread():  # no other thread hears signals
        yield
        return
    with ExitStack() as stack:

        def first(number: int, frame: Any) -> None:
            signal.signal(signal.SIGINT, second)
            kept = f", and {KEPT}" if _KEEPS.get() else ""
            said = f"ending once what is under way is finished; Ctrl-C again ends it now{kept}"
            waiting = threading.Timer(SOON, _say, [said])
            waiting.daemon = True
            waiting.start()
            stack.callback(waiting.cancel)
            raise KeyboardInterrupt

        def second(number: int, frame: Any) -> None:
            try:
                _say(sentence(KeyboardInterrupt(*[KEPT] * _KEEPS.get()), argv))
            finally:
                os._exit(INTERRUPTED)

        stack.callback(signal.signal, signal.SIGINT, signal.signal(signal.SIGINT, first))
        yield


def _say(what: str) -> None:
    """A sentence in place of the line that says how far the work is."""
    if sys.stderr.isatty():
        print("\r\x1b[K", end="", file=sys.stderr)
    console.complain([what])
