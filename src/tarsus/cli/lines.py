"""How long work goes: one line that changes on a terminal; plain lines in logs, where it would be noise."""

from __future__ import annotations

import shutil
import sys
import threading
import time

EVERY = 10.0
"""Seconds between two lines: what someone who waits takes for a sign of life."""

SLOWER = 20.0
"""Once this share of the time so far is longer than `EVERY`, lines come that much later: a day of work makes a hundred
lines more than an hour, and not eight thousand."""

STEP = 0.1
"""Share of the work that is worth a line before its time."""

SOON = 2.0
"""Seconds within which no second line comes: what is over sooner says nothing."""


BLINK = 0.1
"""Seconds between two states of a terminal's line, which nobody could read faster."""


class Lines:
    """Lines on stderr for the length of a block: how much is done, of what, for how long."""

    def __init__(self, title: str, time_left: bool) -> None:
        self._title, self._left = title, time_left
        self._begin = self._last = time.monotonic()
        self._at: tuple[int, int, str] | None = None
        self._first: tuple[float, int] | None = None
        self._shown, self._live = 0.0, sys.stderr.isatty()
        self._lock, self._over = threading.Lock(), threading.Event()
        self._thread = threading.Thread(target=self._beat, daemon=True)

    def __enter__(self) -> Lines:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._over.set()
        self._thread.join()
        if self._live:
            print("\r\x1b[K", end="", file=sys.stderr, flush=True)

    def say(self, done: int, total: int, what: str) -> None:
        """Take note of what is done; a line where that is a step further."""
        with self._lock:
            self._at = done, total, what
            if self._first is None:
                # what an earlier call had done says nothing of the pace
                self._first, self._shown = (time.monotonic(), done), done / max(total, 1)
            elif self._live or done / max(total, 1) - self._shown >= STEP - 1e-9:
                self._after(BLINK if self._live else SOON)

    def _beat(self) -> None:
        while not self._over.wait(0.5 if self._live else min(EVERY, SOON)):
            with self._lock:
                self._after(0.0 if self._live else max(EVERY, (time.monotonic() - self._begin) / SLOWER))

    def _after(self, pause: float) -> None:
        """A line, unless the last one was within a pause [s]."""
        now = time.monotonic()
        if now - self._last < pause:
            return
        self._last = now
        words = [f"{now - self._begin:.0f} s"]
        if self._at is not None and self._first is not None:
            done, total, what = self._at
            self._shown = done / max(total, 1)
            words = [f"{done} of {total} ({100.0 * self._shown:.0f} %)", *([what] if what else []), *words]
            begin, before = self._first
            if self._left and before < done < total:  # what follows the last step is of unknown length
                words.append(f"about {(now - begin) * (total - done) / (done - before):.0f} s left")
        text = f"{self._title}: {', '.join(words)}"
        if self._live:
            print(f"\r{text[: shutil.get_terminal_size().columns - 1]}\x1b[K", end="", file=sys.stderr, flush=True)
        else:
            print(text, file=sys.stderr, flush=True)
