"""How far a process has come with a sweep: to whoever started it, and in the sweep's folder for whoever asks."""

from __future__ import annotations

import contextlib
import json
import os
import secrets
import socket
import threading
import time
from collections import Counter
from collections.abc import Callable, Mapping
from pathlib import Path

from tarsus.files.runstore import COLLECTED_FILE, WORKER_FOLDER

OnProgress = Callable[[int, int, Mapping[str, int]], None]
"""Called as ``(runs done, runs, runs of this call by worker)``."""

EVERY = 5.0
"""Seconds between two signs of life: a hundred processes write twenty small files a second."""


class Progress:
    """Counts runs by who made them, and writes that down every `EVERY` seconds while its block lasts.

    runs: made so far, by who made them; units: made so far. Times are by the process's own clock that only counts up:
    whether a node's clock is right does not matter.
    """

    def __init__(
        self, folder: Path, task: int | None = None, *, runs: int = 0, report: OnProgress | None = None
    ) -> None:
        self.runs: Counter[str] = Counter()
        self.units = 0
        self._whole, self._left, self._report_to = runs, 0, report
        self._task = task
        self._begin = time.monotonic()
        self._over = threading.Event()
        # in containers node and process are often the same in every one
        name = f"{socket.gethostname()}-{os.getpid()}-{secrets.token_hex(4)}"
        self._file = folder / WORKER_FOLDER / f"{name}.json"
        self._collected = folder / COLLECTED_FILE
        self._thread = threading.Thread(target=self._repeat, daemon=True)

    def __enter__(self) -> Progress:
        self._write(ended=False)
        self._thread.start()
        return self

    def __exit__(self, *error: object) -> None:
        self._over.set()
        self._thread.join()
        self._write(ended=True)

    def expect(self, runs: int) -> None:
        """Report that so many runs are missing."""
        self._left = runs
        self._report()

    def count(self, who: str | None, runs: int) -> None:
        """Count a unit that `who` has finished, or another process meanwhile."""
        self._left -= runs
        if who is not None:
            self.runs[who] += runs
            self.units += 1
        self._report()

    def _report(self) -> None:
        if self._report_to is not None:
            self._report_to(self._whole - self._left, self._whole, self.runs)

    def _repeat(self) -> None:
        while not self._over.wait(EVERY):
            self._write(ended=False)

    def _write(self, *, ended: bool) -> None:
        said = {
            "node": socket.gethostname(),
            "pid": os.getpid(),
            "task": self._task,
            "seconds": round(time.monotonic() - self._begin, 3),
            "units": self.units,
            "runs": dict(self.runs),
            "ended": ended,
        }
        part = self._file.with_suffix(".part")
        if ended and self._collected.exists():  # others have finished meanwhile, and nobody asks any more
            with contextlib.suppress(OSError):
                self._file.unlink(missing_ok=True)
                self._file.parent.rmdir()
            return
        try:
            self._file.parent.mkdir(exist_ok=True)
            part.write_text(json.dumps(said), encoding="utf-8")
            os.replace(part, self._file)
        except OSError:  # a sweep does not stop because its progress cannot be written
            with contextlib.suppress(OSError):
                part.unlink(missing_ok=True)
